#!/usr/bin/env python3
"""Makes the tables of figures in README.md and docs again: `make figures [PAGE=evaluation]`.

A page holds a table between two marks,

    <!-- figures: NAME KEY... -->
    <!-- end of figures -->

where NAME is an experiment of `finlab eval`, which runs with the sizes of its quick report, or that
of a tool of that name. KEY... are the columns to show, by default all; OPTION=VALUE among them
is an option in place of that of the quick report; one with spaces stands in quotes. What stands
between the marks is replaced.
"""

import re
import shlex
import sys
import time
from dataclasses import replace
from importlib import import_module
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from finlab.research.evaluation.document import ReportBlock, ReportTable, to_markdown
from finlab.research.evaluation.experiment import Experiment, begin, item_type, load_experiment

ROOT = Path(__file__).resolve().parents[1]
PAGES = {path.stem: path for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]}
MARK = re.compile(r"(<!-- figures: (\w+)((?: (?:[\w.=/:,-]|'[^'\n]*')+)*) -->\n)")
END_MARK = "<!-- end of figures -->"


def main(names: list[str]) -> int:
    """Make the tables of the pages of these names, of all pages without any."""
    if unknown := [name for name in names if name not in PAGES]:
        print(
            f"figures: expected pages among {', '.join(PAGES)}, got {unknown[0]!r}", file=sys.stderr
        )
        return 2
    for page in [PAGES[name] for name in names or PAGES]:
        for mark, name, keys in re.findall(MARK, page.read_text(encoding="utf-8")):
            # changed meanwhile
            table = table_of(name, shlex.split(keys))
            text = page.read_text(encoding="utf-8")
            head, _, tail = text.partition(mark)
            page.write_text(
                head + mark + table + END_MARK + tail.partition(END_MARK)[2], encoding="utf-8"
            )
            print(page.relative_to(ROOT), flush=True)
    return 0


def experiment_of(name: str) -> Experiment:
    """Returns the experiment of a name: of the tool that is called so, else one of `finlab
    eval`."""
    if not (ROOT / "tools" / f"{name}.py").exists():
        return load_experiment(name)
    experiment = import_module(f"tools.{name}").experiment
    assert isinstance(experiment, Experiment)
    return experiment


def table_of(name: str, keys: list[str]) -> str:
    """The command and the table, in Markdown, of an experiment's quick sizes."""
    experiment = experiment_of(name)
    began = time.monotonic()
    begin(name)
    options = experiment.options()
    stated = {}
    for key in keys:
        if "=" in key:
            option, value = key.split("=")
            _, is_list = item_type(options[option].annotation)
            stated[option] = _value(value, is_list)
    chosen = {**experiment.quick, **stated}
    keys = [key for key in keys if "=" not in key]
    table = experiment.table(experiment.rows(**chosen))
    columns = {column.key: replace(column, interval=None) for column in table.columns}
    shown = ReportTable(tuple(columns[key] for key in keys or columns), table.rows)
    print(f"{name}: {time.monotonic() - began:.0f} s", flush=True)
    blocks: list[ReportBlock] = [f"`{experiment.command(chosen)}`:", shown]
    if experiment.origin is not None:
        blocks.append(experiment.origin())
    return f"\n{to_markdown(*blocks)}\n"


def _value(text: str, is_list: bool) -> int | str | tuple[int, ...] | tuple[str, ...]:
    """An option as its experiment takes it: a number or a word, or several with commas between."""
    words = text.split(",") if is_list else [text]
    if all(word.isdigit() for word in words):
        numbers = tuple(int(word) for word in words)
        return numbers if is_list else numbers[0]
    return tuple(words) if is_list else text


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
