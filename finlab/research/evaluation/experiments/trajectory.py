"""Several layouts, whole and with fins lost, follow a trajectory by the paper's controller and by
ours."""

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from finlab.arrays import Array
from finlab.files.worker import in_worker
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, check_names, paper_figures
from finlab.research.evaluation.experiments.closed_loop import (
    ABOUT_ERRORS,
    ERRORS,
    MEASURES,
    OTHER_SIMULATOR,
    POOL,
    POWER,
    PRINTED_KEYS,
    SwimCase,
    SwimKey,
    follow_row,
    mean_rows,
    repeated,
    with_losses,
)
from finlab.research.evaluation.method_specs import load_method_specs
from finlab.research.evaluation.verdict import Comparison
from finlab.swim.control import CONTROLLERS
from finlab.swim.simulation import RunLog, make_trajectory
from finlab.swim.simulation.swim_pictures import paths_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PATH_EVERY = 5
"""Ticks between the points of a path that a row has."""


def run(
    layouts: tuple[str, ...] = ("A", "B", "C", "D"),
    trajectory: str = "lissajous",
    methods: tuple[str, ...] = ("dual", "paper"),
    controllers: tuple[str, ...] = ("tracking", "waypoint"),
    lost: tuple[int, ...] = (0, 1, 2),
    runs: int = 1,
    checkpoint: str | None = None,
    paths: bool = False,
    seed: int = 0,
) -> list[Row]:
    """One row for each layout, number of lost fins, controller and method, and one over all
    layouts.

    Args:
        layouts: names or files.
        trajectory: circle, lissajous, square, dive, straight, station, or a CSV file with t, x, y,
        z.
        methods: names as in eval wrench.
        controllers: tracking, waypoint (the paper's), velocity (the paper's, which keeps no
        course).
        lost: how many fins are lost, announced from the start; a robot that needs them is left out.
        runs: of each, with other noise.
        checkpoint: of the learned methods, a shipped name or a folder.
        paths: whether rows have the first run's path (in the JSON alone).
        seed: of the first run's noise.
    """
    check_names("controllers", controllers, CONTROLLERS)
    path = in_worker(make_trajectory, trajectory)
    specs = load_method_specs(methods, checkpoint)
    able, needed = with_losses(layouts, lost)
    cases = [
        ((robot.name, count, law, name), SwimCase(robot, path, name, law, fins))
        for (robot, count, fins), law, name in product(able, controllers, specs)
    ]
    row_of = _with_path if paths else follow_row
    done = repeated(specs, cases, range(seed, seed + runs), "trajectory", row_of)
    keys = ("layout", "lost", "controller", "method")
    every = dict[SwimKey, list[Row]]()
    rows = mean_rows(keys, done)
    for row, (case, errors) in zip(rows, done, strict=True):
        row |= {"path": errors[0]["path"]} if paths else {}
        every.setdefault(("all", *case[1:]), []).extend(errors)
    rows += [
        {"layout": robot.name, "lost": n, "method": "cannot be steered"} for robot, n in needed
    ]
    return rows + mean_rows(keys, sorted(every.items(), key=lambda each: each[0][1]))


def _with_path(log: RunLog) -> Row:
    """Errors, with times [s], and where the robot was and should have been [m]."""
    columns = {"t": log.time, "position": log.position, "reference": log.reference}
    path = {name: np.round(each[::PATH_EVERY], 4).tolist() for name, each in columns.items()}
    return follow_row(log) | {"path": path}


def _picture(rows: Sequence[Row]) -> "Figure":
    """The paths of all rows that have one, a column for each layout."""
    swims: dict[str, tuple[Array, Array, dict[str, tuple[Array, Array]]]] = {}
    for row in [row for row in rows if "path" in row]:
        time, position, reference = (
            np.array(row["path"][key]) for key in ("t", "position", "reference")
        )
        paths = swims.setdefault(row["layout"], (time, reference, {}))[2]
        paths[f"{row['controller']} by {row['method']}, {row['lost']} lost"] = time, position
    return paths_picture(swims)


def _printed(rows: Sequence[Row]) -> list[Row]:
    """Errors that the paper prints for the layouts of `rows`, and those of its pool."""
    figures = paper_figures()
    layouts = {row["layout"] for row in rows}
    about = {"controller": "waypoint", "method": "paper's method, printed"}
    healthy = [
        {"layout": name, "lost": 0} | about | row for name, row in figures["trajectory"].items()
    ]
    pool = [
        {"layout": "in the pool", "lost": count} | about | table["ours"]
        for count, table in enumerate(figures["fault_tolerance"].values())
    ]
    return [row for row in healthy if row["layout"] in layouts] + pool


def _compared(rows: Sequence[Row]) -> list[Comparison]:
    """Each figure of the paper's tables of paths, whole and with fins lost, beside ours by its
    method and controller."""
    figures = paper_figures()
    wanted = [(layout, 0, row, OTHER_SIMULATOR) for layout, row in figures["trajectory"].items()]
    for count, table in enumerate(figures["fault_tolerance"].values()):
        # The robot of its pool has layout A.
        wanted.append(("A", count, table["ours"], POOL))
    compared = []
    for layout, count, printed, obstacle in wanted:
        about = {"layout": layout, "lost": count, "controller": "waypoint", "method": "paper"}
        row = next((r for r in rows if about.items() <= r.items()), {})
        place = "in the pool" if obstacle == POOL else f"layout {layout}"
        for key, words in PRINTED_KEYS.items():
            what = f"{place}, {count} lost: {words} in m"
            interval = row.get(f"{key}_interval")
            compared.append(Comparison(what, printed[key], row.get(key), interval, obstacle))
    return compared


experiment = Experiment(
    name="trajectory",
    question="How closely do the paper's layouts follow a path, whole and with fins lost, by its "
    "waypoint controller and by ours?",
    columns=(
        Column("layout", "layout"),
        Column("lost", "fins lost", "count"),
        Column("controller", "controller", "code"),
        Column("method", "method", "code"),
        Column("runs", "runs", "count"),
        *ERRORS,
        *POWER,
    ),
    run=run,
    note=f"{ABOUT_ERRORS} The paper's runs on A to D took place in another simulator, those with "
    "lost fins in a pool, on paths that it does not print. Lost are the first fins without which "
    "a robot can be steered.",
    quick={
        "layouts": ("A", "C"),
        "trajectory": "circle",
        "methods": ("dual", "fixed_frequency"),
        "controllers": ("waypoint",),
        "lost": (0, 1),
        "runs": 2,
    },
    usual={
        "trajectory": "circle",
        "methods": ("paper", "fixed_frequency", "dual"),
        "controllers": ("waypoint",),
        "runs": 5,
    },
    full={"trajectory": "lissajous", "controllers": ("waypoint", "tracking")},
    pieces=("methods", "controllers", "lost"),
    measures=(*MEASURES, "finlab/research/evaluation/experiments/trajectory.py"),
    probe={"layouts": ("A",), "runs": 1},
    order=lambda row: (
        row["layout"] == "all",
        row["layout"],
        row["lost"],
        row.get("controller", ""),
        row["method"],
    ),
    compared=_compared,
    printed=_printed,
    picture=_picture,
    for_picture={"paths": True},
)
