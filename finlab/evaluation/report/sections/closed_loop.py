"""Closed loop: trajectories on the paper's layouts, lost fins, and speed against power."""

from collections.abc import Sequence

from finlab.evaluation.experiments.closed_loop_runs import LOST_M, RTE_DELTA_S
from finlab.evaluation.experiments.faults import ALLOWED, fault_verdict
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.plots.closed_loop_experiments import Track, draw_faults, draw_layouts
from finlab.evaluation.report.document import Block, Column, Figure, Row, Table, method_row, printed_row

POWER = (
    Column("inertial_w", "inertial power [W]", "three"),
    Column("torque_w", "torque power [W]", "three"),
    Column("driving_w", "with motor losses [W]", "three"),
)
ERRORS = (
    Column("ate", "ATE [m]", "metres"),
    Column("ate_std", "spread", "error"),
    Column("rte", "RTE [m]", "metres"),
    Column("depth_rmse", "depth RMSE [m]", "metres"),
)
PRINTED = {"ours": "paper's method, printed", "baseline": "paper's baseline, printed"}
WHAT = (Column("method", "method"), Column("runs", "runs", "count"))
COMPARED = ("inertial_w", "torque_w", "driving_w", "mae")
"""What a speed's rows are compared by with the baseline's."""
FAULT_WORDS = {"healthy": "healthy", "one_fin": "one fin lost", "two_fins": "two fins lost"}


INTRODUCTION = (
    "## Closed loop",
    (
        "A robot with six degrees of freedom swims in simulation, sensor noise and servo lag included. "
        "Trajectories, faults and speeds are swum with controllers after the two of the paper where no "
        "other is named, hard days with our own. The paper's runs took place in another simulator "
        "(trajectories) and in a pool (faults, on a circle; speeds). It prints neither the size and speed of "
        "the paths nor a unit of its errors, which are taken for metres: its figures stand beside ours, not "
        "against them. Its layouts A to D are read with the table's y ahead and its angle as the azimuth of "
        "the shaft; with x ahead, D could not surge, or, were the angle that of the thrust, B not yaw. All "
        "methods but `paper` were given the laws by which the simulated fins push in plant `mean`, and none "
        "the soft tips of plant `flexible`; `on-board` is U-CAT's own pseudo-inverse at a fixed frequency, "
        "as far as it is published."
    ),
)
"""What all experiments share."""


def trajectory_blocks(rows: Sequence[Row], tracks: Sequence[Track] = ()) -> list[Block]:
    """Several layouts along one trajectory; tracks for the picture."""
    printed = paper_figures()["trajectory"]
    shown: list[Row] = []
    for layout in dict.fromkeys(row["layout"] for row in rows):
        shown += [_swum(row) for row in rows if row["layout"] == layout]
        if layout in printed:
            shown.append(printed_row(PRINTED["ours"], printed[layout], layout=layout))
    columns = (Column("layout", "layout"), *WHAT, *ERRORS, Column("max", "farthest [m]", "metres"), *POWER)
    return [
        "### Trajectories",
        Figure(
            "paths",
            lambda: draw_layouts(tracks, rows),
            "One run on each of the paper's layouts: from above, and its depth over time.",
        ),
        Table(columns, shown),
        (
            "*Errors over whole runs from rest, mean and spread over runs; same world frame and clock, "
            f"nothing aligned; RTE over {RTE_DELTA_S:g} s, all pairs. A robot that was ever farther than "
            f"{LOST_M:g} m away has lost its reference.*"
        ),
    ]


def fault_blocks(rows: Sequence[Row]) -> list[Block]:
    """Each fin and pair lost, from the start or on the way."""
    printed = paper_figures()["fault_tolerance"]
    swum = [{**_swum(row), "verdict": fault_verdict(row)} for row in rows if row["controllable"]]
    theirs = [
        printed_row(PRINTED[method], values, fault=FAULT_WORDS[fault])
        for fault, methods in printed.items()
        for method, values in methods.items()
    ]
    columns = (
        Column("fault", "lost fins"),
        *WHAT,
        *ERRORS,
        Column("ate_over_healthy", "over healthy", "ratio"),
        Column("driving_w", "power with motor losses [W]", "three"),
        Column("verdict", "verdict"),
    )
    hopeless = [row["fault"] for row in rows if not row["controllable"]]
    beside = {f"{FAULT_WORDS[k]} (printed)": v["ours"]["ate"] for k, v in printed.items()}
    blocks: list[Block] = [
        "### Lost fins",
        Figure("faults", lambda: draw_faults(rows, beside), "Layout A. Diamonds: the paper's pool."),
        Table(columns, [*swum, *theirs]),
        (
            "*Over healthy: over the error of the same method with all fins and the same noise. Verdict: "
            f"beside {ALLOWED:g} times that error, a bound of ours. A ratio below 1 does not say that it "
            "helps to lose fins: the fins that are left turn and beat otherwise, and a single run has no "
            "interval.*"
        ),
    ]
    if hopeless:
        blocks += [
            "Not swum, since the fins that are left cannot give surge, heave and yaw independently:",
            "\n".join(f"- {fault}" for fault in hopeless),
        ]
    return blocks


def velocity_blocks(rows: Sequence[Row], baseline: str = "analytic") -> list[Block]:
    """Power and error of the speed, beside a baseline's."""
    printed = paper_figures()["velocity"]
    reference = {row["speed"]: row for row in rows if row["method"] == baseline}
    shown = []
    for row in rows:
        change: Row = {}
        if row["method"] != baseline and (other := reference.get(row["speed"])):
            change = {f"{key}_change": row[key] / other[key] - 1.0 for key in COMPARED}
        shown.append({**_swum(row), "speed": row["speed"] or "all", **change})
    shown += [printed_row(PRINTED[method], values, speed="all") for method, values in printed.items()]
    columns = (
        Column("speed", "speed [m/s]"),
        *WHAT,
        Column("inertial_w", "inertial power [W]", "three"),
        Column("inertial_w_std", "spread", "error"),
        Column("inertial_w_change", f"to {baseline}", "change"),
        Column("torque_w", "torque power [W]", "three"),
        Column("torque_w_change", f"to {baseline}", "change"),
        Column("driving_w", "with motor losses [W]", "three"),
        Column("driving_w_change", f"to {baseline}", "change"),
        Column("mae", "speed error [m/s]", "metres"),
        Column("mae_std", "spread", "error"),
        Column("mae_change", f"to {baseline}", "change"),
        Column("mae_settled", "from 10 s", "metres"),
        Column("depth_rmse", "depth RMSE [m]", "metres"),
    )
    note = (
        "*Runs from rest. Inertial power is the paper's sum of I alpha omega, here of its magnitudes; torque "
        "power adds the water that fins carry and their drag, and the last one the heat in their motors.*"
    )
    return ["### Speed and power", Table(columns, shown), note]


def _swum(row: Row) -> Row:
    """A row with its method's name as code, and no spread where there was a single run."""
    return {k: v for k, v in method_row(row).items() if row["runs"] > 1 or not k.endswith("_std")}
