"""The demands of a log, asked again: other methods, policies and robots."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from finlab.allocation import Allocator
from finlab.allocation.methods import MethodName, method_class
from finlab.allocation.policy import CLOSEST, Policy
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.log.answers import answers_to
from finlab.physics.objective import REACHED, yardstick

MOST, MOST_LOST = 2000, 400
"""Most demands that a replay asks, and one with an actuator lost."""
FINEST = 0.001
"""Share of the yardstick that demands taken together spread over; doubled until these are few
enough."""

HASH = np.random.default_rng(0).integers(-(2**63), 2**63, 6, endpoint=False) | 1
"""Factors that make one number of six, modulo 2^64."""


@dataclass(frozen=True)
class Replay:
    """The same demands asked of a method; impulses are integrals over time of sizes."""

    robot: str
    """`as it is`, or `improved`."""
    lost: str | None
    """Actuator that was taken out."""
    name: str
    """Method, and policy in words if it has several, such as `dual priority Tz, Fz`."""
    method: str
    policy: str
    missing: tuple[float, ...]
    """Impulse that was missing along each axis (6,) [N s, N m s]."""
    watts: float
    """Mean power [W] by the actuators' own models."""
    saturated_s: float
    """Time over which a wrench was not delivered, by more than a thousandth of the yardstick
    [s]."""


class Demands(NamedTuple):
    """Demands of a log, alike ones together."""

    wrench: Array
    """(K, 6) [N, N m], means over time; NaN along axes that do not count."""
    span: Array
    """How long each held, all in all (K,) [s]."""
    spread: float
    """Share of the yardstick that those which were taken together spread over; 0 where they are
    equal."""


def demands_of(wrench: Array, span: Array, scale: Array, most: int) -> Demands:
    """Takes demands (N, 6) that held for times (N,) together until at most `most` are left: equal
    ones, then those in one cell of a grid, ever wider, each as its mean over time."""
    spread = 0.0
    place = np.nan_to_num(wrench / scale, nan=1e9)
    while True:
        cell = place.view(np.int64) if spread == 0.0 else np.round(place / spread).astype(np.int64)
        _, first, group = np.unique(cell @ HASH, return_index=True, return_inverse=True)
        if len(first) <= most:
            break
        spread = max(2.0 * spread, FINEST)
    held: Array = np.asarray(np.bincount(group, span, len(first)), np.float64)
    sums = [np.bincount(group, span * column, len(first)) for column in np.nan_to_num(wrench).T]
    mean = np.stack(sums, axis=1) / np.maximum(held, 1e-12)[:, None]
    return Demands(np.where(np.isnan(wrench[first]), np.nan, mean), held, spread)


def policy_words(policy: Policy) -> str:
    """A policy in words."""
    if policy.kind != "priority":
        return policy.kind
    return f"priority {', '.join('+'.join(group) for group in policy.order)}"


def replay(
    robot: Layout, wrench: Array, span: Array, policies: list[Policy], *, improved: bool = False
) -> Iterator[Replay]:
    """Replays demands (N, 6), each held for (N,) [s], by `dual` with each policy and by both
    autopilots' methods where they take the robot; of a robot that is not `improved` with each
    actuator lost, too."""
    scale = yardstick(robot)
    intact = demands_of(wrench, span, scale, MOST)
    rough = demands_of(intact.wrench, intact.span, scale, MOST_LOST)
    autopilots: tuple[MethodName, ...] = ("px4", "ardusub")
    questions: list[tuple[MethodName, Policy]] = [("dual", policy) for policy in policies]
    questions += [(name, CLOSEST) for name in autopilots if method_class(name).fits(robot)]
    made = {name: Allocator(robot, name) for name in dict.fromkeys(name for name, _ in questions)}
    gone = [] if improved or robot.n == 1 else robot.names
    for lost in (None, *gone):
        demands = intact if lost is None else rough
        for name, policy in questions:
            gone_now = () if lost is None else (lost,)
            answer = answers_to(made[name], demands.wrench, gone_now, policy=policy)
            missing = demands.span @ np.abs(answer.unallocated)
            yield Replay(
                robot="improved" if improved else "as it is",
                lost=lost,
                name=f"{name} {policy_words(policy)}" if name == "dual" else name,
                method=name,
                policy=policy_words(policy),
                missing=six(missing, scale),
                watts=float(demands.span @ answer.power / demands.span.sum()),
                saturated_s=float(demands.span[answer.err_norm > REACHED].sum()),
            )


def six(values: Array, scale: Array) -> tuple[float, ...]:
    """Plain numbers of axes (6,); those below a millionth of a yardstick are rounding errors, and
    0."""
    return tuple(map(float, np.where(np.abs(values) < 1e-6 * scale, 0.0, values)))
