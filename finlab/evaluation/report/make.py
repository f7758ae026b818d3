"""`finlab eval report`: run what is missing, then write the page and the rows."""

import json
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

from threadpoolctl import threadpool_limits

from finlab.errors import DataError
from finlab.evaluation.experiment import EXPERIMENTS, Experiment, load_experiment
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Block, Row, to_markdown
from finlab.evaluation.report.provenance import machine, source_commit, source_digest
from finlab.whole_file import make_folder, write_whole

PAGE, TABLES, RECORDS = "report.md", "tables.json", "records"
"""What a report's folder holds."""
SEED = 6143
"""Of a report, unless another one is given; kept apart from those on which methods were developed."""
ABOUT = (
    "Every answer is scored by the plant: the fins' own laws or tables. All methods but `paper`, which has "
    "learned one fin law from samples, were given these, so errors show how well methods solve, not how "
    "well a model fits a fin in the water. No robot swam and no fin was measured for this report: fin laws "
    "are means over a cycle in still water, bodies, water and sensors are simulated. Methods and "
    f"controllers were developed on other seeds than {SEED}."
)
Size = Literal["quick", "full"]


def make_report(out: Path, *, size: Size = "full", seed: int = SEED, names: Sequence[str] = ("all",)) -> Path:
    """Make the report; experiments that are done are taken from its folder `records`.

    Args:
        out: folder for the report, made if need be.
        size: how much of everything: minutes, or half an hour.
        seed: of all draws.
        names: experiments that are run if they are missing, or all; the page shows all that are complete.

    Returns:
        The page.

    Raises:
        DataError: an unknown name, or a file that cannot be written.
    """
    if unknown := [name for name in names if name not in (*EXPERIMENTS, "all")]:
        raise DataError(f"sections: expected all or some of {', '.join(EXPERIMENTS)}, got {unknown[0]!r:.60}")
    make_folder(out / RECORDS)
    digest, done = source_digest(), dict[str, dict[str, Any]]()
    for name in progress(EXPERIMENTS, "experiment", "report"):
        experiment = load_experiment(name)
        key = {"options": _options(experiment, size, seed), "source": digest}
        record = _read(out / RECORDS / f"{name}.json", key)
        able = all(find_spec(package) is not None for package in experiment.needs)
        if record is None and ("all" in names or name in names) and able:
            record = _run(experiment, key, out / RECORDS / f"{name}.json")
        if record is not None:
            done[name] = record
    rows: dict[str, list[Row]] = {name: record["rows"] for name, record in done.items()}
    seconds = sum(record["seconds"] for record in done.values())
    command = f"finlab eval report -o {out}" + (" --quick" if size == "quick" else "")
    command += f" --seed {seed}" if seed != SEED else ""
    left = [name for name in EXPERIMENTS if name not in done]
    how_made = _how_made(command, seconds, seed) + ([f"Not run: {', '.join(left)}"] if left else [])
    write_whole(out / PAGE, to_markdown(*_page(rows, how_made, size)), DataError)
    write_whole(out / TABLES, json.dumps(rows, indent=1) + "\n", DataError)
    return out / PAGE


def _options(experiment: Experiment, size: Size, seed: int) -> dict[str, Any]:
    chosen = experiment.check(experiment.quick if size == "quick" else experiment.full)
    return chosen | ({"seed": seed} if "seed" in chosen else {})


def _read(path: Path, key: dict[str, Any]) -> dict[str, Any] | None:
    """What was kept of an experiment with these options and this code; None where that was not run."""
    try:
        record: dict[str, Any] = json.loads(path.read_text("utf-8"))
        same = record["key"] == json.loads(json.dumps(key)) and {"rows", "seconds"} <= record.keys()
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"{path}: not a file of rows ({error}); delete it and run again") from None
    return record if same else None


def _run(experiment: Experiment, key: dict[str, Any], path: Path) -> dict[str, Any]:
    """Run an experiment on one thread, so that times are of one core, and keep its rows."""
    start = time.process_time()
    with threadpool_limits(1):
        rows = experiment.rows(**key["options"])
    record = {"key": key, "rows": rows, "seconds": round(time.process_time() - start, 1)}
    write_whole(path, json.dumps(record, indent=1, allow_nan=False) + "\n", DataError)
    return record


def _page(rows: dict[str, list[Row]], how_made: Sequence[str], size: Size) -> list[Block]:
    note = "" if size == "full" else " A quick look on few cases: intervals are wide."
    about = f"Allocation methods and simulated swims, side by side.{note}"
    blocks: list[Block] = ["# finlab evaluation", about, ABOUT]
    for name, found in rows.items():
        experiment = load_experiment(name)
        blocks += [*experiment.words(), *experiment.results(found)]
    return [*blocks, "## How this was made", "\n".join(f"- {line}" for line in how_made)]


def _how_made(command: str, seconds: float, seed: int) -> list[str]:
    return [
        f"Command `{command}`, seed {seed}, {seconds / 60.0:.0f} minutes of one core",
        f"Commit `{source_commit()}`",
        "Machine: " + ", ".join(f"{key} {value}" for key, value in machine().items()),
        "Every section is also printed by `finlab eval NAME`; printed figures are those of Y. Hamamatsu, "
        "M. Kruusmaa, A. Ristolainen, Layout-independent actuation allocator for fin-actuated marine robots",
    ]
