"""Intents about what is looked at; none of them is part of undo."""

from dataclasses import dataclass, replace
from typing import Any

from webapp.session.core import Core
from webapp.session.search_request import SearchRequest
from webapp.session.state import chosen

TASKS = ("Design", "Allocate", "Simulate", "Export")
DRAWERS: dict[str, tuple[str, ...]] = {
    "Design": ("Reach", "Improve"),
    "Allocate": ("Candidates", "Comparison"),
    "Simulate": ("Swim over time",),
    "Export": (),
}


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


class Looking(Core):
    """Tasks, modes and switches."""

    desk = Desk()

    @property
    def task(self) -> str:
        """Which of `TASKS` is open."""
        return self.desk.task

    @property
    def drawer(self) -> str | None:
        """What of the drawer is seen; None where it is folded, or the task has none."""
        return None if self.desk.folded else self.desk.opened[self.task] or None

    def show_task(self, name: str) -> None:
        """Open a task."""
        self.desk = replace(self.desk, task=chosen(name, "task", TASKS))
        self.step = None

    def show_drawer(self, name: str) -> None:
        """Open the drawer at one of its tabs, and the task to which it belongs."""
        task = next((task for task, names in DRAWERS.items() if name in names), self.task)
        chosen(name, "drawer", DRAWERS[task])
        others = tuple(pair for pair in self.desk.drawers if pair[0] != task)
        self.desk = Desk(task, (*others, (task, name)))
        self.step = None

    def fold_drawer(self) -> None:
        """Leave only the tabs of the drawer, or open it again."""
        self.desk = replace(self.desk, folded=not self.desk.folded)

    def show_mode(self, index: int) -> None:
        """Show one of the answer's modes on the robot."""
        self.mode = max(0, int(index))

    def show_step(self, step: int, steps: int) -> None:
        """Show the network's proposals after some steps of their refinement, of as many as there are."""
        self.step = max(step, 0) if step < steps else None

    def set_loop(self, value: Any) -> None:
        """Whether the refinement begins anew at its end."""
        self.loops = bool(value)

    def set_display(self, key: str, value: Any) -> None:
        """One field of `Display`."""
        self.display = self.display.with_value(key, value)

    def toggle(self, key: str) -> None:
        """Turn one switch of `Display` on or off."""
        self.set_display(key, not getattr(self.display, key))

    def set_swim(self, key: str, value: Any) -> None:
        """One field of `SwimSettings`."""
        self.swim = self.swim.with_value(key, value)

    def set_draft(self, draft: SearchRequest) -> None:
        """What the next search for a better layout is to do."""
        self.draft = draft
