"""What is delivered of wrenches out of reach, against what IPOPT proves to be possible.

In the planar forces of the fins each policy asks for the optimum of a convex problem (for every choice of
halves of the arcs that are wider than half a turn). IPOPT solves it here with the thrusts of the analytic fin
model; the answers are scored by the plant. `closest` and the first group of `priority` are compared by their
error, `direction` by the share of the target that is delivered and by what is delivered beside it.
"""

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.ipopt import SOLVER_OPTIONS, import_casadi
from finlab.allocation.policy import KINDS, Policy
from finlab.arrays import Array
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.tables import Row
from finlab.layout import Layout, random_layout
from finlab.layout.angles import is_full_turn
from finlab.layout.arrays import layout_effectiveness
from finlab.physics import Plant, plant_of

DOMAIN = 0xFA2
"""Leads the seed of every case."""
FINS = (2, 8)
"""Least and most fins."""
FARTHER = (1.5, 3.0, 10.0)
"""Targets are reachable wrenches times one of these, or sigma times it in any direction."""
BESIDE = 1e-6
"""Normalized wrench beside the target that the judge of `direction` allows on each axis."""


Score = tuple[float, float, float]
"""Of one answer. By `closest` and `priority` the normalized error beyond the least possible, by `direction`
the share of the target that is lacking to the largest possible; by `direction` the normalized wrench beside
that share; the time of the call [ms]."""


class Judge:
    """The best planar forces for one layout, by IPOPT.

    Args:
        layout: the robot.
        sigma: per-axis standard deviation (6,).
    """

    def __init__(self, layout: Layout, sigma: Array) -> None:
        self.casadi, self.sigma = import_casadi(), sigma
        self.effect = layout_effectiveness(layout) / sigma[:, None]
        plant = plant_of(layout)
        self.thrust = plant.thrust(plant.upper[:, 0], plant.upper[:, 1])
        self.arcs = _convex_arcs(plant.lower[:, 2], plant.upper[:, 2])

    def least_error(self, target: Array, axes: NDArray[np.bool_]) -> float:
        """The least error on some axes (6,) of a normalized target (6,)."""
        force = self.casadi.SX.sym("force", self.effect.shape[1])
        missing = (target - self.casadi.DM(self.effect) @ force)[np.flatnonzero(axes).tolist()]
        return float(np.sqrt(self._best(force, force, self.casadi.sumsqr(missing), [])))

    def largest_share(self, target: Array) -> float:
        """The largest share, up to one, of a normalized target (6,) that can be had alone."""
        force, share = self.casadi.SX.sym("force", self.effect.shape[1]), self.casadi.SX.sym("share")
        beside = self.casadi.DM(self.effect) @ force - share * target
        limits = [(beside[j], -BESIDE, BESIDE) for j in range(6)] + [(share, 0.0, 1.0)]
        return -self._best(force, self.casadi.vertcat(force, share), -share, limits)

    def _best(self, force: Any, unknowns: Any, cost: Any, limits: list[tuple[Any, float, float]]) -> float:
        """The least cost over all choices of halves."""
        return min(self._solve(unknowns, cost, limits + self._fins(force, arcs)) for arcs in self.arcs)

    def _fins(self, force: Any, arcs: Array) -> list[tuple[Any, float, float]]:
        """Limits of each fin's thrust and direction, for one choice of halves."""
        limits: list[tuple[Any, float, float]] = []
        for i, (first, last) in enumerate(arcs):
            across, up = force[2 * i], force[2 * i + 1]
            limits.append((across**2 + up**2, 0.0, self.thrust[i] ** 2))
            if not is_full_turn(last - first):
                middle = 0.5 * (first + last)
                for angle in (first + 0.5 * np.pi, last - 0.5 * np.pi, middle):
                    limits.append((np.cos(angle) * across + np.sin(angle) * up, 0.0, np.inf))
        return limits

    def _solve(self, unknowns: Any, cost: Any, limits: list[tuple[Any, float, float]]) -> float:
        what, low, high = zip(*limits, strict=True)
        program = {"x": unknowns, "f": cost, "g": self.casadi.vertcat(*what)}
        solver = self.casadi.nlpsol("judge", "ipopt", program, SOLVER_OPTIONS)
        return float(solver(x0=0.0, lbg=low, ubg=high)["f"])


def unreachable_rows(allocator: Allocator, *, n_layouts: int = 50, seed: int = 0) -> list[Row]:
    """One row per kind of limits and policy.

    Args:
        allocator: a method that knows all policies.
        n_layouts: random layouts of each kind of limits, one target each, left out if reachable.
        seed: draws layouts and targets.
    """
    rows = []
    for limits in ("nominal", "varied"):
        scores: dict[str, list[Score]] = {kind: [] for kind in KINDS}
        for k in progress(range(n_layouts), "layout", limits):
            rng = np.random.default_rng((DOMAIN, seed, k))
            layout = random_layout(rng, n_fins=int(rng.integers(FINS[0], FINS[1] + 1)), limits=limits)
            target = _far_target(rng, layout, allocator.normalization.std)
            allocator.allocate(layout, target)  # the first call of a layout is not timed
            for kind, score in _scores(allocator, layout, target).items():
                scores[kind].append(score)
        rows += [_row(limits, kind, found) for kind, found in scores.items() if found]
    return rows


def _scores(allocator: Allocator, layout: Layout, target: Array) -> dict[str, Score]:
    """By policy; nothing if the target can be had."""
    sigma = allocator.normalization.std
    judge, plant, wanted = Judge(layout, sigma), Plant(layout), target / sigma
    least = judge.least_error(wanted, np.ones(6, dtype=bool))
    if least < 0.05:
        return {}
    scores: dict[str, Score] = {}
    for kind in KINDS:
        answer = allocator.allocate(layout, target, policy=kind)
        given = plant.wrench(answer.command) / sigma
        beside = 0.0
        if kind == "direction":
            share = float(given @ wanted / (wanted @ wanted))
            excess = judge.largest_share(wanted) - share
            beside = float(np.linalg.norm(given - share * wanted))
        else:
            axes = np.ones(6, dtype=bool) if kind == "closest" else Policy(kind).groups[0]
            possible = least if kind == "closest" else judge.least_error(wanted, axes)
            excess = float(np.linalg.norm((given - wanted)[axes])) - possible
        scores[kind] = (excess, beside, answer.solve_ms)
    return scores


def _row(limits: str, kind: str, scores: list[Score]) -> Row:
    excess, beside, solve_ms = np.array(scores).T
    return {
        "limits": limits,
        "policy": kind,
        "n": len(scores),
        "excess_median": float(np.median(excess)),
        "excess_max": float(excess.max()),
        "beside_max": float(beside.max()) if kind == "direction" else None,
        "p50_ms": float(np.median(solve_ms)),
        "max_ms": float(solve_ms.max()),
    }


def _far_target(rng: np.random.Generator, layout: Layout, sigma: Array) -> Array:
    """A wrench (6,) [N, N m] that is probably out of reach."""
    farther = rng.choice(FARTHER)
    if rng.uniform() < 0.5:
        near = plant_of(layout).wrench(plant_of(layout).sample(rng, ()))
    else:
        near = rng.standard_normal(6) * sigma
    return np.asarray(near * farther)


def _convex_arcs(lower: Array, upper: Array) -> list[Array]:
    """All choices (n, 2) of arcs of at most half a turn that make up the fins' arcs; full turns stay."""
    choices = []
    for first, last in zip(lower, upper, strict=True):
        middle = 0.5 * (first + last)
        wide = np.pi < last - first and not is_full_turn(last - first)
        choices.append([(first, middle), (middle, last)] if wide else [(first, last)])
    return [np.array(arcs) for arcs in product(*choices)]
