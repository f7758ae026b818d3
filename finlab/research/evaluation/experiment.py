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
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from tqdm import tqdm

from finlab.errors import DataError
from finlab.research.evaluation.document import Column, ReportBlock, ReportTable, Row
from finlab.research.evaluation.verdict import COLUMNS, Comparison

EXPERIMENTS = (
    "wrench",
    "robots",
    "thrusters",
    "latency",
    "ablation",
    "temperature",
    "trajectory",
    "faults",
    "velocity",
    "swims",
    "interaction",
    "distilled",
)
"""Names, those of their modules in `finlab.research.evaluation.experiments`, in the order of the
report."""
MAX_NUMBER = 1_000_000
"""Largest whole number of an option that is no seed."""
MAX_SEED = 2**63 - 1
"""Largest seed."""
Size = Literal["quick", "usual", "full"]
"""Sizes of a report: minutes, an hour, and the paper's own."""
Item = TypeVar("Item")


@dataclass(frozen=True)
class Experiment:
    """A question, what is run to answer it, and the columns of its rows."""

    name: str
    """Name of the verb and of the report's section."""
    question: str
    """One sentence, in Markdown, which is the help of the verb, too."""
    columns: tuple[Column, ...]
    """Columns of the table. Rows may have more keys, which are in the JSON alone; intervals
    [low, high] are under `<key>_interval`."""
    run: Callable[..., Iterable[Row]]
    """From keyword options to rows of plain values. The options of the verb are its parameters:
    their types (int, float, bool, str, Literal, a tuple of str, int or float, each perhaps None),
    their defaults and their words under `Args` in its docstring. An int whose default is 0 may be
    0, any other is at least 1. A parameter `layout` is given by position. Times depend on the
    machine; all other values on the options alone."""
    program: str = ""
    """Command line that runs it, without options; `finlab eval` and its name where empty."""
    note: str = ""
    """How the columns are to be read, in Markdown."""
    origin: Callable[[], str] | None = None
    """Says what is to be known of one run, such as the machine: a sentence below the table of a
    page, for figures that depend on it."""
    quick: Mapping[str, Any] = field(default_factory=dict)
    """Options of the quick report where they differ from the defaults."""
    usual: Mapping[str, Any] = field(default_factory=dict)
    """Options of the report where they differ from the defaults."""
    full: Mapping[str, Any] = field(default_factory=dict)
    """Options of the report of the printed sizes, where they differ from the usual ones."""
    pieces: tuple[str, ...] = ()
    """Options of tuples whose values a report runs one by one, so that it can be stopped between
    them."""
    measures: tuple[str, ...] = ()
    """Paths in the source tree of what decides the rows, beside the methods: a stored section is
    out of date when these change."""
    probe: Mapping[str, Any] = field(default_factory=dict)
    """Options that make a piece a matter of seconds, by which a stored one is checked where sources
    have changed; empty where it is run again."""
    order: Callable[[Row], Any] | None = None
    """Key by which the rows of several pieces are sorted; None leaves them as they come."""
    compared: Callable[[Sequence[Row]], list[Comparison]] | None = None
    """From the rows to each figure that the paper prints of this experiment, beside ours."""
    printed: Callable[[Sequence[Row]], list[Row]] | None = None
    """Figures that the paper prints beside our rows, as rows that stand below them."""
    picture: Callable[[Sequence[Row]], Any] | None = None
    """From the rows to the figure of `--plot FILE`; no such option without one."""
    for_picture: Mapping[str, Any] = field(default_factory=dict)
    """Options that give the picture its rows."""
    only_for_picture: Callable[[Row], bool] | None = None
    """Whether a row that these options bring is no row of the table; None where they bring none."""

    def options(self) -> dict[str, inspect.Parameter]:
        """Returns the parameters of `run` by name, with their types resolved."""
        types = get_type_hints(self.run, include_extras=True)
        options = {}
        for name, parameter in inspect.signature(self.run).parameters.items():
            options[name] = parameter.replace(annotation=types[name])
        return options

    def check(self, chosen: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the values of all options: those chosen, and the defaults of the others.

        Args:
            chosen: values by option.

        Raises:
            DataError: an unknown option, or a number out of range.
        """
        options = self.options()
        for name in chosen:
            if name not in options:
                raise DataError(
                    f"{self.name}: expected options among {', '.join(options)}, got {name!r}"
                )
        values = {}
        for name, option in options.items():
            values[name] = chosen.get(name, option.default)
            _check_number(name, values[name], minimum=0 if option.default == 0 else 1)
        return values

    def command(self, options: Mapping[str, Any]) -> str:
        """Returns the command line that prints the table.

        Args:
            options: values by option; those that are the defaults are left out.
        """
        words = shlex.split(self.program) if self.program else ["finlab", "eval", self.name]
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
        """Runs the experiment, row by row; a number that is not finite becomes None.

        Args:
            chosen: values by option.

        Raises:
            DataError: as for `check`, and options that the run itself refuses.
            AllocationError: an unknown method.
        """
        yield from map(_finite, self.run(**self.check(chosen)))

    def rows(self, **chosen: Any) -> list[Row]:
        """Returns all rows of `each_row`."""
        return list(self.each_row(**chosen))

    def table(self, rows: Sequence[Row]) -> ReportTable:
        """Returns the table of rows; those of the default method stand out, and below are those
        that the paper prints."""
        table_rows = []
        for row in rows:
            is_ours = str(row.get("method")) == "dual"
            table_rows.append({**row, "_kind": "ours"} if is_ours else row)
        if self.printed is not None:
            table_rows += self.printed(rows)
        return ReportTable(self.columns, table_rows)

    def size(self, name: Size) -> dict[str, Any]:
        """Returns the options of a size of the report, where they differ from the defaults."""
        if name == "quick":
            return dict(self.quick)
        return {**self.usual, **self.full} if name == "full" else dict(self.usual)

    def beside_the_paper(self, rows: Sequence[Row]) -> list[ReportBlock]:
        """Returns a table of all figures that the paper prints, each with ours and a verdict; no
        block where it prints none."""
        if self.compared is None:
            return []
        compared = [comparison.row for comparison in self.compared(rows)]
        return [f"### {self.name.capitalize()}: beside the paper", ReportTable(COLUMNS, compared)]

    def words(self) -> list[ReportBlock]:
        """Returns heading and question as blocks, which stand before the results."""
        return [f"## {self.name.capitalize()}", self.question]

    def results(self, rows: Sequence[Row]) -> list[ReportBlock]:
        """Returns the table of rows, and the note on how to read it, as blocks."""
        blocks: list[ReportBlock] = [self.table(rows)]
        if self.note:
            blocks.append(f"*{self.note}*")
        if self.origin is not None:
            blocks.append(self.origin())
        return blocks


def _check_number(option: str, value: Any, minimum: int) -> None:
    """Refuses whole numbers out of range, and numbers that are not finite, in tuples, too. Raises
    DataError."""
    flag = option.replace("_", "-")
    if type(value) is int:
        maximum = MAX_SEED if option == "seed" else MAX_NUMBER
        if value < minimum:
            raise DataError(f"{flag}: expected a number of at least {minimum}, got {value}")
        if value > maximum:
            raise DataError(f"{flag}: expected a number of at most {maximum}, got {value}")
    for number in value if isinstance(value, tuple) else (value,):
        if isinstance(number, float) and not math.isfinite(number):
            raise DataError(f"{flag}: expected a finite number, got {number}")


def check_names(option: str, names: Sequence[str], known: Collection[str]) -> None:
    """Refuses unknown names, before hours of work.

    Args:
        option: the option that holds the names, for the message.
        names: what the user has written.
        known: the names that there are.

    Raises:
        DataError: one of the names is not known.
    """
    for name in names:
        if name not in known:
            raise DataError(f"{option}: expected some of {', '.join(known)}, got {name!r:.60}")


def progress(items: Iterable[Item], unit: str, title: str | None = None) -> Iterable[Item]:
    """Returns items one by one, with a progress bar on stderr that is gone at the end.

    Args:
        items: the items.
        unit: what one of them is called.
        title: words before the bar.
    """
    # disable=None: a bar on a terminal, nothing elsewhere
    return tqdm(items, title, unit=unit, disable=None, leave=False, file=sys.stderr)


def begin(words: str) -> None:
    """Prints on a terminal what has begun, until the first progress bar takes its place."""
    if sys.stderr.isatty():
        print(f"{words} ...", end="\r", file=sys.stderr, flush=True)


def _finite(value: Any) -> Any:
    """A row or a part of one, with None in place of numbers that JSON does not know."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def item_type(kind: Any) -> tuple[Any, bool]:
    """Returns the type of one value of an option, without None, and whether the option is a list.

    Args:
        kind: annotation of the parameter.
    """
    if NoneType in get_args(kind):
        kind = next(member for member in get_args(kind) if member is not NoneType)
    if get_origin(kind) is tuple:
        return get_args(kind)[0], True
    return kind, False


def load_experiment(name: str) -> Experiment:
    """Returns the experiment of a name.

    Raises:
        DataError: there is none.
    """
    if name not in EXPERIMENTS:
        raise DataError(f"eval: expected one of {', '.join(EXPERIMENTS)}, got {name!r}")
    value = import_module(f"finlab.research.evaluation.experiments.{name}").experiment
    assert isinstance(value, Experiment)
    return value


@cache
def paper_figures() -> Any:
    """Returns the figures that the paper prints, by table; the file names the source of each."""
    import yaml

    figures = files("finlab.research.evaluation").joinpath("paper_figures.yaml")
    return yaml.safe_load(figures.read_text("utf-8"))
