"""How much weakest direction no layout of some thrusters exceeds, wherever they stand and point.

With f_i the force of thruster i that counts, b_i its scaled wrench per newton, and m axes that
count, the weakest direction r of n thrusters keeps (`zonotope_ball`)

    r^2 <= K / tr(M^-1),  M = sum_i f_i^2 b_i b_i^T,

and for any symmetric matrix C, the metric, tr(M^-1) >= (tr C)^2 / tr(C M C). So

    r^2 <= K / (tr C)^2 sum_i f_i^2 max |C b_i|^2,

where each thruster has its own largest value, over all of its poses. `PoseSet` encloses it. The
bound holds for any metric; the best one is the inverse of M at an A-optimal design, whose thrusters
are spread over poses, and is found by multiplicative steps between columns that are added in turn.
See docs/theory/layout-bound.md for the proof, and F. Pukelsheim, Optimal Design of Experiments
(1993), chapters 6 and 9, for A-optimal designs.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from finlab.analysis.keep_out import KeepOut
from finlab.analysis.moves import Bounds, azimuth, mirror_pairs
from finlab.analysis.pose_set import PoseSet
from finlab.analysis.zonotope_ball import ball_factor
from finlab.arrays import Array
from finlab.axes import AXES as WRENCH
from finlab.axes import Axis
from finlab.errors import LayoutError
from finlab.layout import Layout

ROUNDS = 40
"""Most rounds, each of which adds columns."""
STEPS = 60
"""Multiplicative steps between two rounds."""
SETTLED = 2e-4
"""Share by which the bound may exceed what the design proves of it, at which the search ends."""
NEGLIGIBLE_WEIGHT = 1e-7
"""Share of a thruster below which a column of its design is left out."""
REGULARIZATION = 1e-12
"""Share of the trace that is added to the diagonal of M: any metric gives a bound."""
ROUNDING_SHARE = 1e-9
"""Share by which rounding may lower the bound."""


@dataclass(frozen=True)
class LayoutBound:
    """A bound of the weakest direction of all layouts, with its certificate."""

    value: float
    """No layout of these thrusters has a larger weakest direction [N, scaled]."""
    metric: tuple[tuple[float, ...], ...]
    """The metric C (m, m) that proves it, with trace 1."""
    longest: tuple[float, ...]
    """For each thruster the largest f^2 |C b|^2 of all its poses, from above (n,) [N^2]."""
    factor: float
    """K, by which their sum is multiplied [1]."""
    axes: tuple[Axis, ...]
    """The axes of the wrench that count (m,)."""
    rounds: int
    """How many rounds were taken."""

    def to_dict(self) -> dict[str, Any]:
        """Returns it as values for JSON."""
        return asdict(self) | {"metric": [list(row) for row in self.metric]}


def layout_bound(
    layout: Layout,
    names: Sequence[str],
    bounds: Mapping[str, Bounds] | None = None,
    *,
    mirror: Sequence[tuple[str, str]] | None = None,
    axes: Sequence[Axis] | None = None,
    keep_outs: Sequence[KeepOut] = (),
    after_loss: bool = False,
    rounds: int = ROUNDS,
    cancelled: Callable[[], bool] | None = None,
) -> LayoutBound:
    """Returns what the weakest direction of no layout exceeds.

    Distances between thrusters and other rules of a search do not count: with them there are fewer
    layouts, so that the bound holds as well.

    Args:
        layout: thrusters and their limits; those that do not move stay where they are.
        names: names of those that move; mirrored twins follow.
        bounds: where each may go, as for `optimize_layout`.
        mirror: pairs that stay each other's mirror image; when None, all that are so now.
        axes: axes of the wrench that count, all that the layout commands when None; on the others,
            anything may come.
        keep_outs: boxes in which none of those that move may stand.
        after_loss: whether to bound the weakest direction after the worst loss of a thruster.
        rounds: most rounds of the search for the best metric.
        cancelled: called after each round; when it returns True, the bound is that of the best
            metric so far, which holds as well.

    Raises:
        LayoutError: an actuator is no thruster, is unknown, or has no place left.
    """
    check_bounded(layout)
    counted = layout.axes if axes is None else axes
    rows = [WRENCH.index(axis) for axis in counted]
    sets = _pose_sets(layout, names, bounds or {}, mirror, keep_outs)
    n_working = layout.n - after_loss
    factor, force = ball_factor(layout.lower[:, 0], layout.upper[:, 0], n_working, len(rows))
    if factor == 0.0:
        zeros = np.zeros((len(rows), len(rows)))
        no_length = (0.0,) * layout.n
        return LayoutBound(0.0, _as_tuples(zeros), no_length, 0.0, tuple(counted), 0)
    design = _Design(sets, force**2, rows)
    return _least_bound(design, factor, counted, after_loss, rounds, cancelled)


def check_bounded(
    layout: Layout, goal: str = "weakest_direction", flow: Array | None = None
) -> None:
    """Checks that there is a bound.

    Args:
        layout: its actuators.
        goal: name of the goal.
        flow: velocity (6,) relative to the water [m/s, rad/s]; None at rest.

    Raises:
        LayoutError: an actuator is no thruster, the goal is not one of directions, or the water
            flows.
    """
    if goal == "mission_power":
        raise LayoutError(
            "bound: there is none of the power for a mission; expected the goal weakest_direction "
            "or worst_single_failure"
        )
    if flow is not None and bool(np.any(flow)):
        raise LayoutError("bound: it holds at rest; leave out the flow")
    others = [actuator for actuator in layout.actuators if actuator.type != "thruster"]
    if others:
        raise LayoutError(
            f"bound: expected thrusters alone, got {others[0].name}, a {others[0].type}; it holds "
            "for forces along lines"
        )


def _pose_sets(
    layout: Layout,
    names: Sequence[str],
    bounds: Mapping[str, Bounds],
    mirror: Sequence[tuple[str, str]] | None,
    keep_outs: Sequence[KeepOut],
) -> list[PoseSet]:
    """The poses of all thrusters (n); arguments as those of `layout_bound`."""
    moving = set(layout.indices(tuple(names), "names"))
    leader_of = dict[int, int]()
    for pair in mirror_pairs(layout) if mirror is None else mirror:
        first, second = layout.indices(pair)
        if first in moving or second in moving:
            # As in `Moves`, the one that is named first leads.
            leads = [layout.index(name) for name in names if name in pair][0]
            follows = second if leads == first else first
            leader_of[follows] = leads
    sets = []
    for i, thruster in enumerate(layout.actuators):
        torque_per_newton = getattr(thruster, "torque_per_newton", 0.0)
        leader = leader_of.get(i, i)
        if leader not in moving:
            axis = layout.frames[i, 0]
            sets.append(PoseSet.of_one(layout.position[i], axis, torque_per_newton))
            continue
        lead = layout.actuators[leader]
        sets.append(
            PoseSet.within(
                bounds.get(lead.name) or Bounds.around(lead),
                axis=layout.frames[leader, 0],
                azimuth=azimuth(lead),
                torque_per_newton=torque_per_newton,
                keep_outs=keep_outs,
                is_mirrored=leader != i,
            )
        )
    return sets


class _Design:
    """Thrusters that are spread over poses: each pose set has columns, and the weight of each."""

    def __init__(self, sets: Sequence[PoseSet], weights: Array, rows: Sequence[int]) -> None:
        """Takes the poses of the thrusters (n), their weights f^2 (n,) [N^2], and the rows of the
        wrench that count (m)."""
        self._rows = rows
        self._weights = weights
        self._sets = list(Counter(sets))
        self._set_of = np.array([self._sets.index(one) for one in sets])
        self._mass = np.bincount(self._set_of, weights)
        # First columns: the three axes at each place, or those of a single direction.
        self._columns = np.zeros((0, len(rows)))
        self._group = np.zeros(0, np.intp)
        self._share = np.zeros(0)
        for k, one in enumerate(self._sets):
            maps = one.wrench_maps(rows)
            if one.axis is None:
                columns = np.swapaxes(maps, -1, -2).reshape(-1, len(rows))
            else:
                angles = np.array([np.mean([one.turn, one.tilt], axis=1)])
                columns = maps @ one.directions(angles)[0]
            self._add(k, columns)

    def _add(self, group: int, columns: Array) -> None:
        """Adds columns (K, m) of a pose set, with the mean share of those that it has."""
        n_before = int((self._group == group).sum())
        self._columns = np.concatenate([self._columns, columns])
        self._group = np.append(self._group, np.full(len(columns), group))
        share = 1.0 / (n_before + len(columns))
        self._share[self._group[: len(self._share)] == group] *= n_before * share
        self._share = np.append(self._share, np.full(len(columns), share))

    def metric(self) -> Array:
        """Returns M^-1 of the design, symmetric (m, m), with trace 1."""
        weighted = self._columns * (self._share * self._mass[self._group])[:, None]
        information = weighted.T @ self._columns  # M
        ridge = REGULARIZATION * np.trace(information)
        inverse = np.linalg.inv(information + ridge * np.eye(len(information)))
        symmetric = 0.5 * (inverse + inverse.T)
        return np.asarray(symmetric / np.trace(symmetric))

    def attained(self, metric: Array) -> float:
        """Returns tr(C M C) of the design [N^2], which the bound cannot be below by its metric."""
        lengths = ((self._columns @ metric) ** 2).sum(axis=-1)
        return float((lengths * self._share * self._mass[self._group]).sum())

    def longest(self, metric: Array) -> Array:
        """Returns for each thruster the largest f^2 |C b|^2 over its poses (n,) [N^2], from above,
        and keeps the columns that have it."""
        bounds = np.zeros(len(self._sets))
        self._new_columns = list[Array]()
        for k, one in enumerate(self._sets):
            found = one.longest(metric, self._rows)
            bounds[k] = found.bound
            self._new_columns.append(found.columns)
        return np.asarray(self._weights * bounds[self._set_of])

    def improve(self) -> None:
        """Adds the columns that were found last, and takes multiplicative steps."""
        for k, one in enumerate(self._sets):
            if not one.is_single:
                self._add(k, self._new_columns[k])
        for _ in range(STEPS):
            lengths = ((self._columns @ self.metric()) ** 2).sum(axis=-1)
            # w <- w sqrt(|C b|^2), and the shares of each thruster sum to 1.
            share = self._share * np.sqrt(lengths)
            total = np.bincount(self._group, share, len(self._sets))
            self._share = share / np.where(total > 0.0, total, 1.0)[self._group]
        is_kept = self._share > NEGLIGIBLE_WEIGHT
        self._columns = self._columns[is_kept]
        self._group = self._group[is_kept]
        self._share = self._share[is_kept]


def _least_bound(
    design: _Design,
    factor: float,
    axes: Sequence[Axis],
    after_loss: bool,
    rounds: int,
    cancelled: Callable[[], bool] | None,
) -> LayoutBound:
    """The least bound by the metrics of a design that improves from round to round; arguments as
    those of `layout_bound`."""
    best_value = math.inf
    for n_rounds in range(1, rounds + 1):
        metric = design.metric()
        longest = design.longest(metric)
        # A lost thruster is at best the one that counts most.
        total = longest.sum() - (longest.max() if after_loss else 0.0)
        value = math.sqrt(factor * total) * (1.0 + ROUNDING_SHARE)
        if value < best_value:
            best_value = value
            certificate = LayoutBound(
                value=value,
                metric=_as_tuples(metric),
                longest=tuple(longest.tolist()),
                factor=factor,
                axes=tuple(axes),
                rounds=n_rounds,
            )
        if longest.sum() <= (1.0 + SETTLED) ** 2 * design.attained(metric):
            break
        if cancelled is not None and cancelled():
            break
        design.improve()
    return certificate


def _as_tuples(matrix: Array) -> tuple[tuple[float, ...], ...]:
    """A matrix (m, m) as tuples, which compare."""
    return tuple(tuple(row) for row in matrix.tolist())
