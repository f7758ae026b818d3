"""`finlab eval report`: run what is missing, then write the page, its Markdown twin and the pictures."""

import json
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

from finlab.allocation.learned.settings import MdnSettings
from finlab.evaluation.method_specs import Checkpoints
from finlab.evaluation.report.document import Block, Document, figures_of
from finlab.evaluation.report.jobs import run_jobs
from finlab.evaluation.report.pages import to_html, to_markdown
from finlab.evaluation.report.plan import N_STARTS, SWIMMERS, make_plan, parse_sections
from finlab.evaluation.report.provenance import Provenance, how_made_blocks, source_commit
from finlab.evaluation.report.results import Results
from finlab.evaluation.report.sections import (
    ablation,
    closed_loop,
    cost,
    methods,
    network,
    questions,
    scope,
    studies,
    summary,
    swims,
    wrench_tracking,
)
from finlab.evaluation.report.sizes import Sizes
from finlab.evaluation.statistics.tables import Row
from finlab.inference.checkpoint import read_checkpoint, resolve_checkpoint

PAGE, TWIN, TABLES, PICTURES = "index.html", "report.md", "tables.json", "pictures"
"""What a report's folder holds."""


def make_report(
    out: Path,
    *,
    sizes: Sizes,
    seed: int,
    checkpoints: Checkpoints,
    records: Path,
    command: str,
    processes: int | None = None,
    sections: Collection[str] = tuple(parse_sections("all")),
) -> Path:
    """Make the whole report; parts that are done are taken from `records`.

    Args:
        out: folder for the page; made if need be.
        sizes: how much of everything.
        seed: of all draws.
        checkpoints: under test.
        records: folder of the results of the parts.
        command: that makes the report, shown on the page.
        processes: parts that run at once; the number of cores by default.
        sections: those whose missing parts are run, by default all but the optional ones; the page shows what
            is there of all.

    Returns:
        The page.
    """
    plan = make_plan(sizes, seed=seed, checkpoints=checkpoints, runs=records / "trainings")
    run_jobs(list(plan.only(sections)), records, commit=source_commit(), processes=processes)
    done = plan.only_done(records)
    given = {"mdn": checkpoints.default or "default", "paper": checkpoints.paper or "paper"}
    paths = {method: resolve_checkpoint(checkpoint) for method, checkpoint in given.items()}
    prints = {f"{path.name} ({name})": read_checkpoint(path).sha256 for name, path in paths.items()}
    results, provenance = Results(done, records), Provenance(prints, seed, command)
    missing = sum(not job.done(records) for job in plan.only(parse_sections("all")))
    document = make_document(results, provenance, sizes, missing)
    write_report(out, document, provenance.about() | results.tables)
    return out / PAGE


def make_document(results: Results, provenance: Provenance, sizes: Sizes, missing: int = 0) -> Document:
    """The page's blocks, from results; so many jobs have none yet."""
    cards, *standings = summary.summary_blocks(results.tables)
    blocks: list[Block] = [cards, *scope.scope_blocks(provenance.seed), *standings, *methods.method_blocks()]
    blocks += result_blocks(results, sizes)
    blocks += how_made_blocks(results, provenance, sizes)
    note = "" if sizes.name == "full" else f" A {sizes.name} look on few cases; intervals are wide."
    note += f" Not run yet when this page was made: {missing} of its parts." if missing else ""
    subtitle = (
        "Control allocation for robots with fins: the exact search, the same search from a network's "
        "proposals, the paper's method and seven others, every answer scored by the fins' own models."
        f"{note}"
    )
    return Document("finlab evaluation", subtitle, tuple(blocks))


def result_blocks(results: Results, sizes: Sizes) -> list[Block]:
    """Every table that has run, from top to bottom."""
    tables = results.tables
    makers: dict[str, Callable[[Sequence[Row]], list[Block]]] = {
        "wrench": lambda _: wrench_tracking.accuracy_blocks(results),
        "cost": lambda rows: cost.cost_blocks(rows, N_STARTS),
        "network": lambda rows: network.network_blocks(rows, MdnSettings().n_candidates),
        "modes": lambda rows: questions.mode_blocks(rows, sizes.of_table["modes"]["starts"]),
        "unreachable": questions.unreachable_blocks,
        "beyond": questions.beyond_blocks,
        "steadiness": questions.steadiness_blocks,
        "sequences": questions.sequence_blocks,
        "latency": studies.latency_blocks,
        "first_answers": studies.first_answer_blocks,
        "trajectory": lambda rows: closed_loop.trajectory_blocks(rows, results.tracks),
        "faults": closed_loop.fault_blocks,
        "velocity": closed_loop.velocity_blocks,
        "swims": swims.day_blocks,
        "slow_swims": lambda rows: swims.slow_day_blocks(tables.get("swims", ()), rows),
        "ablation": ablation.ablation_blocks,
        "temperature": lambda rows: studies.temperature_blocks(rows, results.scatter),
        "training": lambda rows: studies.training_blocks(rows, sizes.of_table["training"]),
    }
    blocks: list[Block] = []
    for table, make in makers.items():
        if table in tables:
            if table in (*SWIMMERS, "swims", "slow_swims") and closed_loop.INTRODUCTION[0] not in blocks:
                blocks += closed_loop.INTRODUCTION
            blocks += make(tables[table])
    return blocks


def write_report(out: Path, document: Document, tables: dict[str, Any]) -> None:
    """Page, twin, pictures and rows."""
    pictures = out / PICTURES
    pictures.mkdir(parents=True, exist_ok=True)
    for figure in figures_of(document.blocks):
        (pictures / f"{figure.name}.svg").write_text(figure.svg, "utf-8")
    (out / PAGE).write_text(to_html(document), "utf-8")
    (out / TWIN).write_text(to_markdown(document, PICTURES), "utf-8")
    (out / TABLES).write_text(json.dumps(tables, indent=1) + "\n", "utf-8")
