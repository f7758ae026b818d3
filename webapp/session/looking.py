"""Switches and open tasks of a page; not part of undo."""

from dataclasses import dataclass, replace
from typing import Any

from finlab.errors import FinlabError
from finlab.forces.attainable import Kind
from webapp.session.state import chosen

TASKS = ("Design", "Allocate", "Simulate", "Export")
DRAWERS: dict[str, tuple[str, ...]] = {
    "Design": ("Reach", "Improve"),
    "Allocate": ("Candidates", "Comparison"),
    "Simulate": ("Swim over time",),
    "Export": (),
}
DRAWN: dict[str, Kind | None] = {"none": None, "forces": "force", "torques": "torque"}
"""What set can be drawn, by the word on its button."""


@dataclass(frozen=True)
class Desk:
    """Which task is open, and what lies in the drawers."""

    task: str = "Allocate"
    drawers: tuple[tuple[str, str], ...] = ()
    """Tasks, and what was chosen to lie uppermost in their drawers."""
    folded: bool = False
    """Whether of the drawer only its tabs are seen."""

    @property
    def opened(self) -> dict[str, str]:
        """What lies uppermost in the drawer of each task; nothing where a task has none."""
        return {task: names[0] if names else "" for task, names in DRAWERS.items()} | dict(self.drawers)


@dataclass(frozen=True)
class Display:
    """Switches of one page."""

    frozen: bool = False
    """Fins hold still at their zero direction."""
    shadows: bool = True
    """Cast shadows; slow without a graphics card."""
    dark: bool = False
    drawn: str = "none"
    """Key of `DRAWN`: the attainable set that is shown."""

    def with_value(self, key: str, value: Any) -> "Display":
        """One field changed. FinlabError: there is no such field, or not with this value."""
        now = getattr(self, key, None)
        if now is None:
            raise FinlabError(f"there is no switch {key!r:.40}")
        if key == "drawn":
            chosen(value, key, DRAWN)
        if isinstance(now, bool) and not isinstance(value, bool):
            raise FinlabError(f"{key}: expected on or off, got {value!r:.40}")
        return replace(self, **{key: value})
