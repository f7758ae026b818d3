"""`finlab eval report`: run what is missing, then write the page, its pictures and the rows."""

import json
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

from finlab.errors import DataError
from finlab.evaluation.experiment import EXPERIMENTS, Experiment, load_experiment
from finlab.evaluation.report.document import Block, Document, Figure, Row
from finlab.evaluation.report.jobs import THREADS, Part, run_parts
from finlab.evaluation.report.markdown import to_markdown
from finlab.evaluation.report.provenance import machine, source_commit, source_digest
from finlab.whole_file import write_whole

PAGE, TABLES, PICTURES = "report.md", "tables.json", "pictures"
"""What a report's folder holds, beside `records`."""
SEED = 6143
"""Of a report, unless another one is given; kept apart from those on which methods were developed."""
DIGITS = 6
"""Significant digits of the numbers in `TABLES`."""
ABOUT = (
    "Every answer is scored by the plant: the fins' own laws or tables. All methods but `paper`, which has "
    "learned one fin law from samples, were given these, so errors show how well methods solve, not how "
    "well a model fits a fin in the water. No robot swam and no fin was measured for this report: fin laws "
    "are means over a cycle in still water, bodies, water and sensors are simulated. Methods and "
    f"controllers were developed on other seeds than {SEED}."
)
Size = Literal["quick", "full"]


def make_report(
    out: Path,
    *,
    size: Size = "full",
    seed: int = SEED,
    names: Sequence[str] = ("all",),
    processes: int | None = None,
) -> Path:
    """Make the report; parts that are done are taken from its folder `records`.

    Args:
        out: folder for the report, made if need be.
        size: how much of everything: minutes, or a quarter of an hour on two cores.
        seed: of all draws.
        names: experiments whose missing parts are run, or all; the page shows all that are complete.
        processes: parts that run at once; the number of cores by default, 0 for this process alone.

    Returns:
        The page.

    Raises:
        DataError: an unknown name, or a file that cannot be written.
    """
    if unknown := [name for name in names if name not in (*EXPERIMENTS, "all")]:
        raise DataError(f"sections: expected all or some of {', '.join(EXPERIMENTS)}, got {unknown[0]!r:.60}")
    digest, records = source_digest(), out / "records"
    plan = {name: plan_of(load_experiment(name), size, seed, digest) for name in EXPERIMENTS}
    wanted = EXPERIMENTS if "all" in names else names
    run_parts([part for name in wanted for part in plan[name]], records, processes=processes)
    complete = {name: parts for name, parts in plan.items() if parts and all(p.done(records) for p in parts)}
    rows = {name: [row for part in parts for row in part.rows(records)] for name, parts in complete.items()}
    seconds = sum(part.record(records)["seconds"] for parts in complete.values() for part in parts)
    command = f"finlab eval report -o {out}" + (" --quick" if size == "quick" else "")
    command += f" --seed {seed}" if seed != SEED else ""
    left = [name for name in EXPERIMENTS if name not in complete]
    document = make_document(rows, [*_how_made(command, seconds, seed), *_missing(left)], size)
    write_report(out, document, rows)
    return out / PAGE


def plan_of(experiment: Experiment, size: Size, seed: int, digest: str) -> list[Part]:
    """The parts of an experiment; none where a package that it needs is not installed."""
    if any(find_spec(package) is None for package in experiment.needs):
        return []
    chosen = dict(experiment.quick if size == "quick" else experiment.full)
    if "seed" in experiment.options():
        chosen["seed"] = seed
    return [Part(experiment.name, options, digest) for options in experiment.parts(chosen)]


def make_document(rows: dict[str, list[Row]], how_made: Sequence[str], size: Size) -> Document:
    """The page, from the rows of each experiment."""
    blocks: list[Block] = [ABOUT]
    for name, found in rows.items():
        experiment = load_experiment(name)
        blocks += [*experiment.words(), *experiment.results(found)]
    blocks += ["## How this was made", "\n".join(f"- {line}" for line in how_made)]
    note = "" if size == "full" else " A quick look on few cases: intervals are wide."
    return Document(
        "finlab evaluation", f"Allocation methods and simulated swims, side by side.{note}", tuple(blocks)
    )


def _how_made(command: str, seconds: float, seed: int) -> list[str]:
    about = machine() | {"threads": str(THREADS)}
    return [
        f"Command `{command}`, seed {seed}, {seconds / 60.0:.0f} minutes of one core for all parts",
        f"Commit `{source_commit()}`",
        "Machine: " + ", ".join(f"{key} {value}" for key, value in about.items()),
        "Every section is also printed by `finlab eval NAME`; printed figures are those of Y. Hamamatsu, "
        "M. Kruusmaa, A. Ristolainen, Layout-independent actuation allocator for fin-actuated marine robots",
    ]


def _missing(names: Sequence[str]) -> list[str]:
    return [f"Not run: {', '.join(names)}"] if names else []


def write_report(out: Path, document: Document, rows: dict[str, list[Row]]) -> None:
    """Page, pictures and rows.

    Raises:
        DataError: a file cannot be written; it is then as it was before.
    """
    pictures = out / PICTURES
    try:
        pictures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"{pictures}: cannot be made: {error.strerror}") from None
    for figure in (block for block in document.blocks if isinstance(block, Figure)):
        write_whole(pictures / f"{figure.name}.svg", figure.draw().svg(figure.name), DataError)
    write_whole(out / PAGE, to_markdown(document, PICTURES), DataError)
    lines = [
        f"{json.dumps(name)}: [\n" + ",\n".join(json.dumps(_rounded(row)) for row in each) + "\n]"
        for name, each in rows.items()
    ]
    write_whole(out / TABLES, "{\n" + ",\n".join(lines) + "\n}\n", DataError)


def _rounded(value: Any) -> Any:
    """The same with `DIGITS` significant digits."""
    if isinstance(value, dict):
        return {key: _rounded(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_rounded(each) for each in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
