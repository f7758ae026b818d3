"""What is to be swum: what the user has set so far, and the plan that comes of it when the swim starts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from types import MappingProxyType
from typing import Any, NamedTuple

from finlab.control import PATH_CONTROLLERS, Completion, TrackingController
from finlab.errors import FinlabError
from finlab.evaluation.experiments.hard_days import HardDay
from finlab.layout import Layout
from finlab.sim import (
    PLANTS,
    SHIPPED,
    FinFault,
    SensorSettings,
    SteadyCurrent,
    Still,
    Trajectory,
    Water,
    Waves,
    make_trajectory,
)
from webapp.session.scenarios import SCENARIOS, conditions
from webapp.session.state import COMPARED, State, chosen, number

ALONE = "nobody"
"""Rival of a robot that swims alone."""
OWN = "own path"
"""Name of a path from the user's file."""
CONTROLLERS = tuple(PATH_CONTROLLERS)
"""Who steers."""
SPEEDS = (0.1, 8.0)
"""Simulated time per time on the wall that may be asked for."""
NUMBERS = {
    "speed": SPEEDS,
    "current_cm_s": (0.0, 30.0),
    "heading_deg": (-180.0, 180.0),
    "waves_cm": (0.0, 60.0),
    "buoyancy_percent": (-3.0, 3.0),
    "pack_wh": (0.1, 10_000.0),
    "electronics_w": (0.0, 1000.0),
}
"""Settings that are numbers, with their ends."""
CHOICES: dict[str, tuple[str, ...]] = {
    "path": (*SHIPPED, OWN),
    "method": COMPARED,
    "rival": (ALONE, *COMPARED),
    "controller": CONTROLLERS,
    "plant": tuple(PLANTS),
}
"""Settings that are one of some words."""


@dataclass(frozen=True)
class SwimSettings:
    """What a session remembers of its swims; not part of undo."""

    scenario: str = "nominal"
    """Name of one of `SCENARIOS`; to choose it sets path, fin forces, water and buoyancy."""
    path: str = "lissajous"
    """Name of a shipped trajectory, or `OWN`."""
    method: str = COMPARED[0]
    """Who allocates."""
    rival: str = ALONE
    """Who allocates for the robot beside it."""
    controller: str = CONTROLLERS[0]
    """Who steers: one of `CONTROLLERS`."""
    plant: str = next(iter(PLANTS))
    """How the fins' forces are simulated: one of `PLANTS`."""
    speed: float = 1.0
    """Simulated time per time on the wall."""
    announced: bool = True
    """Whether breaking and mending is announced to the allocator; else the monitor has to detect it."""
    current_cm_s: float = 0.0
    """Speed of the current [cm/s]."""
    heading_deg: float = 0.0
    """Where it flows to, from the world's x counter-clockwise [deg]."""
    waves_cm: float = 0.0
    """Significant height of the waves [cm]; 0 for none."""
    buoyancy_percent: float = 0.0
    """By how much the robot is more buoyant than its layout says [%]."""
    pack_wh: float = 100.0
    """Energy of the battery [Wh]; airlines let 100 Wh travel."""
    electronics_w: float = 0.0
    """What everything but the fins takes from it [W]."""

    def with_value(self, key: str, value: Any) -> "SwimSettings":
        """One field changed; the page may send anything.

        Raises:
            FinlabError: there is no such field, or not with this value.
        """
        if key == "scenario":
            day = SCENARIOS[chosen(value, key, tuple(SCENARIOS))]
            said = {"announced": day.announced, "path": day.trajectory, "plant": day.plant, **conditions(day)}
            return replace(self, scenario=day.name, **said)
        if key == "announced":
            if not isinstance(value, bool):
                raise FinlabError(f"announced: expected true or false, got {value!r:.60}")
            return replace(self, announced=value)
        if key in NUMBERS:
            changed: dict[str, Any] = {key: number(value, key.replace("_", " "), *NUMBERS[key])}
            return replace(self, **changed)
        if key not in CHOICES:
            raise FinlabError(f"a swim has no setting {key!r:.40}")
        return replace(self, **{key: chosen(value, key, CHOICES[key])})

    def without_own_path(self) -> "SwimSettings":
        """The same after a reload, when the user's file is not there any more."""
        return replace(self, path=SwimSettings.path) if self.path == OWN else self

    @property
    def day(self) -> HardDay:
        """The scenario."""
        return SCENARIOS[self.scenario]

    @property
    def water(self) -> Water:
        """How the water moves: as the scenario says, unless the user has changed something of it."""
        said = conditions(self.day)
        if all(getattr(self, key) == said[key] for key in ("current_cm_s", "heading_deg", "waves_cm")):
            return self.day.water
        speed, angle = 0.01 * self.current_cm_s, math.radians(self.heading_deg)
        velocity = speed * math.cos(angle), speed * math.sin(angle), 0.0
        if self.waves_cm:
            return Waves(height_m=0.01 * self.waves_cm, current=velocity)
        return SteadyCurrent(velocity) if speed else Still()

    @property
    def truth(self) -> dict[str, Any]:
        """What the body really is: options of `finlab.sim.perturbed`."""
        return {**self.day.truth, "buoyancy": 1.0 + 0.01 * self.buoyancy_percent}

    def plan(self, state: State, own: Trajectory | None) -> "Plan":
        """The plan for the robot as it is now, along the user's own path where that is wanted and known.

        Raises:
            FinlabError: there is no own path, or the scenario takes more fins away than the robot has.
        """
        day, layout = self.day, state.able
        if self.path == OWN and own is None:
            raise FinlabError("there is no path of your own; open one under More, or choose another path")
        if self.path == OWN and own is not None:
            path = own
        else:
            path = make_trajectory(self.path, day.duration_s if self.path == day.trajectory else None)
        affected = _affected(layout, state.failed, day)
        return Plan(
            layout,
            state.failed,
            path,
            (self.method,) if self.rival in (ALONE, self.method) else (self.method, self.rival),
            self.plant,
            self.controller,
            self.scenario,
            self.water,
            self.truth,
            day.sensors,
            affected if day.weak is not None else (),
            1.0 if day.weak is None else day.weak,
            tuple(FinFault(name, 0.5 * path.duration_s) for name in affected) if day.lost else (),
            self.announced,
        )


def _affected(layout: Layout, failed: tuple[str, ...], day: HardDay) -> tuple[str, ...]:
    """The fins that a day weakens or takes away: the first without which the robot can still be steered."""
    count = day.lost if day.weak is None else 1
    working = [name for name in layout.names if name not in failed]
    if count and count >= len(working):
        text = f"{day.name} takes {count} of the {len(working)} working fins away"
        raise FinlabError(f"{text}; choose another scenario, or a robot with more fins")
    ways = list(combinations(working, count))

    def steers(lost: tuple[str, ...]) -> bool:
        return Completion(layout, (*failed, *lost), TrackingController.axes).controllable

    return next((way for way in ways if not count or steers(way)), ways[0])


class Plan(NamedTuple):
    """One swim."""

    layout: Layout
    """The robot as all believe it to be."""
    failed: tuple[str, ...]
    """Fins that are lost from the start, announced from the start."""
    path: Trajectory
    """Where to swim."""
    methods: tuple[str, ...]
    """Allocation methods, one robot each."""
    plant: str = "mean"
    """How the fins' forces are simulated: one of `PLANTS`."""
    controller: str = CONTROLLERS[0]
    """Who steers."""
    scenario: str = "nominal"
    """What it is called."""
    water: Water = Still()
    """How it moves."""
    truth: Mapping[str, Any] = MappingProxyType({})
    """What the body really is: options of `finlab.sim.perturbed`."""
    sensors: SensorSettings = SensorSettings()
    """Noise, bias and delay."""
    weak: tuple[str, ...] = ()
    """Fins that are weak, unannounced."""
    share: float = 1.0
    """Of their thrust that these give."""
    losses: tuple[FinFault, ...] = ()
    """What becomes of fins on the way."""
    announced: bool = True
    """Whether that is announced to the allocator."""
