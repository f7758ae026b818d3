"""Several layouts follow a trajectory with one controller and one checkpoint, as in the paper."""

from collections.abc import Sequence
from itertools import product

from finlab.evaluation.experiment import Experiment, paper_figures
from finlab.evaluation.experiments.closed_loop import ABOUT_ERRORS, ERRORS, POWER, follow_row, mean_rows
from finlab.evaluation.method_specs import load_method_specs
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.files.worker import in_worker
from finlab.layout import load_layout
from finlab.sim import ClosedLoop, make_trajectory


def run(
    layouts: tuple[str, ...] = ("A", "B", "C", "D"),
    trajectory: str = "lissajous",
    methods: tuple[str, ...] = ("dual", "paper"),
    runs: int = 3,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each layout and method, and one for each method over all layouts.

    Args:
        layouts: names or files.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x, y, z.
        methods: names as in eval wrench.
        runs: of each, with other noise.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of the first run's noise.
    """
    robots = [in_worker(load_layout, name) for name in layouts]
    path = in_worker(make_trajectory, trajectory)
    specs = load_method_specs(methods, checkpoint)
    done: dict[tuple[str, str], list[Row]] = {}
    for robot, (name, method), k in progress(list(product(robots, specs.items(), range(runs))), "swim"):
        row = follow_row(ClosedLoop(robot, method.on(robot), path, seed=seed + k).run())
        done.setdefault((robot.name, name), []).append(row)
        done.setdefault(("all", name), []).append(row)
    return mean_rows("layout", done, "all")


def _printed(rows: Sequence[Row]) -> list[Row]:
    table, swum = paper_figures()["trajectory"], {row["layout"] for row in rows}
    return [
        {"layout": name, "method": "paper's method, printed", **row}
        for name, row in table.items()
        if name in swum
    ]


experiment = Experiment(
    name="trajectory",
    question="How closely do the paper's layouts follow a path, with one controller for all?",
    columns=(
        Column("layout", "layout"),
        Column("method", "method", "code"),
        Column("runs", "runs", "count"),
        *ERRORS,
        *POWER,
    ),
    run=run,
    note=f"{ABOUT_ERRORS} The paper's runs took place in another simulator, on paths that it does not print.",
    quick={"layouts": ("A", "C"), "methods": ("dual",), "runs": 1},
    full={"runs": 2},
    printed=_printed,
)
