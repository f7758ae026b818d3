"""`finlab eval wrench|seeds|ablation|latency`: measure methods against the analytic fin model."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

from finlab.cli.eval_arguments import (
    Checkpoint,
    Count,
    Folder,
    JsonFile,
    Methods,
    Split,
    check_folder,
    check_positive,
    check_writable,
    load_methods,
    write_json,
)

verbs = SubcommandApp()

LATENCY_LAYOUTS = 5
"""Layouts whose calls are timed."""


SUBSAMPLE = 10
"""Targets of each layout that methods of a tenth of a second solve unless told otherwise."""


@verbs.command
def wrench(
    split: Split = "id",
    layouts: Count = 100,
    targets: Count = 1000,
    methods: Methods = "learned,paper",
    seed: Count = 0,
    single: Annotated[int | None, arg(metavar="N")] = None,
    subsample: Count = SUBSAMPLE,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
    records: Folder = None,
) -> None:
    """Track reachable wrenches on held-out layouts; error, energy and time of each method.

    Args:
        split: id, ood, ood-fins, limits, failure, near-singular, or all of them.
        layouts: layouts of the split.
        targets: targets on each layout.
        methods: names with commas between: learned, paper, qp, sqp, analytic, multistart, trf, slsqp, ipopt;
            a number of starts may follow the last three, as in ipopt-32.
        seed: draws layouts and targets; same numbers, same cases.
        single: solve only the first N targets of each layout, one call each, and time the calls.
        subsample: trf, slsqp and ipopt solve only the first N targets of each layout; column n says how many.
        checkpoint: trained checkpoint; the shipped one of each method by default.
        json: file for the rows.
        records: folder for the records, one NPZ file for each split and method.
    """
    from finlab.evaluation.experiments.wrench_tracking import (
        energy_comparison,
        interval_rows,
        run_method,
        wrench_report,
        wrench_rows,
    )
    from finlab.evaluation.method_specs import is_slow
    from finlab.evaluation.splits import SPLITS, make_split
    from finlab.evaluation.statistics.records import columns_of_records, save_columns

    for name, value in (("single", single), ("subsample", subsample)):
        check_positive(name, value)
    check_writable(json)
    check_folder("records", records)
    allocators = load_methods(methods, checkpoint)
    rows, intervals, energies = [], [], []
    for k, part in enumerate(SPLITS if split == "all" else (split,)):
        cases = make_split(part, layouts, targets, seed)
        found = {
            name: run_method(allocator, cases, single=single, first=subsample if is_slow(name) else None)
            for name, allocator in allocators.items()
        }
        if records is not None:
            settings = {"split": part, "layouts": layouts, "targets": targets, "seed": seed}
            for name, each in found.items():
                made = {**settings, "method": name, "checkpoint": allocators[name].checkpoint}
                save_columns(records / f"wrench-{part}-{name}.npz", columns_of_records(each), made)
        rows += wrench_rows(found, part)
        intervals += interval_rows(found, part)
        energies += [{"split": part, **row} for row in energy_comparison(found)]
        print(("\n" if k else "") + wrench_report(found, part, single=single))
    write_json(json, {"rows": rows, "intervals": intervals, "energies": energies})


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
    from finlab.allocation.learned.learned_allocator import LearnedAllocator
    from finlab.evaluation.experiments.seeds import seed_report, seed_rows
    from finlab.evaluation.splits import make_split

    check_positive("candidates", candidates)
    check_writable(json)
    allocator = load_methods("learned", checkpoint)["learned"]
    assert isinstance(allocator, LearnedAllocator)
    rows = seed_rows(allocator, make_split(split, layouts, targets, seed), n_seeds=candidates, seed=seed)
    write_json(json, {"rows": rows})
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
    from finlab.evaluation.experiments.ablation import ablation_report, ablation_rows
    from finlab.evaluation.splits import make_split

    check_writable(json)
    cases = make_split(split, layouts, targets, seed)
    rows = ablation_rows(
        cases, checkpoint=checkpoint, n_candidates=candidates, temperature=temperature, seed=seed
    )
    write_json(json, {"rows": rows})
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
    from finlab.evaluation.experiments.latency import latency_report, latency_rows, machine
    from finlab.evaluation.splits import make_split

    check_positive("calls", calls)
    check_writable(json)
    if not 2 <= fins <= 5:
        raise DataError(f"fins: expected 2 to 5, the fin counts of split id, got {fins}")
    cases = [case for case in make_split("id", 100, 50, seed) if case.layout.n_fins == fins]
    rows = latency_rows(
        load_methods(methods, checkpoint), cases[:LATENCY_LAYOUTS], n_calls=calls, budget_s=budget
    )
    described = machine()
    write_json(json, {"rows": rows, "machine": described})
    print(latency_report(rows, described))
