"""Hard days: named swims in which something is not as the designer of the robot assumed. Plain
data.

What a day says is true of the robot and its surroundings; allocator, controller and monitor know
the layout, the laws of its fins, and what is announced.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations, islice
from typing import Any, NamedTuple

from finlab.assets import PAPER_LAYOUTS
from finlab.interaction.jets import Jets
from finlab.layout import Body, Layout, load_layout
from finlab.research.evaluation.method_specs import MethodSpec
from finlab.research.evaluation.splits import make_split
from finlab.swim.control import FaultMonitor, steers
from finlab.swim.simulation import (
    ClosedLoop,
    Fault,
    SensorSettings,
    Trajectory,
    make_trajectory,
    perturbed,
)

TWO = ("A", "C")
"""Those that swim most of the days: a symmetric one and one that is not."""
CURRENT = (0.05, -0.05, 0.0)
"""7 cm/s across the path [m/s]."""

HEAVY = ("bluerov2_heavy",)
OTHER_HEAVY = Body(
    mass_kg=13.0,
    inertia_kgm2=(0.250, 0.221, 0.356),
    added_mass=(1.272, 1.424, 3.736, 0.0378, 0.027, 0.0444),
    linear_damping=(13.7, 1.0, 23.0, 0.5, 0.8, 0.1),
    quadratic_damping=(14.1, 21.7, 19.0, 0.119, 0.047, 0.15),
    center_of_buoyancy_m=(0.0, 0.0, 0.02),
    buoyancy_n=132.4,
)
"""The same robot by github.com/PX4/PX4-gazebo-models, 2026 (BSD-3); it displaces 0.0135 m^3."""

BUILT_OFF = {"askew": math.radians(5.0), "center": (-0.016, 0.012, 0.0)}
"""A robot that is not built as drawn: actuators turned by 5 degrees, the centre of gravity 2 cm
off."""


class HardDaySwim(NamedTuple):
    """One swim of a day: the name of a layout, and those of the fins that are weak or lost."""

    layout: str
    fins: tuple[str, ...]


@dataclass(frozen=True)
class HardDay:
    """One scenario: its name for `--scenarios`, and what is hard, in a sentence.

    `duration_s` None is the trajectory's own time [s]; `scale` is how many times larger the path is
    than the shipped one. With `mixed_fins` all methods are given fins of split `fins-mixed`, others
    for each seed. `body` is the true one where it is another than the layout's, `truth` holds
    options of `finlab.swim.simulation.perturbed`, and `current` is the velocity of the water in the
    world [m/s]. `weak` is the share of its thrust that one fin gives, each in its turn, without an
    announcement; `lost` is how many fins are lost half-way, each and each pair in its turn, and
    where this is not `announced`, a `FaultMonitor` has to find it. `jets` are what actuators truly
    do to each other, which methods are told where they are `jets_known`.
    """

    name: str
    about: str
    layouts: tuple[str, ...] = TWO
    trajectory: str = "lissajous"
    duration_s: float | None = None
    mixed_fins: bool = False
    scale: float = 1.0
    body: Body | None = None
    truth: Mapping[str, Any] = field(default_factory=dict)
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sensors: SensorSettings = SensorSettings()
    weak: float | None = None
    lost: int = 0
    announced: bool = True
    jets: Jets | None = None
    jets_known: bool = False

    def path(self) -> Trajectory:
        """The trajectory that is followed, in the world frame."""
        return make_trajectory(self.trajectory, self.duration_s, self.scale)

    def cases(self) -> list[HardDaySwim]:
        """Every swim of one seed: each layout, with each fin or pair that is weak or lost."""
        affected = 1 if self.weak is not None else self.lost
        return [
            HardDaySwim(name, fins)
            for name in self.layouts
            for fins in combinations(load_layout(name).names, affected)
        ]

    def robot(self, layout: str, seed: int) -> Layout:
        """The robot that methods believe in; the seed draws mixed fins."""
        robot = self.believed(load_layout(layout))
        if not self.mixed_fins:
            return robot
        cases = make_split("fins-mixed", robot.n_fins, 1, seed)
        models = islice((fin.model for case in cases for fin in case.layout.fins), robot.n_fins)
        fins = tuple(replace(fin, model=own) for fin, own in zip(robot.fins, models, strict=True))
        return replace(robot, actuators=fins)

    def believed(self, robot: Layout) -> Layout:
        """What methods are told of a robot."""
        return (
            replace(robot, interaction=self.jets if self.jets_known else None)
            if self.jets
            else robot
        )

    def true(self, robot: Layout) -> Layout:
        """What a believed robot truly is."""
        own = {"body": self.body or robot.body, "interaction": self.jets or robot.interaction}
        return perturbed(replace(robot, **own), **self.truth)  # type: ignore[arg-type]

    def is_hopeless(self, case: HardDaySwim) -> bool:
        """Whether what is left of the robot cannot give independently what the controller
        commands."""
        return self.lost > 0 and not steers(load_layout(case.layout), case.fins)

    def swim(self, case: HardDaySwim, method: MethodSpec, seed: int) -> ClosedLoop:
        """A swim of `cases()`, ready to start; the seed is of noise, biases and mixed fins."""
        robot = self.robot(case.layout, seed)
        path = self.path()
        failures = [Fault(fin, 0.5 * path.duration_s) for fin in case.fins] if self.lost else []
        loop = ClosedLoop(
            robot,
            method.on(robot),
            path,
            sensors=self.sensors,
            current=self.current,
            failures=failures,
            announced=self.announced,
            monitor=None if self.announced else FaultMonitor(robot),
            truth=self.true(robot),
            seed=seed,
        )
        if self.weak is not None:
            for fin in case.fins:
                loop.fail(fin, "torn", self.weak, announced=False)
        return loop


HARD_DAYS = (
    HardDay(
        "nominal", "Everything is as drawn; sensors are noisy, biased and late.", PAPER_LAYOUTS
    ),
    HardDay("damping-double", "The body is damped twice as much.", truth={"damping": 2.0}),
    HardDay(
        "parameters-high",
        "Damping, added mass and inertia are 30 % more than drawn.",
        PAPER_LAYOUTS,
        truth={"damping": 1.3, "added_mass": 1.3, "inertia": 1.3},
    ),
    HardDay("current", "A current of 7 cm/s.", current=CURRENT),
    HardDay("buoyant", "The robot is 1 % too buoyant.", truth={"buoyancy": 1.01}),
    HardDay("late", "All sensors are 100 ms later.", sensors=SensorSettings().later(0.1)),
    HardDay("square", "A square with stops at its corners.", trajectory="square"),
    HardDay(
        "station", "Keep a place in a current of 7 cm/s.", trajectory="station", current=CURRENT
    ),
    HardDay("hexa", "Six fins.", ("hexa",)),
    HardDay(
        "fins-mixed",
        "Each fin of A follows a law of its own, which all methods but `paper` know.",
        ("A",),
        mixed_fins=True,
    ),
    HardDay("weak", "One fin gives 70 % of its thrust; no method is given that.", ("A",), weak=0.7),
    HardDay("lost-one", "One fin is lost half-way, announced.", ("A",), lost=1),
    HardDay(
        "lost-one-unannounced",
        "One fin is lost half-way, and a monitor has to find out.",
        ("A",),
        lost=1,
        announced=False,
    ),
    HardDay("lost-two", "Two fins are lost half-way, announced.", ("A",), lost=2),
    HardDay("restricted", "Stops keep the fins within arcs.", ("restricted",)),
    HardDay("saturated", "The path asks for more than the fins can give.", duration_s=36.0),
    HardDay(
        "offset", "Centre of gravity and fins are not where the layout has them.", truth=BUILT_OFF
    ),
    HardDay("heavy", "Eight thrusters; everything is as drawn.", HEAVY),
    HardDay(
        "heavy-other-body",
        "Eight thrusters, and the body of another source.",
        HEAVY,
        body=OTHER_HEAVY,
    ),
    HardDay(
        "heavy-lost-one",
        "One of eight thrusters is lost half-way, and a monitor has to find out.",
        HEAVY,
        lost=1,
        announced=False,
    ),
    HardDay(
        "heavy-jets", "Jets hit each other and the hull, and nobody knows.", HEAVY, jets=Jets()
    ),
    HardDay(
        "heavy-jets-known",
        "The same, and the allocator is told.",
        HEAVY,
        jets=Jets(),
        jets_known=True,
    ),
    HardDay(
        "heavy-lost-two", "Two of eight thrusters are lost half-way, announced.", HEAVY, lost=2
    ),
    HardDay(
        "torpedo",
        "A propeller and tail fins that need speed.",
        ("torpedo",),
        "circle",
        120.0,
        scale=25.0,
    ),
    HardDay("hybrid", "Four fins and two thrusters.", ("turtle_hybrid",)),
    HardDay(
        "hybrid-lost", "One fin or thruster of six is lost half-way.", ("turtle_hybrid",), lost=1
    ),
)
"""The suite, in the order in which it is printed."""
