"""Errors and power of two autopilots' allocation, within reach and beyond, on robots of
thrusters."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation import Allocator, Policy
from finlab.allocation.baselines.autopilots import ARDUSUB_ORDER, PX4_ORDER
from finlab.allocation.methods import MethodName
from finlab.arrays import Array
from finlab.axes import Axis
from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, check_names
from finlab.research.evaluation.splits import make_case
from finlab.research.executor import map_parts

Order = tuple[tuple[Axis, ...], ...]
METHODS: dict[str, tuple[MethodName, dict[str, Any], Order | None]] = {
    "dual": ("dual", {}, None),
    "pseudo-inverse": ("px4", {"desaturation": "none"}, PX4_ORDER),
    "px4": ("px4", {}, PX4_ORDER),
    "px4-axes": ("px4", {"desaturation": "axes"}, PX4_ORDER),
    "ardusub": ("ardusub", {}, ARDUSUB_ORDER),
}
"""Name -> method, its settings, and the order in which it means to keep axes."""
ROBOTS = ("bluerov2_heavy", "even", "surveyed", "random")
"""BlueROV2 Heavy, whose rear thrusters sit 1 cm further out than those in front; the same without;
BlueROV2 with thrusters a little out of place, so that the axis that nothing drives is driven badly;
random ones."""
FRONT = 0.14
"""How far the front thrusters are ahead [m]."""
SURVEYED = 0.005
"""By how much places differ from the drawing [m]."""
FAR = 1e3
"""Times a target, surely out of reach."""
DELIVERED = 1e-3
"""Missing wrench over the wrench scale up to which a target counts as delivered."""
ALIKE = 1e-5
"""Missing wrench over the wrench scale up to which two are alike."""
DOMAIN = 0x7A05
"""Leads the seed of the draws."""


def run(
    robots: tuple[str, ...] = ROBOTS,
    reach: tuple[float, ...] = (0.8, 1.2, 2.0, 3.0),
    lost: tuple[int, ...] = (0, 1, 2),
    layouts: int = 5,
    targets: int = 20,
    seed: int = 0,
) -> list[Row]:
    """One row for each robot, number of lost thrusters, share of reach and method.

    Args:
        robots: some of bluerov2_heavy, even, surveyed, random.
        reach: targets over the most that the robot gives in their direction.
        lost: numbers of lost thrusters.
        layouts: draws of robots and of the thrusters that are lost.
        targets: of each draw.
        seed: of all draws.
    """
    check_names("robots", robots, ROBOTS)
    rows: list[Row] = []
    for robot in robots:
        for count in lost:
            drawn = list(_draws(robot, count, layouts, targets, seed))
            parts = [(layout, share * edge) for share in reach for layout, edge in drawn]
            scores = map_parts(_scores, parts, f"{robot}, {count} lost", "draw")
            for share in reach:
                scored = list(islice(scores, layouts))
                for method in METHODS:
                    about: Row = {"robot": robot, "lost": count, "of_reach": round(100 * share)}
                    figures = _figures([each[method] for each in scored])
                    rows.append(about | {"method": method} | figures)
    return rows


def _draws(
    robot: str, lost: int, layouts: int, targets: int, seed: int
) -> Iterator[tuple[Layout, Array]]:
    """What is left of robots, and wrenches (N, 6) at the edge of reach, along those of uniform
    commands."""
    for k in range(layouts):
        rng = np.random.default_rng([DOMAIN, seed, ROBOTS.index(robot), lost, k])
        layout = _robot(robot, rng, seed, k)
        left = layout.without([layout.names[i] for i in rng.permutation(layout.n)[:lost]])
        plant = plant_of(left)
        wrench = plant.wrench(plant.sample(rng, (targets,)))
        yield left, Allocator(left).allocate_batch(FAR * wrench, policy="direction").wrench


def _robot(robot: str, rng: np.random.Generator, seed: int, k: int) -> Layout:
    """Draw k of a robot of `ROBOTS`, with all of its thrusters."""
    if robot == "random":
        return make_case("thrusters", 1, seed, k).layout
    layout = load_layout("bluerov2" if robot == "surveyed" else "bluerov2_heavy")
    places = layout.position.copy()
    if robot == "surveyed":
        places += rng.uniform(-SURVEYED, SURVEYED, places.shape)
    elif robot == "even":
        places[2:4, 0] = -FRONT
    moved = zip(layout.actuators, places.tolist(), strict=True)
    return replace(
        layout, actuators=tuple(replace(part, position=tuple(place)) for part, place in moved)
    )


def _scores(part: tuple[Layout, Array]) -> dict[str, dict[str, Array]]:
    """By method arrays (N,): what it misses and takes of targets (N, 6) on a robot, and what `dual`
    misses in its order."""
    layout, targets = part
    dual = Allocator(layout)
    scored = dict[str, dict[str, Array]]()
    bound = dual.allocate_batch(targets).bound
    ranked: dict[Order, Array] = {
        order: dual.allocate_batch(targets, policy=Policy("priority", order=order)).unallocated
        / dual.scale
        for order in (PX4_ORDER, ARDUSUB_ORDER)
    }
    for method, (name, settings, order) in METHODS.items():
        answer = Allocator(layout, name, **settings).allocate_batch(targets)
        scored[method] = {
            "missed": answer.err_norm,
            "power": answer.power,
            "bound": np.asarray(bound),
        }
        if order is not None:
            own, ours = (
                missing_by_group(x, order) for x in (answer.unallocated / dual.scale, ranked[order])
            )
            scored[method] |= {"first": own[:, 0], "dual_first": ours[:, 0]}
            scored[method]["dual_more"] = np.asarray(misses_more(ours, own), float)
    return scored


def missing_by_group(missing: Array, order: Order) -> Array:
    """Sizes (N, G) of what is missing (N, 6), over the wrench scale, in each group of axes."""
    groups = Policy("priority", order=order).groups
    return np.stack([np.linalg.norm(missing[:, axes], axis=1) for axes in groups], axis=1)


def misses_more(one: Array, other: Array) -> NDArray[np.bool_]:
    """Whether (N,) the first misses (N, G) more than the other in the first group in which they
    differ."""
    differ = np.abs(one - other) > ALIKE
    first = differ.argmax(axis=1)[:, None]
    more: NDArray[np.bool_] = np.take_along_axis(one - other, first, axis=1)[:, 0] > ALIKE
    return more


def _figures(scored: Sequence[dict[str, Array]]) -> Row:
    """Figures of one method over all draws, from arrays (N,) of each of them."""
    by = {
        key: np.concatenate([np.asarray(each[key], float) for each in scored]) for key in scored[0]
    }
    fine = (by["missed"] <= DELIVERED) & (by["bound"] > 0.0)
    row: Row = {"n": len(fine), "not_delivered": float((by["missed"] > DELIVERED).mean())}
    if fine.any():
        power = by["power"][fine]
        bound = by["bound"][fine]
        row |= {
            "watts": float(power.sum() / bound.sum()),
            "watts_max": float((power / bound).max()),
        }
    means = ("missed", "first", "dual_first", "dual_more")
    return row | {f"{key}_mean": float(by[key].mean()) for key in means if key in by}


experiment = Experiment(
    name="thrusters",
    question="What do the autopilots PX4 and ArduSub miss and take, within reach and beyond, "
    "beside `dual`?",
    columns=(
        Column("robot", "robot", "code"),
        Column("lost", "lost", "count"),
        Column("of_reach", "of reach", "count", unit="%"),
        Column("method", "method", "code"),
        Column("n", "targets", "count"),
        Column("not_delivered", "not delivered", "share"),
        Column("watts", "power over the least", "ratio"),
        Column("watts_max", "worst", "ratio"),
        Column("missed_mean", "missing", "error"),
        Column("first_mean", "missing of the first axes", "error"),
        Column("dual_first_mean", "of `dual`", "error"),
        Column("dual_more_mean", "`dual` misses more", "share"),
    ),
    run=run,
    note=(
        "Targets lie along the wrenches of uniform commands. Not delivered: clipped, or coupled "
        "aside. Missing: over the robot's wrench scale. The first axes are those that the "
        "autopilot means to keep (PX4: roll and pitch, then heave, yaw, surge and sway; ArduSub: "
        "roll, pitch and heave, then the others); `dual` gets the same order as a priority, and "
        "misses more where it does so in the first group in which the two differ. Power over the "
        "least: over the watts that no answer can undercut, where the target is delivered. "
        "Pseudo-inverse: PX4's without desaturation. `surveyed`: a BlueROV2 with each thruster up "
        "to 5 mm out of place."
    ),
    quick={"robots": ("bluerov2_heavy",), "lost": (0, 1), "reach": (0.8, 2.0)},
    pieces=("robots",),
    measures=(
        "finlab/allocation/baselines",
        "finlab/allocation/dual",
        "finlab/core/src",
        "finlab/research/random_layouts.py",
        "finlab/research/evaluation/experiments/thrusters.py",
    ),
    probe={"layouts": 1, "targets": 2},
    usual={"layouts": 8},
)
