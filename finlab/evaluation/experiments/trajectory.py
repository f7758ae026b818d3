"""Several layouts follow a trajectory with one checkpoint, by the paper's controller and by ours."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product

from finlab.control import controller_of
from finlab.evaluation.document import Column, Row
from finlab.evaluation.experiment import Experiment, paper_figures
from finlab.evaluation.experiments.closed_loop import (
    ABOUT_ERRORS,
    ERRORS,
    POWER,
    WHO,
    first_lost,
    follow_row,
    mean_rows,
)
from finlab.evaluation.method_specs import MethodSpec, load_method_specs
from finlab.executor import map_parts
from finlab.files.worker import in_worker
from finlab.layout import Layout, load_layout
from finlab.sim import ClosedLoop, Trajectory, make_trajectory


def run(
    layouts: tuple[str, ...] = ("A", "B", "C", "D"),
    trajectory: str = "lissajous",
    methods: tuple[str, ...] = ("dual", "paper"),
    controllers: tuple[str, ...] = ("tracking", "waypoint"),
    lost: int = 0,
    runs: int = 3,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each layout, method and controller, and one for each over all layouts.

    Args:
        layouts: names or files.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x, y, z.
        methods: names as in eval wrench.
        controllers: tracking, waypoint (the paper's), velocity.
        lost: so many fins are lost from the start, the first without which it can still be steered.
        runs: of each, with other noise.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of the first run's noise.
    """
    robots = [in_worker(load_layout, name) for name in layouts]
    path = in_worker(make_trajectory, trajectory)
    specs = load_method_specs(methods, checkpoint)
    done: dict[tuple[str, str, str], list[Row]] = {}
    swims = list(product(robots, specs, controllers, range(seed, seed + runs)))
    errors = map_parts(partial(_swim, path, specs, lost), swims, "trajectory", "swim")
    for (robot, name, control, _), row in zip(swims, errors, strict=True):
        for group in (robot.name, "all"):
            done.setdefault((group, name, control), []).append(row)
    return mean_rows("layout", done, "all")


def _swim(
    path: Trajectory, methods: Mapping[str, MethodSpec], lost: int, swim: tuple[Layout, str, str, int]
) -> Row:
    """Errors of one swim: its robot, method, controller and seed."""
    robot, name, control, seed = swim
    gone = [(fin, 0.0) for fin in first_lost(robot, lost)]
    controller = controller_of(control, robot)
    loop = ClosedLoop(robot, methods[name].on(robot), path, controller, failures=gone, seed=seed)
    return follow_row(loop.run())


def _printed(rows: Sequence[Row]) -> list[Row]:
    table, swum = paper_figures()["trajectory"], {row["layout"] for row in rows}
    return [
        {"layout": name, "method": "paper's method, printed", "controller": "waypoint", **row}
        for name, row in table.items()
        if name in swum
    ]


experiment = Experiment(
    name="trajectory",
    question="How closely do the paper's layouts follow a path, with the same controller for all?",
    columns=(
        Column("layout", "layout"),
        *WHO,
        *ERRORS,
        *POWER,
    ),
    run=run,
    note=f"{ABOUT_ERRORS} The paper's runs took place in another simulator, on paths that it does not print.",
    quick={"layouts": ("A", "C"), "methods": ("dual",), "runs": 1},
    full={"runs": 2},
    printed=_printed,
)
