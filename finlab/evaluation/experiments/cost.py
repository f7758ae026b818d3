"""What methods cost under exact tracking, over the best of many random starts: power in watts, or effort.

Both sides must deliver the wrench; a target that either of them misses is counted and left out of the ratio.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.evaluation.cheapest_commands import CheapestCommands, has_formulas
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import SPLITS, Case, make_split
from finlab.evaluation.statistics.bootstrap import ratio_interval
from finlab.evaluation.statistics.recheck import known_by_hand, wrench_by_hand
from finlab.evaluation.statistics.tables import Row
from finlab.evaluation.symmetric_cases import SETS, symmetric_cases
from finlab.physics import plant_of
from finlab.physics.objective import Name, Objective

TRACKED = 1e-3
"""Normalized error up to which a method counts as delivering a target."""
CHEAPER = 1.0 - 1e-4
"""Cost over the reference's below which a method has won."""
OBJECTIVES: tuple[Name, ...] = ("power", "effort")
"""What may be kept least."""
UNITS = {"power": "W", "effort": "J_en"}
"""What a cost is counted in."""


def cost_sets(split: str) -> list[str]:
    """The sets of cases that a name stands for, one or `all`; `DataError` for any other name."""
    known = [*SPLITS, *SETS]
    if split != "all" and split not in known:
        raise DataError(f"split: expected all or one of {', '.join(known)}, got {split!r}")
    return known if split == "all" else [split]


def parse_objectives(names: str) -> list[Name]:
    """Objectives from their names with commas between; `DataError` for any other name."""
    words = [name.strip() for name in names.split(",") if name.strip()]
    if not words or (unknown := [name for name in words if name not in OBJECTIVES]):
        got = unknown[0] if words else names
        raise DataError(f"objectives: expected power, effort or both with a comma between, got {got!r}")
    return [name for name in OBJECTIVES if name in words]


def cost_rows(
    name: str,
    allocators: Mapping[str, Allocator],
    objective: Name,
    *,
    layouts: int,
    targets: int,
    seed: int,
    n_starts: int = 32,
) -> list[Row]:
    """One row per method and number of fins, and one over all of them, whose `fins` is "all".

    Args:
        name: a split or a set of symmetric cases.
        allocators: methods by name; those that can choose are given the objective.
        objective: what is kept least.
        layouts: of the split.
        targets: on each layout.
        seed: of the cases and of the starts.
        n_starts: random starts per target; robots with tables get twice as many.
    """
    draw = symmetric_cases if name in SETS else make_split
    cases = draw(name, layouts, targets, seed)
    aim = Objective(objective)
    methods = {
        key: each.with_settings(objective=objective) if "objective" in each.option_names() else each
        for key, each in allocators.items()
    }
    best, found = [], {key: list[_Answers]() for key in methods}
    for case in progress(cases, "layout", f"{name}, {objective}"):
        sigma = case.sigma
        if sigma is None:
            sigma = next(iter(methods.values())).normalization.std
        starts = n_starts if has_formulas(case.healthy) else 2 * n_starts
        reference = CheapestCommands(aim, sigma)
        ends = (reference.ends(case.healthy, target, starts, seed)[1] for target in case.targets)
        best.append(np.array([cost[0] if len(cost) else np.nan for cost in ends]))
        for key, allocator in methods.items():
            found[key].append(_answers(allocator, case, aim, sigma))
    fins = np.repeat([case.healthy.n_fins for case in cases], [len(case.targets) for case in cases])
    group = np.repeat(np.arange(len(cases)), [len(case.targets) for case in cases])
    rows: list[Row] = []
    for key, parts in found.items():
        cost, error, by_hand = (np.concatenate(part) for part in zip(*parts, strict=True))
        for count in [*np.unique(fins).tolist(), "all"]:
            chosen = np.full(len(fins), True) if count == "all" else fins == count
            about = {"split": name, "objective": objective, "method": key, "fins": count}
            values = (part[chosen] for part in (cost, error, by_hand, np.concatenate(best), group))
            rows.append(about | _figures(*values))
    return rows


_Answers = tuple[Array, Array, Array]
"""Cost (N,), normalized error (N,), and the same error by hand (N,), NaN where fins follow other laws."""


def _answers(allocator: Allocator, case: Case, aim: Objective, sigma: Array) -> _Answers:
    answer = allocator.allocate_batch(case.layout, case.targets, failed=case.failed)
    works = [name not in case.failed for name in case.layout.names]
    command, healthy = answer.command[:, works], case.healthy
    plant = plant_of(healthy)
    error = np.linalg.norm((plant.wrench(command) - case.targets) / sigma, axis=-1)
    # An answer outside its limits is none, whatever it would cost.
    error[((command < plant.lower) | (command > plant.upper)).any((1, 2))] = np.inf
    by_hand = np.full(len(error), np.nan)
    if known_by_hand(healthy):
        by_hand = np.linalg.norm((wrench_by_hand(healthy, command) - case.targets) / sigma, axis=-1)
    return np.asarray(aim.meter(plant)(command)), error, by_hand


def _figures(cost: Array, error: Array, by_hand: Array, best: Array, group: NDArray[np.int64]) -> Row:
    known = np.isfinite(best)
    both = known & (error <= TRACKED)
    row: Row = {
        "n": len(cost),
        "solved_by_starts": int(known.sum()),
        "tracked": float((error <= TRACKED).mean()),
    }
    ratio = cost[both] / best[both]
    if not len(ratio):
        return row | dict.fromkeys(("cost", "cost_ratio", "cost_ratio_interval", *_OF_TARGETS))
    wins = by_hand[both][ratio < CHEAPER]
    known_wins = wins[np.isfinite(wins)]
    return row | {
        "cost": float(cost[both].mean()),
        "cost_ratio": float(cost[both].sum() / best[both].sum()),
        "cost_ratio_interval": list(ratio_interval(cost[both], best[both], group[both])),
        "ratio_p95": float(np.quantile(ratio, 0.95)),
        "ratio_max": float(ratio.max()),
        "cheaper": float((ratio < CHEAPER).mean()),
        "win_error": float(known_wins.max()) if len(known_wins) else None,
    }


_OF_TARGETS = ("ratio_p95", "ratio_max", "cheaper", "win_error")
