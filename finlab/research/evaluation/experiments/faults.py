"""The paper's fault experiment: a trajectory with fins lost from the start, or on the way."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from finlab.files.worker import in_worker
from finlab.layout import Layout, load_layout
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, paper_figures
from finlab.research.evaluation.experiments.closed_loop import (
    ABOUT_ERRORS,
    ERRORS,
    LOST_M,
    MEASURES,
    POOL,
    POWER,
    PRINTED_KEYS,
    SwimCase,
    follow_row,
    mean_rows,
    repeated,
)
from finlab.research.evaluation.method_specs import load_method_specs
from finlab.research.evaluation.verdict import Comparison
from finlab.swim.control import steers
from finlab.swim.simulation import make_trajectory

HEALTHY = "healthy"
ALLOWED = 1.15
"""Growth of the error over the healthy robot's that one lost fin should not exceed."""


@dataclass(frozen=True)
class LossCase:
    """Names of fins that are lost, when [s], and whether the others still give surge, heave and yaw
    independently."""

    fins: tuple[str, ...]
    time_s: float
    controllable: bool

    @property
    def label(self) -> str:
        """Which fins are lost, and when, in words; `HEALTHY` where none is."""
        when = f" at {self.time_s:.0f} s" if self.time_s > 0 else ""
        return f"{' + '.join(self.fins)} lost{when}" if self.fins else HEALTHY


def loss_cases(layout: Layout, half_way_s: float) -> list[LossCase]:
    """The healthy robot, each fin and each pair lost from the start, and each fin at a time [s];
    never all."""
    names = layout.names
    lost = [((), 0.0), *(((name,), 0.0) for name in names)]
    lost += [(pair, 0.0) for pair in combinations(names, 2)] + [
        ((name,), half_way_s) for name in names
    ]
    return [
        LossCase(tuple(fins), time, steers(layout, tuple(fins)))
        for fins, time in lost
        if len(fins) < len(names)
    ]


def run(
    layout: str = "A",
    trajectory: str = "circle",
    methods: tuple[str, ...] = ("dual", "analytic"),
    controller: str = "tracking",
    runs: int = 3,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each fault and method; those that leave the robot uncontrollable are not swum.

    Args:
        layout: a layout file or shipped name.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x,
        y, z.
        methods: names as in eval wrench.
        controller: tracking, waypoint (the paper's), velocity.
        runs: of each, with other noise.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of the first run's noise.
    """
    robot = in_worker(load_layout, layout)
    path = in_worker(make_trajectory, trajectory)
    losses = loss_cases(robot, path.duration_s / 2)
    specs = load_method_specs(methods, checkpoint)
    cases = []
    for loss in losses:
        if not loss.controllable:
            continue
        for name in specs:
            swim = SwimCase(robot, path, name, controller, loss.fins, loss.time_s)
            cases.append(((loss.label, name), swim))
    done = repeated(specs, cases, range(seed, seed + runs), "faults", follow_row)
    rows = mean_rows(("fault", "method"), done)
    healthy = {row["method"]: row["ate"] for row in rows if row["fault"] == HEALTHY}
    for row, (_, errors_of) in zip(rows, done, strict=True):
        row["over_healthy"] = row["ate"] / healthy[row["method"]]
        row["kept"] = "yes" if max(single["max"] for single in errors_of) < LOST_M else "no"
    not_swum = [loss.label for loss in losses if not loss.controllable]
    return rows + [{"fault": label, "kept": "not swum"} for label in not_swum]


def _printed(_: Sequence[Row]) -> list[Row]:
    """Errors that the paper prints for each fault, by its method and by its baseline."""
    methods = {"ours": "paper's method, printed", "baseline": "paper's baseline, printed"}
    printed = []
    for fault, table in paper_figures()["fault_tolerance"].items():
        for name, row in table.items():
            printed.append({"fault": fault.replace("_", " "), "method": methods[name], **row})
    return printed


def _compared(rows: Sequence[Row]) -> list[Comparison]:
    """Each figure that the paper prints of its baseline, whole and with one fin lost, which it does
    not name: beside the first that can be lost. Those of its method stand in `trajectory`."""
    ours = [row for row in rows if row.get("method") == "fixed_frequency"]
    healthy = [row for row in ours if row["fault"] == HEALTHY]
    damaged = [row for row in ours if row["fault"] != HEALTHY]
    compared = []
    for fault, some in (("healthy", healthy), ("one_fin", damaged)):
        row = some[0] if some else {}
        for key, printed in paper_figures()["fault_tolerance"][fault]["baseline"].items():
            what = f"baseline, {fault.replace('_', ' ')}: {PRINTED_KEYS[key]} in m"
            interval = row.get(f"{key}_interval")
            compared.append(Comparison(what, printed, row.get(key), interval, POOL))
    return compared


experiment = Experiment(
    name="faults",
    question="How closely does a robot follow a path when fins are lost, from the start or "
    "half-way?",
    columns=(
        Column("fault", "fault"),
        Column("method", "method", "code"),
        Column("runs", "runs", "count"),
        *ERRORS,
        Column("over_healthy", "over healthy", "ratio"),
        Column("kept", "path kept"),
        *POWER,
    ),
    run=run,
    note=f"{ABOUT_ERRORS} Losses are announced. The path is kept where no run was ever farther "
    f"than {LOST_M:g} m away; not swum: the fins that are left cannot give surge, heave and yaw "
    f"independently. Aimed at: one lost fin lets the error grow to at most {ALLOWED} times. The "
    "paper's runs took place in a pool.",
    quick={"runs": 1, "methods": ("dual",), "controller": "waypoint"},
    usual={"runs": 5, "methods": ("dual", "fixed_frequency", "analytic"), "controller": "waypoint"},
    pieces=("methods",),
    measures=(*MEASURES, "finlab/research/evaluation/experiments/faults.py"),
    probe={"runs": 1},
    compared=_compared,
    printed=_printed,
)
