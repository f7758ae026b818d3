"""`finlab eval report`: runs experiments section by section, and writes one page and all rows."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from threadpoolctl import threadpool_limits

from finlab.errors import DataError
from finlab.research.evaluation.claims import claims, sentences
from finlab.research.evaluation.document import ReportBlock, ReportTable, Row, to_markdown
from finlab.research.evaluation.experiment import (
    EXPERIMENTS,
    Size,
    check_names,
    load_experiment,
    progress,
)
from finlab.research.evaluation.origin import version_words
from finlab.research.evaluation.section import (
    is_kept,
    kept_options,
    made_section,
    origin_words,
    read_section,
    rows_of,
    section_path,
)
from finlab.research.evaluation.verdict import COLUMNS
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
    "sensors are simulated. What jets do to each other is in the section Interaction alone, where "
    "no model was told it. Methods and controllers were developed on other seeds than "
    f"{SEED}."
)
CLAIMS_INTRODUCTION = (
    "What the paper concludes, each from its printed figures and from the rows of the tables "
    "below. A figure is reproduced where the printed one lies in the interval of ours, or within "
    "a quarter of it; it cannot be decided where something else differs between the two runs."
)
SIZE_WORDS: Mapping[Size, str] = {
    "quick": " A quick look on few cases: intervals are wide.",
    "usual": "",
    "full": " At the printed sizes.",
}
"""What the page says of its size."""


def make_report(
    out: Path, *, size: Size = "usual", seed: int = SEED, names: Sequence[str] = ("all",)
) -> Path:
    """Runs experiments, and writes a page and all rows.

    What is done is kept in the folder piece by piece: a report that was stopped goes on when it is
    asked for again, and what has not changed since is not run again. Experiments that are not asked
    for stand in the page as they are kept. Each experiment runs on one thread, so that times are
    of one core.

    Args:
        out: folder of the report, which is made if need be.
        size: whether experiments have their options of the quick, the usual or the full report.
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
    rows = dict[str, list[Row]]()
    blocks = list[ReportBlock]()
    command = "finlab eval report -o DIR"
    if size != "usual":
        command += f" --{size}"
    if "all" not in names:
        command += f" --sections {','.join(chosen)}"
    if seed != SEED:
        command += f" --seed {seed}"
    kept = [name for name in EXPERIMENTS if name not in chosen and is_kept(name, out)]
    shown = [name for name in EXPERIMENTS if name in chosen or name in kept]
    for name in progress(shown, "experiment", "report"):
        experiment = load_experiment(name)
        if name in chosen:
            options = experiment.size(size)
            if "seed" in experiment.options():
                options["seed"] = seed
            with threadpool_limits(1):
                pieces = made_section(experiment, options, out)
        else:
            pieces = read_section(section_path(out, name))
            options = kept_options(experiment, pieces)
        rows[name] = rows_of(experiment, pieces)
        blocks += [*experiment.words(), *experiment.results(rows[name])]
        blocks += experiment.beside_the_paper(rows[name])
        made_by = f"The command `{experiment.command(options)}` prints the table."
        blocks.append(" ".join([made_by, *origin_words(pieces)]))
        page = to_markdown(*_head_blocks(size, rows), *blocks, *_origin_blocks(command, kept))
        write_whole(out / PAGE_FILE, page, DataError)
        write_whole(out / ROWS_FILE, json.dumps(rows, indent=1) + "\n", DataError)
    return out / PAGE_FILE


def _head_blocks(size: Size, rows: Mapping[str, Sequence[Row]]) -> list[ReportBlock]:
    """The first blocks of the page, with the paper's conclusions that the rows can judge."""
    head: list[ReportBlock] = [
        "# finlab evaluation",
        f"Allocation methods and simulated swims, side by side.{SIZE_WORDS[size]}",
        INTRODUCTION,
    ]
    judged = claims(rows)
    if judged:
        head += ["## What is reproduced", CLAIMS_INTRODUCTION]
        said = sentences(rows)
        if said:
            head.append("\n".join(f"- {sentence}" for sentence in said))
        head.append(ReportTable(COLUMNS, [each.row for each in judged]))
    return head


def _origin_blocks(command: str, kept: Sequence[str]) -> list[ReportBlock]:
    """The last section of the page: the command that makes it, what it kept, and versions."""
    lines = [
        f"Command `{command}`; each section says at which commit and on which machine it was made"
    ]
    if kept:
        names = ", ".join(kept)
        lines.append(f"As earlier runs left them, at the sizes of their own commands: {names}")
    lines += [
        version_words(("finlab-marine", "numpy", "scipy")),
        "Printed figures are those of Y. Hamamatsu, M. Kruusmaa, A. Ristolainen, "
        "Layout-independent actuation allocator for fin-actuated marine robots",
    ]
    return ["## How this was made", "\n".join(f"- {line}" for line in lines)]
