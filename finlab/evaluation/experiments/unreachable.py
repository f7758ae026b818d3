"""Wrenches on the boundary of what a robot can do, and beyond it: what is missed above the least.

A direction is that of a random command's wrench, so that it can be pushed at all. IPOPT finds how far it
goes, and the least error that any forces leave of each multiple of that wrench. The plant scores the answers.
"""

from typing import NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.policy import AXES, KINDS, Policy
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.experiment import Experiment
from finlab.evaluation.ipopt_reach import IpoptReach
from finlab.evaluation.method_specs import load_method_specs
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.evaluation.splits import Case, make_split
from finlab.evaluation.statistics.bootstrap import mean_interval
from finlab.physics import plant_of

FAR = 30.0
"""A random command's wrench times this is out of reach [-]."""
WITH_POLICIES = ("search", "mdn")
"""Methods that are asked under every policy; the others know `closest` alone."""


class Boundary(NamedTuple):
    """Targets of one robot, D directions by F factors, and what is possible."""

    targets: Array
    """(F, D, 6) [N, N m]."""
    least: dict[str, Array]
    """The least normalized errors (F, D): under `closest` on all axes, under `priority` on the first
    group."""
    share: Array
    """The largest shares (F, D) of the targets that can be had alone."""


def run(
    split: tuple[str, ...] = ("id",),
    methods: tuple[str, ...] = ("search", "mdn", "analytic", "sqp"),
    factors: tuple[float, ...] = (1.0, 1.2, 2.0),
    layouts: int = 25,
    targets: int = 4,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each split, factor, method and policy.

    Args:
        split: names as in eval wrench, of splits whose fins follow the law drag, such as id, ood or limits.
        methods: names as in eval wrench; search and mdn are asked under every policy.
        factors: targets over the largest wrench of their direction, from 1.
        layouts: of each split.
        targets: directions on each layout.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of all draws.
    """
    if min(factors) < 1.0:
        raise DataError(f"factors: expected numbers from 1, got {min(factors):g}")
    allocators = load_method_specs(methods, checkpoint, patient=True)
    sigma = next(iter(allocators.values())).normalization.std
    rows: list[Row] = []
    for name in split:
        cases = make_split(name, layouts, targets, seed)
        if any(fin.model.type != "drag" for case in cases for fin in case.layout.fins):
            raise DataError(f"split: expected one whose fins follow the law drag, got {name!r}")
        known = [_boundary(case, sigma, factors) for case in progress(cases, "layout", f"{name}, boundary")]
        for method, allocator in allocators.items():
            for policy in KINDS if method in WITH_POLICIES else KINDS[:1]:
                found = [
                    _missed(allocator, case, each, sigma, policy)
                    for case, each in zip(progress(cases, "layout", method), known, strict=True)
                ]
                rows += [
                    {"split": name, "factor": factor, "method": method, "policy": policy}
                    | _figures([each[k] for each in found])
                    | {"least_mean": float(np.mean([each.least["closest"][k] for each in known]))}
                    for k, factor in enumerate(factors)
                ]
    return sorted(rows, key=lambda row: (split.index(row["split"]), row["factor"]))


def _boundary(case: Case, sigma: Array, factors: tuple[float, ...]) -> Boundary:
    reach = IpoptReach(case.healthy, sigma)
    far = FAR * case.targets
    largest = np.array([reach.largest_share(each / sigma) for each in far])[:, None] * far
    asked = np.multiply.outer(np.asarray(factors), largest)
    first = np.isin(AXES, Policy("priority").order[0])
    least = {
        policy: np.array([[reach.least_error(each / sigma, axes) for each in row] for row in asked])
        for policy, axes in (("closest", np.full(6, True)), ("priority", first))
    }
    share = np.array([[reach.largest_share(each / sigma) for each in row] for row in asked])
    return Boundary(asked, least, share)


def _missed(allocator: Allocator, case: Case, known: Boundary, sigma: Array, policy: str) -> Array:
    """What is missed beyond the least (F, D) under a policy."""
    shape = known.targets.shape[:2]
    answer = allocator.allocate_batch(
        case.layout, known.targets.reshape(-1, 6), failed=case.failed, policy=policy
    )
    works = [fin not in case.failed for fin in case.layout.names]
    given = plant_of(case.healthy).wrench(answer.command[:, works]).reshape(*shape, 6) / sigma
    wanted = known.targets / sigma
    if policy == "direction":
        share = (given * wanted).sum(axis=-1) / (wanted**2).sum(axis=-1)
        return np.asarray(known.share - share)
    axes = np.full(6, True) if policy == "closest" else np.isin(AXES, Policy("priority").order[0])
    return np.asarray(np.linalg.norm((given - wanted)[..., axes], axis=-1) - known.least[policy])


def _figures(excess: list[Array]) -> Row:
    values = np.concatenate(excess)
    group = np.repeat(np.arange(len(excess)), [len(each) for each in excess])
    return {
        "n": len(values),
        "excess_mean": float(values.mean()),
        "excess_mean_interval": list(mean_interval(values, group)),
        "excess_median": float(np.median(values)),
        "excess_max": float(values.max()),
    }


experiment = Experiment(
    name="unreachable",
    question="What do methods miss beyond the least possible when they are asked for too much?",
    columns=(
        Column("split", "split", "code"),
        Column("factor", "asked over largest", "three"),
        Column("method", "method", "code"),
        Column("policy", "policy", "code"),
        Column("n", "targets", "count"),
        Column("least_mean", "least possible error", "error"),
        Column("excess_mean", "missed beyond it, mean", "error", "excess_mean_interval"),
        Column("excess_median", "median", "error"),
        Column("excess_max", "largest", "error"),
    ),
    run=run,
    note=(
        "IPOPT finds in the fins' forces the largest wrench of a random direction, and the least error of "
        "multiples of it, exact to about 1e-5. Missed: under closest, normalized error beyond that least; "
        "under priority the same on the first group of axes; under direction the share of the target that is "
        "lacking to the largest possible."
    ),
    quick={"layouts": 4, "targets": 2, "methods": ("search", "analytic")},
    full={"split": ("id", "limits")},
    each="split",
    needs=("casadi",),
    less_is_better=("excess_mean",),
)
