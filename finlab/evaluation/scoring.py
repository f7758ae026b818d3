"""Answers of a method, scored by the plant: one entry per target, under the names of columns."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from finlab.arrays import AnyArray, Array
from finlab.evaluation.method_specs import MethodSpec
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import Case
from finlab.networks.checkpoint import read_normalization, resolve_checkpoint
from finlab.physics import plant_of
from finlab.physics.objective import command_effort

Columns = dict[str, AnyArray]
"""Arrays of N entries by name."""


def run_method(
    method: MethodSpec, cases: Sequence[Case], *, seed: int = 0, first: int | None = None
) -> Columns:
    """What a method does on cases; all targets of a layout are solved together.

    Args:
        method: who answers.
        cases: layouts with targets.
        seed: passed to the method.
        first: only the first so many targets of each layout.

    Returns:
        The columns of `score`.
    """
    parts = []
    for k, case in enumerate(progress(cases, "layout", method.name)):
        targets = case.targets[:first]
        answer = method.on(case.layout).allocate_batch(targets, failed=case.failed, seed=seed)
        parts.append(score(case, targets, answer.command, answer.solve_ms, number=k))
    return joined(parts)


def score(case: Case, targets: Array, command: Array, solve_ms: Array, *, number: int = 0) -> Columns:
    """Scores of answers to targets (N, 6) of a case, the wrench computed by the plant.

    Args:
        case: the layout.
        targets: desired wrenches (N, 6).
        command: the method's answers (N, n, 3).
        solve_ms: what each took (N,) [ms].
        number: of the layout in its split.

    Returns:
        Arrays (N,): `layout`, its number; `err_norm`, the norm of what is missing over `sigma_of`, without
        axes that are free; `err_phys`, the same in N and N m; `effort`, the paper's J_en; `power` [W];
        `solve_ms`.
    """
    plant = plant_of(case.layout)
    missing = (plant.wrench(command) - targets) * case.layout.commanded
    return {
        "layout": np.full(len(targets), number, np.int64),
        "err_norm": np.linalg.norm(missing / sigma_of(case), axis=-1),
        "err_phys": np.linalg.norm(missing, axis=-1),
        "effort": command_effort(command, plant.upper),
        "power": np.nansum(plant.power(command), axis=-1),
        "solve_ms": np.asarray(solve_ms, np.float64),
    }


def sigma_of(case: Case) -> Array:
    """What the errors of a case are divided by (6,) [N, N m]: its own standard deviation of wrenches, or that
    of the paper's data set."""
    return paper_sigma() if case.sigma is None else case.sigma


@lru_cache
def paper_sigma() -> Array:
    """Per-axis standard deviation (6,) [N, N m] of the wrenches of the paper's data set."""
    return read_normalization(resolve_checkpoint("default")).std


def joined(parts: Sequence[Columns]) -> Columns:
    """Columns one after the other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
