#!/usr/bin/env python3
"""Compares the costs of methods with the best of many random starts: power in watts, or effort.

    python tools/cost.py --split id,limits --methods dual,mdn,sqp --layouts 3 --targets 1 --starts 8

Options are those of `finlab eval`; `--json FILE` has the rows.
"""

from collections.abc import Sequence

import numpy as np
import tyro
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.cli.eval_verbs import verb_of
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.physics.objective import Name, cost_meter
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, check_names, progress
from finlab.research.evaluation.method_specs import (
    PATIENCE_S,
    MethodSpec,
    load_method_spec,
    load_method_specs,
)
from finlab.research.evaluation.scoring import ratio_interval, sigma_of
from finlab.research.evaluation.splits import SPLITS, SplitCase, make_split

EXACT_ERROR = 1e-5
"""Largest normalized error of the reference."""
TRACKED_ERROR = 1e-3
"""Largest normalized error of a method that counts as delivering a target."""
CHEAPER = 1.0 - 1e-4
"""Cost over the reference's below which a method is cheaper."""
FIXED_OBJECTIVE: dict[str, Name] = {
    **dict.fromkeys(("dual", "px4", "ardusub"), "power"),
    **dict.fromkeys(("mdn", "paper"), "effort"),
}
"""Objectives of methods without a choice; they are compared in that one alone."""
UNITS: dict[Name, str] = {"power": "W", "effort": "J_en"}
"""Objectives and the units of their costs."""


def run(
    split: tuple[str, ...] = ("id",),
    methods: tuple[str, ...] = ("dual", "mdn"),
    objectives: tuple[str, ...] = ("power", "effort"),
    layouts: int = 20,
    targets: int = 4,
    starts: int = 32,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """Returns a row for each split, objective and method.

    Args:
        split: names as in eval wrench, or all.
        methods: names as in eval wrench; those that can choose are given the objective,
            others are compared in what they keep least. Of several splits each method answers those
            whose robots it takes; where actuators are no fins power alone is compared.
        objectives: power, effort or both.
        layouts: of each split.
        targets: on each layout.
        starts: random starts of method ipopt for each target; twice as many of sqp.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of the cases and of the starts.
    """
    names = list(SPLITS) if split == ("all",) else split
    check_names("split", names, SPLITS)
    check_names("objectives", objectives, UNITS)
    rows: list[Row] = []
    kinds = {
        method_name: spec.choice.kind
        for method_name, spec in load_method_specs(methods, checkpoint).items()
    }
    for name in names:
        cases = make_split(name, layouts, targets, seed)
        robot = cases[0].layout
        fit = [
            method_name
            for method_name, kind in kinds.items()
            if len(names) == 1 or kind.fits(robot)
        ]
        for objective in UNITS:
            able = tuple(
                method_name
                for method_name in fit
                if FIXED_OBJECTIVE.get(method_name, objective) == objective
            )
            possible = objective == "power" or robot.is_of_fins
            if objective in objectives and able and possible:
                rows += _rows(name, cases, able, objective, starts, checkpoint, seed)
    return rows


def _rows(
    split: str,
    cases: Sequence[SplitCase],
    methods: tuple[str, ...],
    objective: Name,
    starts: int,
    checkpoint: str | None,
    seed: int,
) -> list[Row]:
    specs = load_method_specs(methods, checkpoint, objective, patient=True)
    best = list[Array]()
    answers: dict[str, list[tuple[Array, Array]]] = {name: [] for name in specs}
    for case in progress(cases, "layout", f"{split}, {objective}"):
        sigma = sigma_of(case)
        cost, error = _answers(
            reference_method(case.healthy, objective, starts), case, objective, sigma, seed
        )
        best.append(np.where(error <= EXACT_ERROR, cost, np.nan))
        for name, method in specs.items():
            answers[name].append(_answers(method, case, objective, sigma))
    group = np.repeat(np.arange(len(cases)), [len(case.targets) for case in cases])
    rows: list[Row] = []
    for name, case_answers in answers.items():
        cost, error = (np.concatenate(arrays) for arrays in zip(*case_answers, strict=True))
        head: Row = {
            "split": split,
            "objective": f"{objective} [{UNITS[objective]}]",
            "method": name,
        }
        rows.append(head | _figures(cost, error, np.concatenate(best), group))
    return rows


def reference_method(layout: Layout, objective: Name, starts: int) -> MethodSpec:
    """Returns the method that finds the reference cost of a robot: IPOPT in the space of forces; of
    effort and of tables SLSQP, from the pseudo-inverse's answer and twice as many random
    commands.

    Args:
        layout: the robot.
        objective: power or effort.
        starts: random starts.
    """
    tables = layout.is_of_fins and any(fin.model.type == "table" for fin in layout.fins)
    by_commands = tables or objective == "effort"
    method = load_method_spec("sqp" if by_commands else "ipopt", objective=objective)
    return method.with_settings(
        n_starts=2 * starts if by_commands else starts, time_limit_s=PATIENCE_S
    )


def _answers(
    method: MethodSpec, case: SplitCase, objective: Name, sigma: Array, seed: int = 0
) -> tuple[Array, Array]:
    """Costs and normalized errors, each (N,)."""
    answer = method.on(case.layout).allocate_batch(case.targets, lost=case.lost, seed=seed)
    works = [name not in case.lost for name in case.layout.names]
    command = answer.command[:, works]
    plant = plant_of(case.healthy)
    error = np.linalg.norm((plant.wrench(command) - case.targets) / sigma, axis=-1)
    # An answer outside its limits is none, whatever it would cost.
    error[((command < plant.lower) | (command > plant.upper)).any((1, 2))] = np.inf
    return np.asarray(cost_meter(objective, plant)(command)), error


def _figures(cost: Array, error: Array, best: Array, group: NDArray[np.int64]) -> Row:
    tracked = error <= TRACKED_ERROR
    has_reference = np.isfinite(best)
    compared = has_reference & tracked
    row: Row = {
        "n": len(cost),
        "solved_by_starts": int(has_reference.sum()),
        "tracked": float(tracked.mean()),
    }
    if not compared.any():
        return row
    ratio = cost[compared] / best[compared]
    return row | {
        "cost": float(cost[compared].mean()),
        "cost_ratio": float(cost[compared].sum() / best[compared].sum()),
        "cost_ratio_interval": list(
            ratio_interval(cost[compared], best[compared], group[compared])
        ),
        "ratio_p95": float(np.quantile(ratio, 0.95)),
        "ratio_max": float(ratio.max()),
        "cheaper": float((ratio < CHEAPER).mean()),
    }


experiment = Experiment(
    name="cost",
    question="What do answers cost over the best of many random starts, where both deliver the "
    "wrench?",
    columns=(
        Column("split", "split", "code"),
        Column("objective", "least"),
        Column("method", "method", "code"),
        Column("n", "targets", "count"),
        Column("tracked", "tracked", "share"),
        Column("cost", "mean cost", "three"),
        Column("cost_ratio", "over the best start", "ratio", "cost_ratio_interval"),
        Column("ratio_p95", "95th percentile", "ratio"),
        Column("ratio_max", "worst target", "ratio"),
        Column("cheaper", "cheaper than it", "share"),
    ),
    run=run,
    program="python tools/cost.py",
    note=(
        "The reference is the cheapest exact end of many starts of `ipopt`, of `sqp` for effort "
        "and tables: solvers that know nothing of how `dual` and `mdn` search. Tracked: error up "
        f"to {TRACKED_ERROR:g} by the plant. Effort is the paper's J_en."
    ),
)

if __name__ == "__main__":
    tyro.cli(verb_of(experiment))
