"""Robots, whole and with fins lost, keep a speed and a depth by the paper's PID controller and by
ours."""

from collections.abc import Sequence
from itertools import product

from finlab.errors import DataError
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, check_names, paper_figures
from finlab.research.evaluation.experiments import closed_loop
from finlab.research.evaluation.method_specs import load_method_specs
from finlab.research.evaluation.verdict import Comparison
from finlab.swim.control import CONTROLLERS
from finlab.swim.simulation import RunLog, straight

SPEEDS = (0.10, 0.15, 0.20)
"""The paper's speeds [m/s]."""
KEYS = ("layout", "lost", "speed", "controller", "method")
"""What a row is of."""
SETTLED_S = 10.0
"""After this time the start from rest is over [s]."""
BASELINE = "fixed_frequency"
"""Method that stands for the paper's baseline, of which it does not say whether the frequency
varies."""


def run(
    layouts: tuple[str, ...] = ("A", "B", "C", "D"),
    methods: tuple[str, ...] = ("dual", "mdn", "analytic", BASELINE),
    controllers: tuple[str, ...] = ("tracking", "velocity"),
    lost: tuple[int, ...] = (0, 1, 2),
    runs: int = 1,
    duration: float = 30.0,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each layout, number of lost fins, speed, controller and method, and one over all
    speeds. Raises DataError: a duration of no more than `SETTLED_S`, or over an hour.

    Args:
        layouts: names or files.
        methods: names as in eval wrench.
        controllers: tracking, velocity (the paper's), waypoint (the paper's of paths).
        lost: how many fins are lost, announced from the start; a robot that needs them is left out.
        runs: of each, with other noise.
        duration: of a run [s].
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of the first run's noise.
    """
    if not SETTLED_S < duration <= 3600.0:
        raise DataError(
            f"duration: expected more than {SETTLED_S:g} s and at most 3600 s, got {duration:g}"
        )
    check_names("controllers", controllers, CONTROLLERS)
    specs = load_method_specs(methods, checkpoint)
    paths = [(speed, straight(duration, speed)) for speed in SPEEDS]
    able, _ = closed_loop.with_losses(layouts, lost)
    cases = [
        ((robot.name, count, speed, law, name), closed_loop.SwimCase(robot, path, name, law, fins))
        for (robot, count, fins), (speed, path), law, name in product(
            able, paths, controllers, specs
        )
    ]
    done: dict[closed_loop.SwimKey, list[Row]] = {}
    for case, errors in closed_loop.repeated(
        specs, cases, range(seed, seed + runs), "velocity", _row
    ):
        for shown in (case, (*case[:2], None, *case[3:])):
            done.setdefault(shown, []).extend(errors)
    order = sorted(done, key=lambda case: (case[:2], case[2] is None))
    rows = closed_loop.mean_rows(KEYS, [(case, done[case]) for case in order])
    base = {
        case[:4]: row["inertial_w"]
        for case, row in zip(order, rows, strict=True)
        if case[4] == BASELINE
    }
    for case, row in zip(order, rows, strict=True) if base else ():
        row["over_baseline"] = row["inertial_w"] / base[case[:4]]
    return rows


def _row(log: RunLog) -> Row:
    """Errors of one run [m/s, m] and power [W]."""
    error = closed_loop.speed_error(log)
    return {
        "mae": float(error.mean()),
        "mae_settled": float(error[log.time >= SETTLED_S].mean()),
        "depth_rmse": closed_loop.depth_error(log.position, log.reference),
        **closed_loop.power_row(log),
    }


def _printed(_: Sequence[Row]) -> list[Row]:
    """Power and errors that the paper prints for its method and its baseline."""
    names = {"ours": "paper's method, printed", "baseline": "paper's baseline, printed"}
    about = {"layout": "in the pool", "lost": 0, "controller": "velocity"}
    figures = paper_figures()["velocity"]
    base = figures["baseline"]["inertial_w"]
    return [
        {**about, "method": names[key], "over_baseline": row["inertial_w"] / base, **row}
        for key, row in figures.items()
    ]


PRINTED_WORDS = {
    "inertial_w": "inertial power in W",
    "inertial_w_std": "spread of the inertial power over runs in W",
    "mae": "mean error of the speed in m/s",
    "mae_std": "spread of the error of the speed over runs in m/s",
}
"""Figures of the paper's table, in words."""


def _compared(rows: Sequence[Row]) -> list[Comparison]:
    """Each figure of the paper's table of power and speed beside those on layout A."""
    methods = {"baseline": BASELINE, "ours": "paper"}
    compared = []
    for name, figures in paper_figures()["velocity"].items():
        about = {"layout": "A", "lost": 0, "speed": None, "controller": "velocity"}
        about["method"] = methods[name]
        row = next((r for r in rows if about.items() <= r.items()), {})
        for key, printed in figures.items():
            interval = row.get(f"{key}_interval")
            what = f"{name}: {PRINTED_WORDS[key]}"
            compared.append(Comparison(what, printed, row.get(key), interval, closed_loop.POOL))
    return compared


experiment = Experiment(
    name="velocity",
    question="What power does it take to keep a speed and a depth, and how well are they kept?",
    columns=(
        Column("layout", "layout"),
        Column("lost", "fins lost", "count"),
        Column("speed", "speed", "ratio", unit="m/s"),
        Column("controller", "controller", "code"),
        Column("method", "method", "code"),
        Column("runs", "runs", "count"),
        Column("mae", "MAE of the speed", "metres", "mae_interval", unit="m/s"),
        Column("mae_settled", "after 10 s", "metres", unit="m/s"),
        Column("depth_rmse", "depth RMSE", "metres", unit="m"),
        *closed_loop.POWER,
        Column("over_baseline", "inertial power over fixed_frequency", "ratio"),
    ),
    run=run,
    note="Runs from rest; rows without a speed are over all speeds. Inertial power is the paper's "
    "sum of I alpha omega, of its magnitudes. The paper's runs took place in a pool.",
    quick={
        "layouts": ("A",),
        "methods": ("dual", BASELINE),
        "controllers": ("velocity",),
        "lost": (0,),
        "runs": 2,
    },
    usual={
        "methods": ("paper", BASELINE, "dual"),
        "controllers": ("velocity",),
        "lost": (0,),
        "runs": 5,
    },
    full={"controllers": ("velocity", "tracking"), "lost": (0, 1, 2)},
    pieces=("layouts", "controllers", "lost"),
    measures=(*closed_loop.MEASURES, "finlab/research/evaluation/experiments/velocity.py"),
    probe={"runs": 1, "duration": 11.0},
    compared=_compared,
    printed=_printed,
)
