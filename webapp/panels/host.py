"""What a panel may ask of the page it stands in."""

from collections.abc import Callable
from typing import Protocol

import viser

from finlab.allocation.allocation import Allocation
from finlab.forces.reach import Ranges
from webapp.scene.scenery import Scenery
from webapp.session import Session
from webapp.tasks.analyst import Beside, Findings, Question
from webapp.tasks.answering import Answering
from webapp.tasks.background import Newest
from webapp.tasks.comparison import Comparison
from webapp.tasks.exports import Exports
from webapp.tasks.improving import Improver
from webapp.tasks.playback import Playback
from webapp.tasks.sweeping import Sweep
from webapp.tasks.swimming import Swimming


class Host(Protocol):
    """The page of one browser, as a panel sees it."""

    client: viser.ClientHandle
    """The browser."""
    session: Session
    """What it shows."""

    answering: Answering
    """The newest answer, its modes and what of it is on the robot."""
    playback: Playback
    """The refinement, step by step."""
    analyst: Newest[Question, Findings]
    """What the layout can do."""
    ranging: Newest[Beside, Ranges]
    """How far each component of the target can go."""
    improver: Improver
    """The search for a better layout."""
    comparison: Comparison
    """Other methods on the same question."""
    swimming: Swimming
    """A robot that swims."""
    scenery: Scenery
    """What is seen beside the panel."""
    exports: Exports
    """Files to take home."""
    sweep: Sweep
    """A component of the target on its way through a range."""

    @property
    def shown(self) -> Allocation | None:
        """The answer with the command that is on the robot."""

    @property
    def busy(self) -> bool:
        """True while a newer answer is being computed."""

    def fault(self, error: Exception) -> None:
        """Tell of something that we have got wrong."""

    def do(self, act: Callable[[], object]) -> None:
        """Carry out an intent: show what changed, or tell the user why not."""

    def notify(self, title: str, body: str, *, good: bool = False) -> None:
        """Show a note to the user."""


class Panel(Protocol):
    """A group of widgets."""

    def refresh(self) -> None:
        """Write the session and the answer into the widgets."""
