"""An experiment is one value: what is asked, what is run, and the columns of its rows.

The verb `finlab eval NAME`, its `--json FILE`, and the section of the report (question, table,
size) follow from it. Each module of `EXPERIMENTS` holds one under the name `experiment`, and is
imported when it is asked for.
"""

import inspect
import math
import shlex
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.resources import files
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from tqdm import tqdm

from finlab.errors import DataError
from finlab.research.evaluation.document import Column, ReportBlock, ReportTable, Row

EXPERIMENTS = (
    *("wrench", "thrusters", "latency", "ablation", "temperature"),
    *("trajectory", "faults", "velocity", "swims", "interaction"),
)
"""Names, those of their modules in `finlab.research.evaluation.experiments`, in the order of the
report."""
# largest whole number of an option, and of a seed
MOST = 1_000_000
MOST_SEED = 2**63 - 1
Item = TypeVar("Item")


@dataclass(frozen=True)
class Experiment:
    """A question, what is run to answer it, and the columns of its rows."""

    name: str
    """Of the verb and of the report's section."""
    question: str
    """One sentence, in Markdown, which is the help of the verb, too."""
    columns: tuple[Column, ...]
    """Of the table. Rows may have more keys, which are in the JSON alone; intervals [low, high] are
    under `<key>_interval`."""
    run: Callable[..., Iterable[Row]]
    """From keyword options to rows of plain values. The options of the verb are its parameters:
    their types (int, float, bool, str, Literal, a tuple of str, int or float, each perhaps None),
    their defaults and their words under `Args` in its docstring. An int whose default is 0 may be
    0, any other is at least 1. A parameter `layout` is given by position. Times depend on the
    machine; all other values on the options alone."""
    note: str = ""
    """How the columns are to be read, in Markdown."""
    quick: Mapping[str, Any] = field(default_factory=dict)
    """Options of the quick report where they differ from the defaults."""
    full: Mapping[str, Any] = field(default_factory=dict)
    """Options of the whole report where they differ from the defaults."""
    printed: Callable[[Sequence[Row]], list[Row]] | None = None
    """Figures that the paper prints beside our rows, as rows that stand below them."""
    picture: Callable[[Sequence[Row]], Any] | None = None
    """From the rows to the figure of `--plot FILE`; no such option without one."""
    for_picture: Mapping[str, Any] = field(default_factory=dict)
    """Options that give the picture its rows."""

    def options(self) -> dict[str, inspect.Parameter]:
        """The parameters of `run`, with their types resolved."""
        types = get_type_hints(self.run, include_extras=True)
        parameters = inspect.signature(self.run).parameters
        return {name: each.replace(annotation=types[name]) for name, each in parameters.items()}

    def check(self, chosen: Mapping[str, Any]) -> dict[str, Any]:
        """All options: those chosen, and the defaults of the others. Raises DataError: an unknown
        option, or a number out of range."""
        options = self.options()
        if unknown := [name for name in chosen if name not in options]:
            raise DataError(
                f"{self.name}: expected options among {', '.join(options)}, got {unknown[0]!r}"
            )
        values = {name: chosen.get(name, each.default) for name, each in options.items()}
        for name, value in values.items():
            least = 0 if options[name].default == 0 else 1
            most = MOST_SEED if name == "seed" else MOST
            if type(value) is int and not least <= value <= most:
                said = f"at least {least}" if value < least else f"at most {most}"
                raise DataError(
                    f"{name.replace('_', '-')}: expected a number of {said}, got {value}"
                )
            for number in value if isinstance(value, tuple) else (value,):
                if isinstance(number, float) and not math.isfinite(number):
                    raise DataError(
                        f"{name.replace('_', '-')}: expected a finite number, got {number}"
                    )
        return values

    def command(self, options: Mapping[str, Any]) -> str:
        """The line that prints the table: the verb with those options that are not the defaults."""
        words = ["finlab", "eval", self.name]
        for name, option in self.options().items():
            value = options.get(name, option.default)
            if value == option.default or value is None:
                continue
            dashed = name.replace("_", "-")
            if isinstance(value, bool):
                words.append(f"--{dashed}" if value else f"--no-{dashed}")
            else:
                text = ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
                words += [text] if name == "layout" else [f"--{dashed}", text]
        return shlex.join(words)

    def each_row(self, **chosen: Any) -> Iterator[Row]:
        """Run it, row by row; options as in `check`. A number that is not finite becomes None.
        Raises DataError: as `check`, and options that the run itself refuses; AllocationError: an
        unknown method."""
        yield from map(_finite, self.run(**self.check(chosen)))

    def rows(self, **chosen: Any) -> list[Row]:
        """All rows of `each_row`."""
        return list(self.each_row(**chosen))

    def table(self, rows: Sequence[Row]) -> ReportTable:
        """The rows of the default method stand out; below them are those that the paper prints."""
        ours = [
            {**row, "_kind": "ours"} if str(row.get("method")) == "dual" else row for row in rows
        ]
        printed = [] if self.printed is None else self.printed(rows)
        return ReportTable(self.columns, [*ours, *printed])

    def words(self) -> list[ReportBlock]:
        """Blocks of heading and question, which stand before the results."""
        return [f"## {self.name.capitalize()}", self.question]

    def results(self, rows: Sequence[Row]) -> list[ReportBlock]:
        """Blocks of the table of rows and of the note on how to read it."""
        return [self.table(rows), f"*{self.note}*"] if self.note else [self.table(rows)]


def check_names(option: str, names: Sequence[str], known: Collection[str]) -> None:
    """Refuse unknown names before the work. Raises DataError: one of the names is not known."""
    if unknown := [name for name in names if name not in known]:
        raise DataError(f"{option}: expected some of {', '.join(known)}, got {unknown[0]!r:.60}")


def progress(items: Iterable[Item], unit: str, title: str | None = None) -> Iterable[Item]:
    """The items one by one, with a bar on stderr that is gone at the end; none where that is no
    terminal."""
    # disable=None: a bar on a terminal, nothing elsewhere
    return tqdm(items, title, unit=unit, disable=None, leave=False, file=sys.stderr)


def begin(words: str) -> None:
    """Say on a terminal what has begun, until the first bar stands in its place."""
    if sys.stderr.isatty():
        print(f"{words} ...", end="\r", file=sys.stderr, flush=True)


def _finite(value: Any) -> Any:
    """Rows and lists without numbers that JSON does not know."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def item_type(kind: Any) -> tuple[Any, bool]:
    """The type of an option, or of its items, without None; and whether its values are several."""
    if NoneType in get_args(kind):
        kind = next(part for part in get_args(kind) if part is not NoneType)
    several = get_origin(kind) is tuple
    return get_args(kind)[0] if several else kind, several


def load_experiment(name: str) -> Experiment:
    """The experiment of that name. Raises DataError: there is none."""
    if name not in EXPERIMENTS:
        raise DataError(f"eval: expected one of {', '.join(EXPERIMENTS)}, got {name!r}")
    value = import_module(f"finlab.research.evaluation.experiments.{name}").experiment
    assert isinstance(value, Experiment)
    return value


@cache
def paper_figures() -> Any:
    """Figures that the paper prints, by table; the file names the source of each."""
    import yaml

    figures = files("finlab.research.evaluation").joinpath("paper_figures.yaml")
    return yaml.safe_load(figures.read_text("utf-8"))
