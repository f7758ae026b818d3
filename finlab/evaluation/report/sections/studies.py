"""Time per call, temperature and training: one table and one picture each."""

from collections.abc import Mapping, Sequence
from typing import Any

from finlab.allocation.learned.settings import STEPS
from finlab.evaluation.experiments.first_answers import N_FINS
from finlab.evaluation.experiments.temperature import PAPER_TEMPERATURE
from finlab.evaluation.experiments.training_study import CHANGES
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.plots.studies import figure_a, latency_dots, training_bars
from finlab.evaluation.report.document import Block, Column, Figure, Fold, Row, Table, method_row, printed_row
from finlab.evaluation.report.numbers import three
from finlab.evaluation.statistics.records import Columns


def latency_blocks(rows: Sequence[Row], fins: int = 4) -> list[Block]:
    """Methods side by side in one run."""
    paper_ms = paper_figures()["inference"]["cycle_s"] * 1e3
    printed = printed_row("paper's cycle, printed (its robot has a Jetson Orin Nano)", {"p50_ms": paper_ms})
    columns = (
        Column("method", "method"),
        Column("calls", "calls", "count"),
        Column("p50_ms", "median [ms]", "three", "p50_ms_interval"),
        Column("p99_ms", "99th percentile [ms]", "three"),
        Column("p50_over_search", "times that of search", "three"),
    )
    return [
        "## Time per call",
        (
            f"Whole calls of `allocate`, one target each, {fins} fins, one after the other in one run; a "
            "report runs no other part meanwhile. `trf`, `slsqp` and `ipopt` start from 8 points."
        ),
        Figure(
            "latency",
            lambda: latency_dots(rows, paper_ms),
            "Dots are medians, bars end at the 99th percentile.",
        ),
        Table(columns, [*map(method_row, rows), printed]),
    ]


def first_answer_blocks(rows: Sequence[Row]) -> list[Block]:
    """Robots with fins that were not compiled before."""
    columns = (
        Column("fins", "fins", "code"),
        Column("new_models", "new models on the robot", "count"),
        Column("robots", "robots", "count"),
        Column("first_ms", "first answer [ms]", "three"),
        Column("again_ms", "another robot, same fins [ms]", "three"),
    )
    return [
        "## Fins never seen",
        (
            "A fin is compiled once, whatever its law, and kept by content: the first call of a robot with "
            f"{N_FINS} new fins, and the first call of another robot with the same fins, by method `search`. "
            "The slowest robot, in the processor's time."
        ),
        Table(columns, rows),
    ]


def temperature_blocks(rows: Sequence[Row], scatter: Columns = {}, candidates: int = 64) -> list[Block]:  # noqa: B006 - never changed
    """The paper's figure A; candidates before and after refinement for the picture."""
    best = min(rows, key=lambda row: row["best_j_mean"])
    widest = max(rows, key=lambda row: row["diversity"])
    lows, highs = zip(*(row["best_j_mean_interval"] for row in rows), strict=True)
    apart = (
        "intervals of some temperatures do not overlap"
        if max(lows) > min(highs)
        else ("the intervals of all temperatures overlap")
    )
    columns = (
        Column("temperature", "T", "three"),
        Column("n", "targets", "count"),
        Column("diversity", "diversity", "three"),
        Column("best_j_mean", "best J, mean", "error", "best_j_mean_interval"),
        Column("best_j_median", "median", "error"),
    )
    return [
        "## Temperature",
        (
            "Figure A of the paper, for the network of the checkpoint `paper`. The paper says that diversity "
            "grows with T throughout, and that the best cost is least at a T in between (it uses "
            f"{PAPER_TEMPERATURE}). Here diversity is largest at T = {three(widest['temperature'])}; the "
            f"mean of the best cost among {candidates} candidates is lowest at T = "
            f"{three(best['temperature'])}, and {apart}. Diversity, which the paper does not "
            "define, is the mean distance between two candidates in units of the command ranges; J is "
            "squared error plus weighted energy, by the surrogate, before refinement."
        ),
        Figure(
            "figure-a",
            lambda: figure_a(rows, scatter, PAPER_TEMPERATURE),
            "Left and middle: what the temperature does; dashes mark the paper's choice, the band is where "
            "a rerun lands. Right: all 64 candidates for one target on a robot of four fins, as drawn and "
            f"after {STEPS['adam']} steps of Adam.",
        ),
        Fold("The numbers", (Table(columns, rows),)),
    ]


def training_blocks(rows: Sequence[Row], settings: Mapping[str, Any]) -> list[Block]:
    """Small trainings with one thing changed; settings as in `training_jobs`."""
    columns = (
        Column("title", "what is changed"),
        Column("err_norm_mean", "best raw candidate", "error", "err_norm_mean_interval"),
        Column("refined_err_norm_mean", "after 4 steps", "error", "refined_err_norm_mean_interval"),
        Column("refined_success_0.01", "within 0.01", "share"),
        Column("refined_energy_mean", "energy", "three"),
        Column("train_s", "training [s]", "three"),
    )
    titles = {name: change.title for name, change in CHANGES.items()}
    return [
        "## What the parts of the training bring",
        (
            f"Trainings of {settings['steps']} steps of {settings['batch_size']} samples each (preset "
            f"`{settings['preset']}`), one thing changed at a time. Such budgets are far below that of the "
            "shipped network, and with more steps the order may be another one. The same surrogate ranks "
            "and refines in all of them; the plant, fins of the law `drag`, scores. Nothing here concerns "
            "`search`, which learns nothing."
        ),
        Figure("training", lambda: training_bars(rows, titles), "Mean error with the interval of a rerun."),
        Table(columns, [{**row, "title": titles[row["change"]]} for row in rows]),
    ]
