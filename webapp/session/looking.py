"""Switches, open tasks and the request for a better layout of a page; not part of undo."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from finlab.analysis import Bounds
from finlab.analysis.moves import azimuth, is_mirrored
from finlab.errors import FinlabError
from finlab.forces.attainable import WrenchHalf
from finlab.layout import Layout
from webapp.session.state import chosen, number

TASKS = ("Design", "Allocate", "Simulate", "Export", "Log")
DRAWERS: dict[str, tuple[str, ...]] = {
    "Design": ("Reach", "Improve"),
    "Allocate": ("Candidates", "Null space", "Comparison"),
    "Simulate": ("Swim over time",),
    "Export": (),
    "Log": ("Log over time", "Replays"),
}
WAYS = DRAWERS["Allocate"][:2]
"""What shows several ways to do the same; the first is of robots of fins alone."""
DRAWN: dict[str, WrenchHalf | None] = {"none": None, "forces": "force", "torques": "torque"}
"""What set can be drawn, by the word on its button."""


@dataclass(frozen=True)
class Desk:
    """Which task is open, and what lies in the drawers."""

    task: str = "Allocate"
    drawers: tuple[tuple[str, str], ...] = ()
    """Tasks, and what was chosen to lie uppermost in their drawers."""
    folded: bool = False
    """Whether of the drawer only its tabs are seen."""

    @cached_property
    def opened(self) -> dict[str, str]:
        """What lies uppermost in the drawer of each task; nothing where a task has none."""
        return {task: names[0] if names else "" for task, names in DRAWERS.items()} | dict(
            self.drawers
        )


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


GOAL_WORDS = {
    "weakest direction": "weakest_direction",
    "power for a mission": "mission_power",
    "worst single failure": "worst_single_failure",
}
"""What may be improved, in words, and the name that the search knows."""
GOAL_UNITS = {
    words: " W" if name == "mission_power" else " N" for words, name in GOAL_WORDS.items()
}
WAY = (0.05, 0.05, 0.05, 180.0)
"""How far an actuator may go along x, y and z [m] and turn either way [deg] unless it is said
otherwise."""

Way = tuple[float, float, float, float]


@dataclass(frozen=True)
class SearchRequest:
    """What the user has asked for so far; it may name actuators that are gone by now."""

    goal: str = next(iter(GOAL_WORDS))
    held: tuple[str, ...] = ()
    way: Way = WAY
    """How far they may go along x, y, z [m] and turn [deg]."""

    def with_goal(self, goal: Any) -> "SearchRequest":
        """Another goal."""
        return replace(self, goal=chosen(goal, "goal", GOAL_WORDS))

    def with_held_toggled(self, name: str) -> "SearchRequest":
        """An actuator held, or free to move again."""
        held = tuple(other for other in self.held if other != name)
        return replace(self, held=held if name in self.held else (*held, name))

    def with_way(self, way: tuple[Any, ...]) -> "SearchRequest":
        """Other bounds of all."""
        x, y, z = (
            number(v, f"reach along {axis} [m]", 0.0, 0.5)
            for v, axis in zip(way, "xyz", strict=False)
        )
        return replace(self, way=(x, y, z, number(way[3], "turn [°]", 0.0, 180.0)))

    def bounds(self, layout: Layout) -> dict[str, Bounds]:
        """Where each that may move may go from where it is. FinlabError: none may."""
        bounds = {}
        for part in layout.actuators:
            if part.name not in self.held:
                *reach, turn = self.way
                around = Bounds.around(part, reach, math.radians(turn))
                if is_mirrored(part, part):  # it stays in the mirror plane
                    y = part.position[1]
                    angle = azimuth(part)
                    tilt = around.tilt if abs(part.frame[0][1]) < 0.5 else (0.0, 0.0)
                    around = replace(around, y=(y, y), mounting_angle=(angle, angle), tilt=tilt)
                bounds[part.name] = around
        if not bounds:
            raise FinlabError("nothing may move; press the numbers of what may")
        return bounds
