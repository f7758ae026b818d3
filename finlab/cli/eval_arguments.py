"""What the `eval` verbs share: groups of arguments, checked before the work, and JSON files after it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from finlab.cli.inputs import check_positive, open_robot
from finlab.cli.json_file import JsonFile, check_json_file, put_json
from finlab.errors import DataError, LayoutError

if TYPE_CHECKING:
    from finlab.allocation import Allocator
    from finlab.evaluation.experiments.closed_loop_runs import Run as LoggedRun
    from finlab.evaluation.experiments.closed_loop_runs import Scenario
    from finlab.evaluation.plots.style import Picture
    from finlab.evaluation.report.document import Block
    from finlab.evaluation.splits import Case
    from finlab.layout import Layout

Count = Annotated[int, arg(metavar="N")]
Name = Annotated[str, arg(metavar="NAME")]
Names = Annotated[str, arg(metavar="A,B,...")]
Checkpoint = Annotated[str | None, arg(metavar="NAME|FOLDER")]
Folder = Annotated[Path | None, arg(metavar="DIR")]
Source = Annotated[str, arg(metavar="NAME|FILE")]
Objective = Literal["power", "effort"]
PathController = Literal["tracking", "waypoint"]


@dataclass(frozen=True)
class Cases:
    """Held-out layouts with reachable targets."""

    split: Name = "id"
    """One of id, ood, ood-fins, limits, failure, near-singular, fins, fins-mixed, tables, many-fins,
    perturbed, parallel, collinear, clustered, coincident, stacked, big, tiny; `eval wrench` and `eval cost`
    take all, too."""
    layouts: Count = 100
    """Layouts of the split."""
    targets: Count = 1000
    """Targets on each layout."""
    seed: Count = 0
    """Of all draws; same numbers, same cases."""

    def draw(self, split: str | None = None) -> list[Case]:
        """The cases, of this or another split."""
        from finlab.evaluation.splits import make_split

        return make_split(split or self.split, self.layouts, self.targets, self.seed)


@dataclass(frozen=True)
class Output:
    """Where the rows go."""

    json: JsonFile = None
    """File for the rows; they are printed in place of the table where no file is named."""

    def __post_init__(self) -> None:
        """Refuses a file that cannot be written before the work, not after."""
        check_json_file(self.json)

    def write(self, **content: Any) -> None:
        """Write the rows where a file was named."""
        if self.json is not None:
            put_json(content, self.json)

    def show(self, *blocks: Block, **content: Any) -> None:
        """Write the rows where a file was named, and print words and tables as the report has them."""
        from finlab.evaluation.report.text import to_text

        put_json(content, self.json, to_text(*blocks))


MOST_FINS = 16
"""Fins that a layout may have."""


def parse_counts(text: str) -> list[int]:
    """Numbers of fins from a text with commas between; `DataError` for what is none."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    wrong = [word for word in words if not word.isdecimal() or not 1 <= int(word) <= MOST_FINS]
    if wrong or not words:
        got = wrong[0] if wrong else text
        raise DataError(f"fins: expected numbers from 1 to {MOST_FINS} with commas between, got {got!r}")
    return [int(word) for word in words]


@dataclass(frozen=True)
class Run(Output):
    """What is measured, and where the rows go."""

    checkpoint: Checkpoint = None
    """Trained checkpoint, a shipped name or a folder; the shipped one of each method by default."""


@dataclass(frozen=True)
class MethodRun(Run):
    """The same, for methods that can be told what to keep least."""

    objective: Objective = "power"
    """What methods that can choose keep least: power in watts, or effort, the paper's J_en."""

    def methods(self, names: str) -> dict[str, Allocator]:
        """All methods, loaded before the first one runs so that a wrong name costs no time."""
        from finlab.evaluation.method_specs import load_method_specs

        return load_method_specs(names, self.checkpoint, self.objective)

    def method(self, name: str) -> Allocator:
        """One method."""
        from finlab.evaluation.method_specs import load_method_spec

        return load_method_spec(name, self.checkpoint, self.objective)


@dataclass(frozen=True)
class ClosedLoopRuns:
    """Runs in simulation."""

    methods: Names = "search"
    """Names with commas between; also on-board, U-CAT's own law at a fixed frequency, and a method with an
    objective of its own, such as search-effort."""
    runs: Count = 5
    """Runs of each, with other noise."""
    seed: Count = 0
    """Of the first run; the others follow on."""
    plant: Name = "mean"
    """One of mean, ripple, flexible, wake, inflow, offset."""
    figures: Folder = None
    """Existing folder for pictures."""

    def __post_init__(self) -> None:
        """Refuses before the runs what would fail after them."""
        check_positive(runs=self.runs)
        if self.figures is not None and not self.figures.is_dir():
            raise DataError(f"figures: expected a folder that exists, got {self.figures}")

    def swim(
        self, scenarios: Sequence[Scenario], run: MethodRun, controller: PathController = "waypoint"
    ) -> list[LoggedRun]:
        """Every scenario with every method and seed."""
        from finlab.evaluation.experiments.closed_loop_runs import run_all

        methods, seeds = run.methods(self.methods), range(self.seed, self.seed + self.runs)
        return run_all(scenarios, methods, seeds, self.plant, controller)

    def save(self, name: str, draw: Callable[[], Picture]) -> list[str]:
        """Draw into the folder, where one was named; returns the sentence that says so."""
        if self.figures is None:
            return []
        return [f"{draw().save(self.figures / f'{name}.png')}: written."]


def open_layouts(names: str) -> list[Layout]:
    """Layouts from their names or files, with commas between."""
    texts = [text.strip() for text in names.split(",") if text.strip()]
    if not texts:
        raise LayoutError(f"layouts: expected names or files with commas between (A,penta), got {names!r}")
    return [open_robot(text).layout for text in texts]


def check_folders(**paths: Path | None) -> None:
    """Refuse folders that cannot be one."""
    for name, path in paths.items():
        if path is not None and path.exists() and not path.is_dir():
            raise DataError(f"{name}: expected a folder, got the file {path}")
