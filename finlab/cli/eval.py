"""`finlab eval wrench|seeds|ablation|latency`: measure methods against the analytic fin model."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import arg
from tyro.extras import SubcommandApp

if TYPE_CHECKING:
    from finlab.allocation import Allocator

verbs = SubcommandApp()

Count = Annotated[int, arg(metavar="N")]
Split = Annotated[str, arg(metavar="NAME")]
Methods = Annotated[str, arg(metavar="A,B,...")]
Checkpoint = Annotated[str | None, arg(metavar="NAME|FOLDER")]
JsonFile = Annotated[Path | None, arg(metavar="FILE")]

LATENCY_LAYOUTS = 5
"""Layouts whose calls are timed."""


@verbs.command
def wrench(
    split: Split = "id",
    layouts: Count = 100,
    targets: Count = 1000,
    methods: Methods = "learned,paper",
    seed: Count = 0,
    single: Annotated[int | None, arg(metavar="N")] = None,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
) -> None:
    """Track reachable wrenches on held-out layouts; error, energy and time of each method.

    Args:
        split: id, ood, ood-fins, limits, failure or near-singular.
        layouts: layouts of the split.
        targets: targets on each layout.
        methods: names with commas between: learned, paper, qp, sqp, analytic, multistart, trf, slsqp, ipopt.
        seed: draws layouts and targets; same numbers, same cases.
        single: solve only the first N targets of each layout, one call each, and time the calls.
        checkpoint: trained checkpoint; the shipped one of each method by default.
        json: file for the rows.
    """
    from finlab.evaluation.splits import make_split
    from finlab.evaluation.wrench import run_method, wrench_report, wrench_rows

    _check_positive("single", single)
    _check_writable(json)
    cases = make_split(split, layouts, targets, seed)
    records = {
        name: run_method(allocator, cases, single=single)
        for name, allocator in _load(methods, checkpoint).items()
    }
    _write(json, {"rows": wrench_rows(records, split)})
    print(wrench_report(records, split, single=single))


@verbs.command
def seeds(
    split: Split = "id",
    layouts: Count = 40,
    targets: Count = 25,
    candidates: Count = 16,
    seed: Count = 0,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
) -> None:
    """What learning buys: the network's seeds against random ones, at equal numbers and refinement steps.

    Args:
        split: id, ood, ood-fins, limits, failure or near-singular.
        layouts: layouts of the split.
        targets: targets on each layout.
        candidates: seeds per target, of every kind.
        seed: draws layouts, targets and seeds.
        checkpoint: trained checkpoint; the shipped one by default.
        json: file for the rows.
    """
    from finlab.allocation.learned import LearnedAllocator
    from finlab.evaluation.seeds import seed_report, seed_rows
    from finlab.evaluation.splits import make_split

    _check_positive("candidates", candidates)
    _check_writable(json)
    allocator = _load("learned", checkpoint)["learned"]
    assert isinstance(allocator, LearnedAllocator)
    rows = seed_rows(allocator, make_split(split, layouts, targets, seed), n_seeds=candidates, seed=seed)
    _write(json, {"rows": rows})
    print(seed_report(rows, candidates))


@verbs.command
def ablation(
    split: Split = "id",
    layouts: Count = 20,
    targets: Count = 100,
    candidates: Count = 64,
    temperature: Annotated[float, arg(metavar="T")] = 0.02,
    seed: Count = 0,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
) -> None:
    """Change one stage of the paper's pipeline at a time; scored by its surrogate and by the plant.

    Args:
        split: id, ood, ood-fins, limits, failure or near-singular.
        layouts: layouts of the split.
        targets: targets on each layout.
        candidates: candidates drawn per target.
        temperature: of the draw.
        seed: draws layouts and targets; same numbers, same cases.
        checkpoint: trained checkpoint of method paper; the shipped one by default.
        json: file for the rows.
    """
    from finlab.evaluation.ablation import ablation_report, ablation_rows
    from finlab.evaluation.splits import make_split

    _check_writable(json)
    cases = make_split(split, layouts, targets, seed)
    rows = ablation_rows(cases, checkpoint=checkpoint, n_candidates=candidates, temperature=temperature)
    _write(json, {"rows": rows})
    print(ablation_report(rows))


@verbs.command
def latency(
    methods: Methods = "learned,paper,analytic,qp,sqp,multistart,trf,slsqp",
    fins: Count = 4,
    calls: Count = 200,
    budget: Annotated[float, arg(metavar="SECONDS")] = 20.0,
    seed: Count = 0,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
) -> None:
    """Time single calls of methods side by side in one run.

    Args:
        methods: names with commas between; ipopt needs its extra.
        fins: fins of the layouts, 2 to 5.
        calls: calls of each method.
        budget: a slow method stops after this long.
        seed: draws layouts and targets.
        checkpoint: trained checkpoint; the shipped one of each method by default.
        json: file for the rows and the machine.
    """
    from finlab.errors import DataError
    from finlab.evaluation.latency import latency_report, latency_rows, machine
    from finlab.evaluation.splits import make_split

    _check_positive("calls", calls)
    _check_writable(json)
    if not 2 <= fins <= 5:
        raise DataError(f"fins: expected 2 to 5, the fin counts of split id, got {fins}")
    cases = [case for case in make_split("id", 100, 50, seed) if case.layout.n_fins == fins]
    rows = latency_rows(_load(methods, checkpoint), cases[:LATENCY_LAYOUTS], n_calls=calls, budget_s=budget)
    described = machine()
    _write(json, {"rows": rows, "machine": described})
    print(latency_report(rows, described))


def _load(methods: str, checkpoint: str | None) -> dict[str, Allocator]:
    """All methods, loaded before the first one runs so that a wrong name costs no time."""
    from finlab.allocation import load_allocator
    from finlab.errors import AllocationError

    names = list(dict.fromkeys(name.strip() for name in methods.split(",") if name.strip()))
    if not names:
        raise AllocationError(f"methods: expected names with commas between (learned,paper), got {methods!r}")
    return {name: load_allocator(checkpoint, name) for name in names}


def _check_positive(name: str, value: int | None) -> None:
    from finlab.errors import DataError

    if value is not None and value < 1:
        raise DataError(f"{name}: expected a number of at least 1, got {value}")


def _check_writable(path: Path | None) -> None:
    """Refuse a file that cannot be written before the work, not after."""
    from finlab.errors import DataError

    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise DataError(f"json: expected a file in an existing folder, got {path}")


def _write(path: Path | None, content: dict[str, Any]) -> None:
    if path is not None:
        path.write_text(json_format.dumps(content, indent=1, allow_nan=False) + "\n", "utf-8")
