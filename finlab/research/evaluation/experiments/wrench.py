"""Experiment `wrench`: errors of each method on wrenches that the robot can deliver."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from finlab.errors import DataError
from finlab.files.worker import in_worker
from finlab.layout import Layout, load_layout
from finlab.layout.load import load_layout_and_lost
from finlab.physics import plant_of
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, paper_figures
from finlab.research.evaluation.method_specs import (
    SLOW,
    MethodSpec,
    installed_methods,
    load_method_specs,
)
from finlab.research.evaluation.plots import fins_picture
from finlab.research.evaluation.scoring import (
    Columns,
    joined,
    mean_interval,
    means_by_layout,
    quantile_interval,
    run_method,
    share_interval,
)
from finlab.research.evaluation.splits import SPLITS, SplitCase, make_case, make_split, own_sigma
from finlab.research.evaluation.verdict import Comparison
from finlab.research.executor import map_parts

SUCCESS_LEVELS = (
    0.01,
    0.5,
    1.0,
)  # levels t of `success_t`, the share of targets with `err_norm <= t`
OWN_DOMAIN = 0x0711
"""Leads the seed of the draws on a user's own layout."""
PRINTED_METHODS = {"ours": "paper", "qp": "qp", "sqp": "paper_sqp"}
"""Name in the paper's table -> our method of the same steps."""
PRINTED_KEYS = {
    "err_norm_mean": "mean error",
    "err_norm_median": "median error",
    "err_norm_p95": "95th percentile of the error",
    "err_norm_max": "largest error",
    "err_phys_mean": "mean error in N and N m",
    "success_0.5": "share within 0.5",
    "success_1.0": "share within 1.0",
}
"""Figures of the paper's table, in words."""
MEASURES = (
    "finlab/actuators/fin/fin_laws.py",
    "finlab/physics/plant.py",
    "finlab/physics/objective.py",
    "finlab/research/random_layouts.py",
    "finlab/research/evaluation/scoring.py",
    "finlab/research/evaluation/splits.py",
)
"""What decides the rows of all experiments on random robots, beside the methods."""


def run(
    layout: str | None = None,
    split: tuple[str, ...] = ("id",),
    methods: tuple[str, ...] | None = None,
    layouts: int = 100,
    targets: int = 1000,
    subsample: int = 10,
    checkpoint: str | None = None,
    by_fins: bool = False,
    seed: int = 0,
) -> list[Row]:
    """One row for each split and method.

    Args:
        layout: a layout file, bundle or shipped name in place of a split: one case, of that many
            targets, with errors over the robot's own wrenches.
        split: names, or all: id, ood, ood-fins, limits, failure, near-singular, fins, fins-mixed,
            tables, many-fins, thrusters, azimuths, mixed-actuators, any-shaft.
        methods: names; by default dual and paper, on LAYOUT all that are installed. Of several
            splits each method answers those whose robots it takes.
        layouts: of each split.
        targets: on each layout.
        subsample: ipopt answers only the first so many of each layout; column n says how many.
        checkpoint: of the learned methods, a shipped name or a folder.
        by_fins: one more row for each number of fins (or other actuators) that work.
        seed: of all draws.
    """
    sets = _cases(layout, split, layouts, targets, seed)
    usual = (
        ("dual", "paper") if layout is None else installed_methods(in_worker(load_layout, layout))
    )
    specs = load_method_specs(methods or usual, checkpoint, patient=True)
    rows: list[Row] = []
    for name, cases in sets.items():
        robot = cases[0]().layout
        able = {
            each: spec
            for each, spec in specs.items()
            if len(sets) == 1 or spec.choice.kind.fits(robot)
        }
        answered = list(
            map_parts(partial(_scores, able, subsample), list(enumerate(cases)), name, "layout")
        )
        for method in able:
            scores = joined([each[method] for each in answered])
            rows.append(_row(name, method, None, scores))
            for fins in np.unique(scores["fins"]) if by_fins else ():
                some = {key: values[scores["fins"] == fins] for key, values in scores.items()}
                rows.append(_row(name, method, int(fins), some))
    return rows


def _scores(
    methods: Mapping[str, MethodSpec], subsample: int, numbered: tuple[int, Callable[[], SplitCase]]
) -> dict[str, Columns]:
    """Scores of each method on a case; it is made where it is answered, tables of fins included."""
    number = numbered[0]
    made = numbered[1]()
    firsts = {method: subsample if method in SLOW else None for method in methods}
    return {
        each: run_method(methods[each], made, number=number, first=firsts[each]) for each in methods
    }


def _row(split: str, method: str, fins: int | None, scores: Columns) -> Row:
    """Means, quantiles and shares of a split, or of its robots of so many fins, with their
    intervals."""
    error = scores["err_norm"]
    group = scores["layout"]
    about = {"split": split, "method": method, "fins": fins, "n": len(group), "scored_by": "plant"}
    row: Row = {
        "err_norm_mean": error.mean(),
        "err_norm_median": np.median(error),
        "err_norm_p05": np.quantile(error, 0.05),
        "err_norm_p95": np.quantile(error, 0.95),
        "err_norm_max": error.max(),
        "err_phys_mean": scores["err_phys"].mean(),
        **{f"success_{level}": (error <= level).mean() for level in SUCCESS_LEVELS},
        "effort_mean": scores["effort"].mean(),
        "power_mean": scores["power"].mean(),
        "solve_ms_p50": np.median(scores["solve_ms"]),
        "solve_ms_p99": np.quantile(scores["solve_ms"], 0.99),
    }
    intervals = {
        "err_norm_mean": mean_interval(error, group),
        "err_norm_median": quantile_interval(error, group, 0.5),
        "err_norm_p95": quantile_interval(error, group, 0.95),
        "err_phys_mean": mean_interval(scores["err_phys"], group),
        "power_mean": mean_interval(scores["power"], group),
        **{f"success_{level}": share_interval(error <= level, group) for level in SUCCESS_LEVELS},
    }
    plain = {key: float(value) for key, value in row.items()}
    ends = {f"{key}_interval": list(ends) for key, ends in intervals.items()}
    return about | plain | ends | {"err_norm_mean_by_layout": means_by_layout(error, group)}


def _cases(
    layout: str | None, split: tuple[str, ...], layouts: int, targets: int, seed: int
) -> dict[str, list[Callable[[], SplitCase]]]:
    """By the name of each split, or of the layout that is given, functions that make its cases."""
    if layout is None:
        names = list(SPLITS) if split == ("all",) else split
        for name in names:
            make_split(name, 1, 1, seed)  # refuses what there is not
        return {
            name: [partial(make_case, name, targets, seed, k) for k in range(layouts)]
            for name in names
        }
    if split != ("id",):
        raise DataError(
            f"split: a layout has none, got {','.join(split)!r} beside {layout!r:.60}; leave one "
            "of them out"
        )
    robot, lost = in_worker(load_layout_and_lost, layout)
    return {f"layout {robot.name}": [partial(own_case, robot, lost, targets, seed)]}


def own_case(layout: Layout, lost: tuple[str, ...], n_targets: int, seed: int) -> SplitCase:
    """A user's own layout as a case: wrenches of uniform commands of the actuators that work, and
    errors over the robot's own wrenches. A smaller number of targets gives the first of a larger
    one."""
    plant = plant_of(layout.without(lost))
    target_seed, sigma_seed = np.random.SeedSequence((OWN_DOMAIN, seed)).spawn(2)
    targets = plant.wrench(plant.sample(np.random.default_rng(target_seed), (n_targets,)))
    return SplitCase(layout, targets, lost, own_sigma(plant, np.random.default_rng(sigma_seed)))


def _printed(rows: Sequence[Row]) -> list[Row]:
    """The paper's rows of splits that it has; it does not name the model that scored them."""
    printed = paper_figures()["wrench_tracking"]
    return [
        {"split": split, "method": f"{name} (printed in the paper)", "scored_by": "", **row}
        for split in dict.fromkeys(row["split"] for row in rows)
        for name, row in printed.get(split, {}).items()
    ]


def _compared(rows: Sequence[Row]) -> list[Comparison]:
    """Each figure of the paper's table beside that of our method of the same steps."""
    printed = paper_figures()["wrench_tracking"]
    compared = []
    for split, table in printed.items():
        for name, method in PRINTED_METHODS.items():
            figures = table[name]
            row = next((r for r in rows if (r["split"], r["method"]) == (split, method)), {})
            for key, words in PRINTED_KEYS.items():
                obstacle = ""
                if key == "err_norm_max" and row.get("n", 0) < figures["n"]:
                    obstacle = (
                        f"The largest of {row.get('n', 0):,} and of {figures['n']:,} targets."
                    )
                compared.append(
                    Comparison(
                        f"{split}, {name}: {words}",
                        figures[key],
                        row.get(key),
                        row.get(f"{key}_interval"),
                        obstacle,
                    )
                )
    return compared


experiment = Experiment(
    name="wrench",
    question="How far off are the wrenches of each method, of those that a robot can deliver?",
    columns=(
        Column("split", "split", "code"),
        Column("method", "method", "code"),
        Column("fins", "fins", "count"),
        Column("n", "targets", "count"),
        Column("err_norm_mean", "mean error", "error", "err_norm_mean_interval"),
        Column("err_norm_median", "median", "error"),
        Column("err_norm_p95", "95th percentile", "error"),
        Column("err_norm_max", "largest", "error"),
        Column("success_0.01", "within 0.01", "share", "success_0.01_interval"),
        Column("success_0.5", "within 0.5", "share"),
        Column("success_1.0", "within 1.0", "share"),
        Column("err_phys_mean", "mean error in N and N m", "error"),
        Column("power_mean", "mean power", "three", unit="W"),
        Column("solve_ms_p50", "median time", "three", unit="ms"),
    ),
    run=run,
    note=(
        "Scored by the plant, the actuators' own laws or tables. Errors in standard deviations of "
        "the wrenches of random layouts; on fins, fins-mixed and tables, on robots of other "
        "actuators and on a layout of your own, of the robot's wrenches. Intervals: where another "
        "seed lands, 95 times of 100. Time: that of all targets of a layout over their number. "
        "Printed: the paper's figures, on its own layouts and targets."
    ),
    quick={
        "split": ("id", "ood"),
        "methods": ("dual", "paper", "qp", "paper_sqp"),
        "layouts": 10,
        "targets": 5,
    },
    usual={
        "split": ("id", "ood"),
        "methods": ("dual", "paper", "qp", "paper_sqp"),
        "layouts": 100,
        "targets": 100,
    },
    full={"targets": 1000},
    pieces=("split", "methods"),
    measures=(*MEASURES, "finlab/research/evaluation/experiments/wrench.py"),
    probe={"layouts": 2, "targets": 3},
    compared=_compared,
    printed=_printed,
    picture=fins_picture,
    for_picture={"by_fins": True},
    only_for_picture=lambda row: row["fins"] is not None,
)
