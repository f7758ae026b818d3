"""Replays the demands of a log by other methods, policies and robots."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from finlab.allocation import Allocator
from finlab.allocation.methods import MethodName, method_class
from finlab.allocation.policy import CLOSEST, Policy
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.log.demand_answers import answers_to
from finlab.physics.objective import REACHED, wrench_scale_of

MAX_DEMANDS = 2000
"""Most demands of a replay; of more, similar ones are merged."""
MAX_DEMANDS_LOST = 400
"""The same of a replay with an actuator lost, of which there is one for each actuator."""
FINEST_SPREAD = 0.001
"""Width of the finest cells in which demands are merged, as a share of the wrench scale; doubled
until few enough are left."""
HASH_FACTORS = np.random.default_rng(0).integers(-(2**63), 2**63, 6, endpoint=False) | 1
"""Odd factors that hash six integers to one, modulo 2^64."""


@dataclass(frozen=True)
class Replay:
    """The result of the demands by one method; an impulse is the integral over time of a size."""

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
    """Time over which a wrench was not delivered, by more than a thousandth of the wrench scale
    [s]."""


class Demands(NamedTuple):
    """Demands of a log; similar ones are merged."""

    wrench: Array
    """(K, 6) [N, N m], means over time; NaN along axes that do not count."""
    span: Array
    """Total time that each held (K,) [s]."""
    spread: float
    """Width of the cells in which demands were merged, as a share of the wrench scale; 0 where only
    equal ones were."""


def demands_of(wrench: Array, span: Array, scale: Array, limit: int) -> Demands:
    """Merges demands until few enough are left: equal ones, then those in one cell of a grid, ever
    wider, each as its mean over time.

    Args:
        wrench: demands (N, 6) [N, N m]; NaN along free axes.
        span: how long each held (N,) [s].
        scale: wrench scale (6,) [N, N m].
        limit: how many may be left.
    """
    spread = 0.0
    scaled = np.nan_to_num(wrench / scale, nan=1e9)
    while True:
        cell = (
            scaled.view(np.int64) if spread == 0.0 else np.round(scaled / spread).astype(np.int64)
        )
        _, first_rows, group = np.unique(
            cell @ HASH_FACTORS, return_index=True, return_inverse=True
        )
        if len(first_rows) <= limit:
            break
        spread = max(2.0 * spread, FINEST_SPREAD)
    spans: Array = np.asarray(np.bincount(group, span, len(first_rows)), np.float64)
    sums = [
        np.bincount(group, span * column, len(first_rows)) for column in np.nan_to_num(wrench).T
    ]
    mean = np.stack(sums, axis=1) / np.maximum(spans, 1e-12)[:, None]
    return Demands(np.where(np.isnan(wrench[first_rows]), np.nan, mean), spans, spread)


def policy_words(policy: Policy) -> str:
    """A policy in words."""
    if policy.kind != "priority":
        return policy.kind
    return f"priority {', '.join('+'.join(group) for group in policy.order)}"


def replay(
    robot: Layout, wrench: Array, span: Array, policies: list[Policy], *, improved: bool = False
) -> Iterator[Replay]:
    """Replays demands by `dual` with each policy, and by the autopilots' methods where they take
    the robot.

    Args:
        robot: the robot.
        wrench: demands (N, 6) [N, N m]; NaN along free axes.
        span: how long each held (N,) [s].
        policies: policies of `dual`.
        improved: whether the robot is the improved one; the other one is replayed with each
            actuator lost, too.
    """
    scale = wrench_scale_of(robot)
    intact = demands_of(wrench, span, scale, MAX_DEMANDS)
    merged = demands_of(intact.wrench, intact.span, scale, MAX_DEMANDS_LOST)
    questions = _questions(robot, policies)
    allocators = {
        name: Allocator(robot, name) for name in dict.fromkeys(name for name, _ in questions)
    }
    for lost in (None, *_lost_names(robot, improved)):
        demands = intact if lost is None else merged
        for name, policy in questions:
            lost_now = () if lost is None else (lost,)
            answer = answers_to(allocators[name], demands.wrench, lost_now, policy=policy)
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


def n_replays(robot: Layout, policies: list[Policy], *, improved: bool = False) -> int:
    """Returns how many replays `replay` makes; arguments as it has them."""
    return len(_questions(robot, policies)) * (1 + len(_lost_names(robot, improved)))


def _questions(robot: Layout, policies: list[Policy]) -> list[tuple[MethodName, Policy]]:
    """Methods and policies that are asked."""
    autopilots: tuple[MethodName, ...] = ("px4", "ardusub")
    questions: list[tuple[MethodName, Policy]] = [("dual", policy) for policy in policies]
    questions += [(name, CLOSEST) for name in autopilots if method_class(name).fits(robot)]
    return questions


def _lost_names(robot: Layout, improved: bool) -> tuple[str, ...]:
    """Actuators that are lost in turn."""
    return () if improved or robot.n == 1 else robot.names


def six(values: Array, scale: Array) -> tuple[float, ...]:
    """Returns values of axes (6,) as floats; those below a millionth of the wrench scale are
    rounding errors, and become 0."""
    return tuple(map(float, np.where(np.abs(values) < 1e-6 * scale, 0.0, values)))
