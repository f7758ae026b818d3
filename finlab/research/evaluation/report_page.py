"""`finlab eval report`: run experiments and write one page and all rows."""

import json
import platform
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import scipy
from threadpoolctl import threadpool_limits

import finlab
from finlab.errors import DataError
from finlab.research.evaluation.document import ReportBlock, Row, to_markdown
from finlab.research.evaluation.experiment import (
    EXPERIMENTS,
    check_names,
    load_experiment,
    progress,
)
from finlab.research.evaluation.origin import commit_words
from finlab.whole_file import make_folder, write_whole

PAGE_FILE = "report.md"
"""The page in a report's folder."""
ROWS_FILE = "tables.json"
"""The rows of all experiments in a report's folder."""
SEED = 6143
"""Default seed of a report; methods were developed on others."""
INTRODUCTION = (
    "Every answer is scored by the plant: the fins' own laws or tables. All methods but `paper`, "
    "which has learned one fin law from samples, were given these, so errors show how well "
    "methods solve, not how well a model fits a fin in the water. No robot swam and no fin was "
    "measured for this report: fin laws are means over a cycle in still water, bodies, water and "
    f"sensors are simulated. Methods and controllers were developed on other seeds than {SEED}."
)
Size = Literal["quick", "full"]


def make_report(
    out: Path, *, size: Size = "full", seed: int = SEED, names: Sequence[str] = ("all",)
) -> Path:
    """Runs experiments, and writes a page and all rows.

    Both are written after each experiment, so that they are there if it is stopped. Each experiment
    runs on one thread, so that times are of one core.

    Args:
        out: folder of the report, which is made if need be.
        size: whether experiments have their options of the quick or of the full report.
        seed: of the experiments that have one.
        names: names of experiments, or `all`.

    Returns:
        Path of the page.

    Raises:
        DataError: an unknown name of an experiment, or a file that cannot be written.
    """
    check_names("sections", names, ("all", *EXPERIMENTS))
    make_folder(out)
    chosen = [name for name in EXPERIMENTS if "all" in names or name in names]
    start = time.process_time()
    rows = dict[str, list[Row]]()
    blocks = list[ReportBlock]()
    commit = commit_words()
    command = f"finlab eval report -o {out}"
    if size == "quick":
        command += " --quick"
    if "all" not in names:
        command += f" --sections {','.join(chosen)}"
    if seed != SEED:
        command += f" --seed {seed}"
    note = "" if size == "full" else " A quick look on few cases: intervals are wide."
    head = [
        "# finlab evaluation",
        f"Allocation methods and simulated swims, side by side.{note}",
        INTRODUCTION,
    ]
    for name in progress(chosen, "experiment", "report"):
        experiment = load_experiment(name)
        options = dict(experiment.quick if size == "quick" else experiment.full)
        if "seed" in experiment.options():
            options["seed"] = seed
        with threadpool_limits(1):
            rows[name] = experiment.rows(**options)
        blocks += [*experiment.words(), *experiment.results(rows[name])]
        blocks.append(f"Made by `{experiment.command(options)}` at {commit}.")
        minutes = (time.process_time() - start) / 60.0
        origin = f"Command `{command}` at {commit}, {minutes:.0f} minutes of one core"
        page = to_markdown(*head, *blocks, *_origin_blocks(origin))
        write_whole(out / PAGE_FILE, page, DataError)
        write_whole(out / ROWS_FILE, json.dumps(rows, indent=1) + "\n", DataError)
    return out / PAGE_FILE


def _origin_blocks(origin: str) -> list[str]:
    """The last section of the page: the command and commit that made it, machine and versions."""
    modules = {"finlab": finlab, "numpy": np, "scipy": scipy}
    versions = ", ".join(f"{name} {module.__version__}" for name, module in modules.items())
    lines = [
        origin,
        f"On {platform.machine()}, python {platform.python_version()}, {versions}",
        "Printed figures are those of Y. Hamamatsu, M. Kruusmaa, A. Ristolainen, "
        "Layout-independent actuation allocator for fin-actuated marine robots",
    ]
    return ["## How this was made", "\n".join(f"- {line}" for line in lines)]
