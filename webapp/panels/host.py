"""What a panel may ask of the page it stands in."""

from collections.abc import Callable
from typing import Protocol

import viser

from finlab.allocation.allocation import Allocation
from webapp.analyst import Analyst
from webapp.comparison import Comparison
from webapp.density import Densities
from webapp.improving import Improver
from webapp.modes import Mode
from webapp.session import Session


class Host(Protocol):
    """The page of one browser, as a panel sees it."""

    client: viser.ClientHandle
    """The browser."""
    session: Session
    """What it shows."""

    @property
    def best(self) -> Allocation | None:
        """The newest answer; it may be older than the state."""

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Its distinct modes."""

    @property
    def shown(self) -> Allocation | None:
        """The answer with the chosen mode's command."""

    @property
    def busy(self) -> bool:
        """True while a newer answer is being computed."""

    @property
    def error(self) -> str | None:
        """Why there is no answer to the present state, if there is none."""

    @property
    def newtons(self) -> float:
        """Force [N] that an arrow of 0.1 m stands for."""

    @property
    def densities(self) -> Densities | None:
        """What the network proposed for the newest answer, where the method has a network."""

    analyst: Analyst
    """What the layout can do."""
    improver: Improver
    """The search for a better layout."""
    comparison: Comparison
    """Other methods on the same question."""

    @property
    def frame(self) -> int | None:
        """Which step of the refinement is on the robot, None while none is played."""

    def play_refinement(self) -> None:
        """Show the refinement step by step."""

    def compare(self) -> None:
        """Ask the other methods."""

    def do(self, act: Callable[[], object]) -> None:
        """Carry out an intent: show what changed, or tell the user why not."""

    def notify(self, title: str, body: str, *, good: bool = False) -> None:
        """Show a note to the user."""

    def look_from(self, view: str) -> None:
        """Move the camera."""

    def export_html(self) -> None:
        """Make a standalone page of the 3D view and send it to the browser."""

    def export_picture(self) -> None:
        """Make a picture of the 3D view and send it to the browser."""

    def export_graph(self) -> None:
        """Make the layout graph file and send it to the browser."""


class Panel(Protocol):
    """A group of widgets."""

    def refresh(self) -> None:
        """Write the session and the answer into the widgets."""
