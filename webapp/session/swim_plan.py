"""Settings of swims, and the plan that comes of them when a swim starts."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from finlab.assets import PAPER_LAYOUTS
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.research.evaluation.experiments.hard_days import CURRENT, HARD_DAYS, TWO, HardDay
from finlab.swim.control import CONTROLLERS, make_controller, steerable_loss
from finlab.swim.simulation import SHIPPED, Fault, Trajectory, make_trajectory
from webapp.session.state import State, number, one_of

LOST_IN_CURRENT = HardDay(
    "lost-in-current",
    "In a current of 0.07 m/s a fin is lost half-way, and a monitor has to find out.",
    current=CURRENT,
    lost=1,
    announced=False,
)
SCENARIOS: dict[str, HardDay] = {
    day.name: day
    for day in (*HARD_DAYS, LOST_IN_CURRENT)
    if not day.mixed_fins and (day.jets or day.layouts in (PAPER_LAYOUTS, TWO, PAPER_LAYOUTS[:1]))
}
CHOICES = {"path": tuple(SHIPPED), "controller": tuple(CONTROLLERS)}
"""Settings that are one of several."""
SPEEDS = (0.1, 8.0)
"""Simulated time per time on the wall that may be asked for."""


@dataclass(frozen=True)
class SwimSettings:
    """What a session remembers of its swims; not part of undo."""

    scenario: str = "nominal"
    path: str = "lissajous"
    controller: str = "tracking"
    speed: float = 1.0
    """Simulated time per time on the wall."""
    announced: bool = True
    """Whether breaking and mending is announced to the allocator; else the monitor has to detect
    it."""

    def with_value(self, key: str, value: Any) -> "SwimSettings":
        """One field changed. FinlabError: there is no such field, or not with this value."""
        if key == "scenario":
            day = SCENARIOS[one_of(value, key, tuple(SCENARIOS))]
            settings = replace(self, announced=day.announced, path=day.trajectory)
            return replace(settings, scenario=day.name)
        if key == "announced" and not isinstance(value, bool):
            raise FinlabError(f"announced: expected true or false, got {value!r:.60}")
        if key == "speed":
            value = number(value, key, *SPEEDS)
        elif key in CHOICES:
            one_of(value, key, CHOICES[key])
        elif key != "announced":
            raise FinlabError(f"a swim has no setting {key!r:.40}")
        return replace(self, **{key: value})

    @property
    def day(self) -> HardDay:
        """The scenario."""
        return SCENARIOS[self.scenario]

    def plan(self, state: State) -> "Plan":
        """The plan for the robot as it is now.

        Raises:
            FinlabError: the scenario takes more fins away than the robot has, or the controller is
                not for this robot.
        """
        day = self.day
        layout = self.day.believed(state.able)
        path = make_trajectory(self.path, day.duration_s if self.path == day.trajectory else None)
        make_controller(self.controller, layout)
        affected = _affected(layout, state.lost, day)
        weak = () if day.weak is None else affected
        losses = tuple(Fault(name, 0.5 * path.duration_s) for name in affected) if day.lost else ()
        robot = layout, state.lost, path, state.method
        return Plan(*robot, day, weak, losses, self.announced, self.controller)


def _affected(layout: Layout, lost: tuple[str, ...], day: HardDay) -> tuple[str, ...]:
    """The fins that a day weakens or takes away: the first without which the robot can still be
    steered."""
    count = day.lost if day.weak is None else 1
    working = [name for name in layout.names if name not in lost]
    if count and count >= len(working):
        text = f"{day.name} takes {count} of the {len(working)} working fins away"
        raise FinlabError(f"{text}; choose another scenario, or a robot with more fins")
    return steerable_loss(layout, count, lost) or tuple(working[:count])


class Plan(NamedTuple):
    """One swim."""

    layout: Layout
    lost: tuple[str, ...]
    """Fins that are lost from the start, announced from the start."""
    path: Trajectory
    method: str
    day: HardDay = SCENARIOS["nominal"]
    weak: tuple[str, ...] = ()
    """Fins that are weak as on that day, unannounced."""
    losses: tuple[Fault, ...] = ()
    announced: bool = True
    controller: str = "tracking"
