"""`finlab eval report`: run what is missing, then write the page, its Markdown twin and the pictures."""

import json
from pathlib import Path
from typing import Any

from finlab.evaluation.method_specs import Checkpoints
from finlab.evaluation.report.document import Block, Document, figures_of
from finlab.evaluation.report.jobs import run_jobs
from finlab.evaluation.report.pages import to_html, to_markdown
from finlab.evaluation.report.plan import make_plan
from finlab.evaluation.report.provenance import Provenance, how_made_blocks, source_commit
from finlab.evaluation.report.results import Results
from finlab.evaluation.report.sections import closed_loop, cost, studies, summary, wrench_tracking
from finlab.evaluation.report.sizes import Sizes
from finlab.inference.checkpoint import read_checkpoint, resolve_checkpoint

PAGE, TWIN, TABLES, PICTURES = "index.html", "report.md", "tables.json", "pictures"
"""What a report's folder holds."""
CLOSED_LOOP = {"trajectory", "faults", "velocity"}
"""Tables of the experiments in closed loop."""


def make_report(
    out: Path,
    *,
    sizes: Sizes,
    seed: int,
    checkpoints: Checkpoints,
    records: Path,
    command: str,
    processes: int | None = None,
    as_is: bool = False,
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
        as_is: do no work; show what is there.

    Returns:
        The page.
    """
    plan = make_plan(sizes, seed=seed, checkpoints=checkpoints, runs=records / "trainings")
    n_parts = len(list(plan))
    if as_is:
        plan = plan.only_done(records)
    else:
        run_jobs(list(plan), records, commit=source_commit(), processes=processes)
    left_out = n_parts - len(list(plan))
    given = {"mdn": checkpoints.default or "default", "paper": checkpoints.paper or "paper"}
    paths = {method: resolve_checkpoint(checkpoint) for method, checkpoint in given.items()}
    prints = {f"{path.name} ({name})": read_checkpoint(path).sha256 for name, path in paths.items()}
    results = Results(plan, records)
    provenance = Provenance(prints, seed, command)
    write_report(out, make_document(results, provenance, sizes, left_out), tables_of(results, provenance))
    return out / PAGE


def make_document(results: Results, provenance: Provenance, sizes: Sizes, left_out: int = 0) -> Document:
    """The page's blocks, from results; `left_out` parts have none yet."""
    tables = results.tables
    sections = (
        (summary.summary_blocks, True),
        (wrench_tracking.accuracy_blocks, results.wrench),
        (cost.cost_blocks, results.cost_rows),
        (studies.latency_blocks, "latency" in tables),
        (closed_loop.closed_loop_blocks, CLOSED_LOOP & tables.keys()),
        (studies.ablation_blocks, results.ablation_rows),
        (studies.temperature_blocks, results.temperature_rows and results.plan.scatter),
        (studies.training_blocks, results.training_rows),
    )
    blocks: list[Block] = [block for section, has_run in sections if has_run for block in section(results)]
    blocks += how_made_blocks(results, provenance, sizes)
    note = "" if sizes.name == "full" else f" A {sizes.name} look on few cases; intervals are wide."
    note += f" {left_out} parts had not been run when this page was made." if left_out else ""
    subtitle = (
        "Control allocation for robots with fins: the exact search, the same search from a network's "
        "proposals, the paper's method and seven others, every answer scored by the fins' own models."
        f"{note}"
    )
    return Document("finlab evaluation", subtitle, tuple(blocks))


def tables_of(results: Results, provenance: Provenance) -> dict[str, Any]:
    """Every table as rows, for scripts."""
    return {
        "commit": provenance.commit,
        "checkpoints": provenance.checkpoints,
        "seed": provenance.seed,
        "machine": provenance.machine,
        "wrench": [row for rows in results.wrench_rows.values() for row in rows],
        "cost": results.cost_rows,
        "latency": results.tables.get("latency", []),
        "closed_loop": {name: rows for name, rows in results.tables.items() if name in CLOSED_LOOP},
        "ablation": results.ablation_rows,
        "temperature": results.temperature_rows,
        "training": results.training_rows,
    }


def write_report(out: Path, document: Document, tables: dict[str, Any]) -> None:
    """Page, twin, pictures and rows."""
    pictures = out / PICTURES
    pictures.mkdir(parents=True, exist_ok=True)
    for figure in figures_of(document.blocks):
        (pictures / f"{figure.name}.svg").write_text(figure.svg, "utf-8")
    (out / PAGE).write_text(to_html(document), "utf-8")
    (out / TWIN).write_text(to_markdown(document, PICTURES), "utf-8")
    (out / TABLES).write_text(json.dumps(tables, indent=1) + "\n", "utf-8")
