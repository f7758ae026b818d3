"""How long one call takes: methods one after the other in one run, and first answers for fins never seen.

A fin is compiled once, whatever its law, and kept by content: the first call of a robot with new fins pays
for compiling them.
"""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from finlab.errors import DataError
from finlab.evaluation.experiment import Experiment
from finlab.evaluation.method_specs import MethodSpec, load_method_spec, load_method_specs
from finlab.evaluation.noisy_tables import noisy_table
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.evaluation.splits import Case, make_split
from finlab.layout import Fin, Layout, load_layout, random_layout
from finlab.layout.random_fins import FAMILIES, random_fin_model

DOMAIN = 0xF1257
"""Leads the seed of every robot with new fins."""
REFERENCE = "dual"
"""The method that the others are compared with, where it takes part."""
LAYOUTS = 5
"""Layouts whose calls are timed."""
WARM_UP = 2
"""First calls on each layout that are not counted; a robot keeps its layout for long."""
NEW_FINS = 4
"""Fins of a robot with new fins, each with a model of its own."""
KINDS = (*FAMILIES, "table")
"""Models of new fins; a table is one of a random fin, with noise."""
SMALL = np.array([0.02, 0.02, 0.02, 0.002, 0.002, 0.002])
"""Size of their targets [N, N m], within reach of the weakest fins."""


def run(
    methods: tuple[str, ...] = ("dual", "mdn", "paper", "analytic", "qp", "sqp"),
    fins: int = 4,
    calls: int = 200,
    budget: float = 20.0,
    robots: int = 3,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each method, and one for the first answers of `dual` on each kind of new fins.

    Args:
        methods: names as in eval wrench; ipopt needs its extra.
        fins: of the layouts, 2 to 5.
        calls: of each method.
        budget: seconds after which a slow method stops.
        robots: with new fins, of each kind of fin.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of layouts and targets.
    """
    if not 2 <= fins <= 5:
        raise DataError(f"fins: expected 2 to 5, the fin counts of split id, got {fins}")
    cases = [case for case in make_split("id", 100, 50, seed) if case.layout.n_fins == fins][:LAYOUTS]
    rows: list[Row] = []
    for name, method in progress(load_method_specs(methods, checkpoint).items(), "method"):
        times = call_times(method, cases, calls, budget)
        rows.append(_row(name, "same fins as before", times))
    reference = next((row["p50_ms"] for row in rows if row["method"] == REFERENCE), None)
    for row in rows:
        row["p50_over_dual"] = None if reference is None else row["p50_ms"] / reference
    ours = load_method_spec(REFERENCE, checkpoint)
    ours.on(load_layout("A")).allocate(np.zeros(6))  # what a process does once is not the fins' doing
    return rows + [
        _row(
            REFERENCE,
            f"first answer, {NEW_FINS} new fins: {kind}",
            first_times(ours, kind, robots, seed),
        )
        for kind in progress(KINDS, "kind of fin")
    ]


def _row(method: str, what: str, times: Sequence[float]) -> Row:
    low, middle, high = (float(np.quantile(times, q)) for q in (0.05, 0.5, 0.99))
    return {
        "method": method,
        "call": what,
        "calls": len(times),
        "p5_ms": low,
        "p50_ms": middle,
        "p99_ms": high,
    }


def call_times(method: MethodSpec, cases: Sequence[Case], n_calls: int, budget_s: float) -> list[float]:
    """Wall time of each counted call [ms], of layouts visited one after the other.

    Args:
        method: who answers.
        cases: layouts with targets.
        n_calls: at most so many.
        budget_s: no further call on a layout after its part of this time [s].
    """
    times: list[float] = []
    per_case = -(-n_calls // len(cases))
    for case in cases:
        allocator, begin = method.on(case.layout), time.perf_counter()
        for k in range(WARM_UP + min(per_case, n_calls - len(times))):
            start = time.perf_counter()
            allocator.allocate(case.targets[k % len(case.targets)], failed=case.failed)
            end = time.perf_counter()
            if k >= WARM_UP:
                times.append((end - start) * 1e3)
                if end - begin > budget_s / len(cases):
                    break
        if len(times) >= n_calls:
            break
    return times


def first_times(method: MethodSpec, kind: str, robots: int, seed: int) -> list[float]:
    """The processor's time [ms] of the first call of robots with fins of a kind that were not seen before."""
    times = []
    for k in range(robots):
        rng = np.random.default_rng([DOMAIN, seed, KINDS.index(kind), k])
        layout = _robot_of_new_fins(rng, kind, f"{seed}-{k}")
        target = SMALL * rng.standard_normal(6)
        start = time.process_time()
        method.on(layout).allocate(target)
        times.append(1e3 * (time.process_time() - start))
    return times


def _robot_of_new_fins(rng: np.random.Generator, kind: str, name: str) -> Layout:
    layout, fins = random_layout(rng, n_fins=NEW_FINS), []
    for i, old in enumerate(layout.fins):
        fin = Fin("new", (0.0, 0.0, 0.0), 0.0, model=random_fin_model(rng, None if kind == "table" else kind))
        if kind == "table":
            fin = noisy_table(rng, fin, f"first-answer-{name}-{i}")
        fins.append(replace(old, model=fin.model))
    return replace(layout, actuators=tuple(fins))


def _printed(rows: Sequence[Row]) -> list[Row]:
    cycle_ms = paper_figures()["inference"]["cycle_s"] * 1e3
    return [
        {"method": "paper", "call": "cycle on a Jetson Orin Nano, printed in the paper", "p50_ms": cycle_ms}
    ]


experiment = Experiment(
    name="latency",
    question="How long does one call take?",
    columns=(
        Column("method", "method", "code"),
        Column("call", "call"),
        Column("calls", "calls", "count"),
        Column("p50_ms", "median", "three", unit="ms"),
        Column("p99_ms", "99th percentile", "three", unit="ms"),
        Column("p50_over_dual", "times that of dual", "three"),
    ),
    run=run,
    note=(
        "Whole calls of allocate, one target each, one after the other; a report runs nothing beside them. "
        "First answers in the processor's time: a fin is compiled once, whatever its law, and kept by "
        "content."
    ),
    quick={"calls": 20, "budget": 1.0, "robots": 1},
    full={"robots": 2},
    timed=True,
    printed=_printed,
)
