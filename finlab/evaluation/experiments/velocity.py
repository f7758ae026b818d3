"""A robot keeps a speed and a depth, for power and error of the speed, as in the paper."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from finlab.errors import DataError
from finlab.evaluation.experiment import Experiment, paper_figures
from finlab.evaluation.experiments.closed_loop import POWER, depth_error, mean_rows, power_row
from finlab.evaluation.method_specs import load_method_specs
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.layout import load_layout
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
    runs: int = 5,
    duration: float = 30.0,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each speed and method, and one for each method over all speeds.

    Args:
        layout: a layout file or shipped name.
        methods: names as in eval wrench.
        runs: of each, with other noise.
        duration: of a run [s].
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of the first run's noise.
    """
    if not SETTLED_S < duration <= 3600.0:
        raise DataError(f"duration: expected more than {SETTLED_S:g} s and at most 3600 s, got {duration:g}")
    robot, specs = load_layout(layout), load_method_specs(methods, checkpoint)
    done: dict[tuple[float | None, str], list[Row]] = {}
    for speed, (name, method), k in progress(list(product(SPEEDS, specs.items(), range(runs))), "swim"):
        row = _row(ClosedLoop(robot, method.on(robot), straight(speed, duration), seed=seed + k).run())
        done.setdefault((speed, name), []).append(row)
        done.setdefault((None, name), []).append(row)
    rows = mean_rows("speed", done, None)
    base = {row["speed"]: row["inertial_w"] for row in rows if row["method"] == BASELINE}
    return [row | {"over_baseline": row["inertial_w"] / base[row["speed"]]} if base else row for row in rows]


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
        {"method": names[key], "over_baseline": row["inertial_w"] / base, **row}
        for key, row in figures.items()
    ]


experiment = Experiment(
    name="velocity",
    question="What power does it take to keep a speed and a depth, and how well are they kept?",
    columns=(
        Column("speed", "speed", "ratio", unit="m/s"),
        Column("method", "method", "code"),
        Column("runs", "runs", "count"),
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
