"""`finlab eval ...`: every verb that measures methods against the analytic fin model.

Here are `training` and `report`, which are made of many jobs that are kept in a folder.
"""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

from finlab.cli import (
    eval_allocation,
    eval_closed_loop,
    eval_fit,
    eval_reach,
    eval_robots,
    eval_sequences,
    eval_swims,
)
from finlab.cli.eval_arguments import Checkpoint, Count, Folder, Name, Names, Output, check_folders
from finlab.cli.eval_verb import add_experiments
from finlab.cli.inputs import check_positive
from finlab.evaluation.report.sizes import SEED

OUTPUT = Output()


def training(
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")] = Path("runs/training-study"),
    preset: Name = "paper",
    steps: Count = 600,
    batch_size: Count = 256,
    layouts: Count = 40,
    targets: Count = 25,
    seed: Count = 0,
    output: Annotated[Output, arg(name="")] = OUTPUT,
) -> None:
    """What each part of the training brings: small trainings on equal budgets, one thing changed at a time.

    What is done is kept in the folder; a study that was stopped goes on where it was.

    Args:
        out: folder for trainings and records.
        preset: recipe that is changed: paper or smoke.
        steps: optimizer steps of each training.
        batch_size: samples per step.
        layouts: layouts of split id on which the networks are tried.
        targets: targets on each layout.
        seed: draws data, weights, layouts and targets.
    """
    from finlab.evaluation.experiments.training_study import training_row
    from finlab.evaluation.report.jobs import run_jobs
    from finlab.evaluation.report.plan import training_jobs
    from finlab.evaluation.report.provenance import source_commit
    from finlab.evaluation.report.sections.studies import training_blocks
    from finlab.evaluation.splits import make_split
    from finlab.training.presets import PAPER_RECIPES, get_recipe

    check_positive(steps=steps, batch_size=batch_size)
    check_folders(out=out)
    get_recipe(PAPER_RECIPES, preset)
    make_split("id", layouts, targets, seed)
    settings = {"preset": preset, "steps": steps, "batch_size": batch_size}
    settings |= {"layouts": layouts, "targets": targets, "seed": seed}
    jobs = training_jobs(settings, out)
    run_jobs(list(jobs.values()), out, commit=source_commit(), processes=0)
    rows = [training_row(change, job.result(out)[0]) for (change,), job in jobs.items()]
    output.show(*training_blocks(rows, settings), rows=rows)


def report(
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    quick: bool = False,
    seed: Count = SEED,
    checkpoint: Checkpoint = None,
    paper_checkpoint: Checkpoint = None,
    records: Folder = None,
    processes: Annotated[int | None, arg(metavar="N")] = None,
    sections: Names = "all",
    as_is: bool = False,
) -> None:
    """Make the whole evaluation: one HTML page, its Markdown twin, pictures and rows.

    A report that was stopped goes on where it was: each part is kept with its settings and the fingerprint of
    the weights.

    Args:
        out: folder for the page.
        quick: a look on few cases, in three minutes; the full size takes an hour on two cores.
        seed: draws layouts, targets and candidates.
        checkpoint: trained checkpoint of method mdn; the shipped one by default.
        paper_checkpoint: trained checkpoint of method paper; the shipped one by default.
        records: folder for the records; DIR/records by default.
        processes: parts that run at once; the number of cores by default.
        sections: run only some: wrench, cost, network, modes, unreachable, beyond, steadiness, sequences,
            latency, closed-loop, hard-days, slow-days (the hard days with sqp, multistart and paper: five
            hours of the processor, no part of all), ablation, temperature, training; the page shows what is
            there of all.
        as_is: do no work; make the page from what is there.
    """
    from finlab.evaluation.method_specs import Checkpoints
    from finlab.evaluation.report.make import make_report
    from finlab.evaluation.report.plan import parse_sections
    from finlab.evaluation.report.sizes import SIZES

    check_positive(processes=processes)
    chosen = [] if as_is else parse_sections(sections)
    check_folders(out=out, records=records)
    words = ["finlab", "eval", "report", "-o", str(out), *(["--quick"] if quick else [])]
    words += ["--seed", str(seed)] if seed != SEED else []
    words += ["--checkpoint", checkpoint] if checkpoint else []
    words += ["--paper-checkpoint", paper_checkpoint] if paper_checkpoint else []
    page = make_report(
        out,
        sizes=SIZES["quick" if quick else "full"],
        seed=seed,
        checkpoints=Checkpoints(checkpoint, paper_checkpoint),
        records=records or out / "records",
        command=shlex.join(words),
        processes=processes,
        sections=chosen,
    )
    print(page)


OTHERS = (
    eval_allocation.cost,
    eval_allocation.network,
    eval_allocation.ablation,
    eval_allocation.temperature,
    eval_allocation.latency,
    eval_allocation.modes,
    eval_reach.unreachable,
    eval_reach.beyond,
    eval_sequences.steadiness,
    eval_sequences.sequences,
    eval_allocation.fuzz,
    eval_closed_loop.trajectory,
    eval_closed_loop.faults,
    eval_closed_loop.velocity,
    eval_closed_loop.monitor,
    eval_swims.swims,
    eval_fit.fit,
    eval_robots.robots,
    training,
    report,
)
"""Verbs that are no experiment yet, and the report."""


def verbs(argv: Sequence[str]) -> SubcommandApp:
    """All verbs of `finlab eval`, from the arguments after `finlab`."""
    found = SubcommandApp()
    known = add_experiments(found, argv)
    for verb in OTHERS:
        if verb.__name__ not in known:
            found.command(verb)
    return found
