"""A robot keeps a speed and a depth, for power and error of the speed, as in the paper."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product

import numpy as np

from finlab.control import controller_of
from finlab.errors import DataError
from finlab.evaluation.document import Column, Row
from finlab.evaluation.experiment import Experiment, paper_figures
from finlab.evaluation.experiments.closed_loop import (
    POWER,
    WHO,
    depth_error,
    first_lost,
    mean_rows,
    power_row,
)
from finlab.evaluation.method_specs import MethodSpec, load_method_specs
from finlab.executor import map_parts
from finlab.files.worker import in_worker
from finlab.layout import Layout, load_layout
from finlab.sim import ClosedLoop, RunLog, straight

SPEEDS = (0.10, 0.15, 0.20)
"""The paper's speeds [m/s]."""
SETTLED_S = 10.0
"""After this time the start from rest is over [s]."""


BASELINE = "fixed_frequency"
"""Method that stands for the paper's baseline, of which it does not say whether the frequency varies."""


def run(
    layout: str = "A",
    methods: tuple[str, ...] = ("dual", "mdn", "analytic", BASELINE),
    controllers: tuple[str, ...] = ("tracking", "velocity"),
    lost: int = 0,
    runs: int = 5,
    duration: float = 30.0,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each speed, method and controller, and one for each over all speeds.

    Args:
        layout: a layout file or shipped name.
        methods: names as in eval wrench.
        controllers: tracking, velocity (the paper's).
        lost: so many fins are lost from the start, the first without which it can still be steered.
        runs: of each, with other noise.
        duration: of a run [s].
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of the first run's noise.
    """
    if not SETTLED_S < duration <= 3600.0:
        raise DataError(f"duration: expected more than {SETTLED_S:g} s and at most 3600 s, got {duration:g}")
    robot, specs = in_worker(load_layout, layout), load_method_specs(methods, checkpoint)
    done: dict[tuple[float | None, str, str], list[Row]] = {}
    swims = list(product(SPEEDS, specs, controllers, range(seed, seed + runs)))
    errors = map_parts(partial(_swim, robot, specs, duration, lost), swims, "velocity", "swim")
    for (speed, name, control, _), row in zip(swims, errors, strict=True):
        for group in (speed, None):
            done.setdefault((group, name, control), []).append(row)
    rows = mean_rows("speed", done, None)
    base = {(row["speed"], row["controller"]): row["inertial_w"] for row in rows if row["method"] == BASELINE}
    for row in rows if base else ():
        row["over_baseline"] = row["inertial_w"] / base[row["speed"], row["controller"]]
    return rows


def _swim(
    robot: Layout,
    methods: Mapping[str, MethodSpec],
    duration: float,
    lost: int,
    swim: tuple[float, str, str, int],
) -> Row:
    """Errors and power of one swim: its speed, method, controller and seed."""
    speed, name, control, seed = swim
    gone = [(fin, 0.0) for fin in first_lost(robot, lost)]
    path, controller = straight(speed, duration), controller_of(control, robot)
    loop = ClosedLoop(robot, methods[name].on(robot), path, controller, failures=gone, seed=seed)
    return _row(loop.run())


def _row(log: RunLog) -> Row:
    """Errors of one run [m/s, m] and power [W]."""
    error = np.abs(log.motion[:, 0] - log.reference_surge)
    return {
        "mae": float(error.mean()),
        "mae_settled": float(error[log.time >= SETTLED_S].mean()),
        "depth_rmse": depth_error(log.position, log.reference),
        **power_row(log),
    }


def _printed(rows: Sequence[Row]) -> list[Row]:
    names = {"ours": "paper's method, printed", "baseline": "paper's baseline, printed"}
    figures = paper_figures()["velocity"]
    base = figures["baseline"]["inertial_w"]
    return [
        {"method": names[key], "controller": "velocity", "over_baseline": row["inertial_w"] / base, **row}
        for key, row in figures.items()
    ]


experiment = Experiment(
    name="velocity",
    question="What power does it take to keep a speed and a depth, and how well are they kept?",
    columns=(
        Column("speed", "speed", "ratio", unit="m/s"),
        *WHO,
        Column("mae", "MAE of the speed", "metres", unit="m/s"),
        Column("mae_std", "spread", "error", unit="m/s"),
        Column("mae_settled", "after 10 s", "metres", unit="m/s"),
        Column("depth_rmse", "depth RMSE", "metres", unit="m"),
        *POWER,
        Column("over_baseline", "inertial power over fixed_frequency", "ratio"),
    ),
    run=run,
    note="Runs from rest; rows without a speed are over all speeds. Inertial power is the paper's sum of I "
    "alpha omega, of its magnitudes. The paper's runs took place in a pool; `fixed_frequency` stands for its "
    "baseline, of which it does not say whether the frequency varies.",
    quick={"runs": 1},
    printed=_printed,
)
