"""Switches, open tasks and the request for a better layout of a page; not part of undo."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from finlab.analysis import Bounds
from finlab.analysis.improvement_text import GOAL_WORDS
from finlab.analysis.moves import azimuth, is_mirrored
from finlab.errors import FinlabError
from finlab.forces.attainable import WrenchHalf
from finlab.layout import Layout
from webapp.session.state import number, one_of

LOG = "Log"
"""Task in which a log is judged, and its moments are put on the robot."""
TASKS = ("Design", "Allocate", "Simulate", "Export", LOG)
CANDIDATES = "Candidates"
"""Tab of the drawer that shows the modes of a network's candidates, of robots of fins alone."""
NULL_SPACE = "Null space"
"""Tab of the drawer that shows commands along the null space of an answer."""
TWO_ROBOTS = "Two robots"
"""Tab of the drawer that compares two robots; the view shows both."""
DRAWERS: dict[str, tuple[str, ...]] = {
    "Design": ("Reach", "Improve", "Capability"),
    "Allocate": (CANDIDATES, NULL_SPACE, "Comparison", TWO_ROBOTS),
    "Simulate": ("Swim over time",),
    "Export": (),
    LOG: ("Log over time", "Replays"),
}
MODE_DRAWERS = (CANDIDATES, NULL_SPACE)
"""Tabs that show other commands for the wrench of an answer."""
DRAWN: dict[str, WrenchHalf | None] = {"none": None, "forces": "force", "torques": "torque"}
"""What set can be drawn, by the word on its button."""

ARROW_LENGTHS = (0.2, 4.0)
"""Factors by which arrows may be shorter or longer than they are drawn at first."""
DARK = "dark"
"""What a page calls the dark colour scheme of its system."""


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
    handle: bool = True
    """Whether the wrench can be pulled in the view."""
    presents: bool = False
    """Whether the page shows nothing but the robot and what is said of it, in large type."""
    has_own_theme: bool = False
    """Whether the user has chosen light or dark; until then it is the system's."""
    arrows: bool = True
    """Forces of actuators are drawn as arrows."""
    fixed_scale: bool = False
    """Arrows are scaled by the most that the robot can give, not by what it gives now."""
    arrow_length: float = 1.0
    """Factor of the length of all arrows."""
    drawn: str = "none"
    """Key of `DRAWN`: the attainable set that is shown."""

    def with_value(self, key: str, value: Any) -> "Display":
        """One field changed. FinlabError: there is no such field, or not with this value."""
        value_now = getattr(self, key, None)
        if value_now is None:
            raise FinlabError(f"there is no switch {key!r:.40}")
        if key == "drawn":
            one_of(value, key, DRAWN)
        if isinstance(value_now, bool) and not isinstance(value, bool):
            raise FinlabError(f"{key}: expected on or off, got {value!r:.40}")
        changes = {key: value}
        if key == "arrow_length":
            changes[key] = number(value, "arrow length", *ARROW_LENGTHS)
        if key == "dark":
            changes["has_own_theme"] = True
        return replace(self, **changes)


GOALS_BY_WORDS = {words: name for name, words in GOAL_WORDS.items()}
"""What may be improved, in words -> the name that the search knows."""
MoveRange = tuple[float, float, float, float]
"""How far an actuator may go along x, y and z [m] and turn [deg], either way."""
MOVE_RANGE: MoveRange = (0.05, 0.05, 0.05, 180.0)
"""The range that a search begins with, of robots up to a metre; that of larger ones grows with
them."""
MOST_REACH = 0.5
"""How far an actuator of such a robot may go at most [m]; of a larger one, as far as it is long."""
REACH_SHARE = 0.05
"""The range along x, y and z of a robot that is longer than a metre, over its length."""


@dataclass(frozen=True)
class SearchRequest:
    """What the user has asked for so far; it may name actuators that are gone by now."""

    goal: str = next(iter(GOALS_BY_WORDS))
    """Key of `GOALS_BY_WORDS`."""
    fixed: tuple[str, ...] = ()
    """Names of actuators that stay where they are."""
    move_range: MoveRange | None = None
    """How far each of the others may go; None for what fits the robot."""

    def with_goal(self, goal: Any) -> "SearchRequest":
        """Another goal."""
        return replace(self, goal=one_of(goal, "goal", GOALS_BY_WORDS))

    def with_fixed_toggled(self, name: str) -> "SearchRequest":
        """An actuator fixed, or free to move again."""
        others = tuple([fixed for fixed in self.fixed if fixed != name])
        return replace(self, fixed=others if name in self.fixed else (*others, name))

    def with_move_range(
        self, move_range: tuple[Any, ...], most_reach: float = MOST_REACH
    ) -> "SearchRequest":
        """Another range of all: along x, y and z, at most so far [m], and turn [deg]."""
        x, y, z = (
            number(value, f"reach along {axis} [m]", 0.0, most_reach)
            for value, axis in zip(move_range, "xyz", strict=False)
        )
        turn = number(move_range[3], "turn [°]", 0.0, 180.0)
        return replace(self, move_range=(x, y, z, turn))

    def range_of(self, layout: Layout) -> MoveRange:
        """How far each actuator of a layout may go that may move."""
        if self.move_range is not None:
            return self.move_range
        length = _length_of(layout)
        if length <= 1.0:
            return MOVE_RANGE
        reach = float(f"{REACH_SHARE * length:.1g}")
        return (reach, reach, reach, MOVE_RANGE[3])

    def bounds(self, layout: Layout) -> dict[str, Bounds]:
        """Where each actuator that may move may go from where it is.

        Raises:
            FinlabError: none may.
        """
        bounds = {}
        *reach, turn = self.range_of(layout)
        for actuator in layout.actuators:
            if actuator.name in self.fixed:
                continue
            limits = Bounds.around(actuator, reach, math.radians(turn))
            if is_mirrored(actuator, actuator):  # it stays in the mirror plane
                y = actuator.position[1]
                angle = azimuth(actuator)
                tilt = limits.tilt if abs(actuator.frame[0][1]) < 0.5 else (0.0, 0.0)
                limits = replace(limits, y=(y, y), mounting_angle=(angle, angle), tilt=tilt)
            bounds[actuator.name] = limits
        if not bounds:
            raise FinlabError("nothing may move; press the numbers of what may")
        return bounds


def most_reach(layout: Layout) -> float:
    """Returns how far an actuator of a layout may go at most along an axis [m]."""
    return max(MOST_REACH, float(f"{_length_of(layout):.2g}"))


def _length_of(layout: Layout) -> float:
    """The longest way between two actuators of a layout along an axis [m]."""
    return float(np.ptp(layout.position, axis=0).max())
