"""Closed loop: trajectories on the paper's layouts, lost fins, and speed against power."""

from collections.abc import Sequence

from finlab.evaluation.experiments.faults import fault_verdict
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.plots.closed_loop_experiments import draw_faults, draw_layouts
from finlab.evaluation.report.document import Block, Column, Figure, Row, Table, method_row, printed_row
from finlab.evaluation.report.results import Results
from finlab.evaluation.report.work import tracks_of_columns

ERRORS = (
    Column("ate", "ATE [m]", "metres"),
    Column("ate_std", "spread", "error"),
    Column("rte", "RTE [m]", "metres"),
    Column("depth_rmse", "depth RMSE [m]", "metres"),
)
PRINTED = {"ours": "paper's method, printed", "baseline": "paper's baseline, printed"}
WHAT = (Column("method", "method"), Column("runs", "runs", "count"))
FAULT_WORDS = {"healthy": "healthy", "one_fin": "one fin lost", "two_fins": "two fins lost"}


def closed_loop_blocks(results: Results) -> list[Block]:
    """Every experiment that has run."""
    rows = results.tables
    blocks: list[Block] = []
    if "trajectory" in rows:
        blocks += _trajectory(rows["trajectory"], results)
    if "faults" in rows:
        blocks += _faults(rows["faults"])
    if "velocity" in rows:
        blocks += _velocity(rows["velocity"])
    return [
        "## Closed loop",
        (
            "A robot with six degrees of freedom swims in simulation, sensor noise and servo lag included; "
            "the controllers are the paper's. The paper's runs took place in another simulator "
            "(trajectories) and in a pool (faults, speeds), on paths that it does not describe: its "
            "figures stand beside ours, not against them. All methods here were given the law `drag` by "
            "which the simulated fins push; `on-board` is the robot's own law at a fixed frequency."
        ),
        *blocks,
    ]


def _trajectory(rows: Sequence[Row], results: Results) -> list[Block]:
    printed = paper_figures()["trajectory"]
    shown: list[Row] = []
    for layout in dict.fromkeys(row["layout"] for row in rows):
        shown += [method_row(row) for row in rows if row["layout"] == layout]
        shown.append(printed_row(PRINTED["ours"], printed[layout], layout=layout))
    columns = (Column("layout", "layout"), *WHAT, *ERRORS)
    return [
        "### Trajectories",
        Figure.drawn(
            "paths",
            draw_layouts(tracks_of_columns(results.columns(results.plan.tables["trajectory"][()])), rows),
            "One run on each of the paper's layouts: from above, and its depth over time.",
        ),
        Table(columns, shown),
    ]


def _faults(rows: Sequence[Row]) -> list[Block]:
    printed = paper_figures()["fault_tolerance"]
    swum = [{**method_row(row), "verdict": fault_verdict(row)} for row in rows if row["controllable"]]
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
        Column("verdict", "verdict"),
    )
    hopeless = [row["fault"] for row in rows if not row["controllable"]]
    beside = {f"{FAULT_WORDS[k]} (printed)": v["ours"]["ate"] for k, v in printed.items()}
    blocks: list[Block] = [
        "### Lost fins",
        Figure.drawn("faults", draw_faults(rows, beside), "Layout A. Diamonds: the paper's pool."),
        Table(columns, [*swum, *theirs]),
    ]
    if hopeless:
        blocks += [
            "Not swum, since the fins that are left cannot give surge, heave and yaw independently:",
            "\n".join(f"- {fault}" for fault in hopeless),
        ]
    return blocks


def _velocity(rows: Sequence[Row]) -> list[Block]:
    printed = paper_figures()["velocity"]
    shown = [{**method_row(row), "speed": row["speed"] or "all"} for row in rows]
    shown += [printed_row(PRINTED[method], values, speed="all") for method, values in printed.items()]
    columns = (
        Column("speed", "speed [m/s]"),
        *WHAT,
        Column("inertial_w", "inertial power [W]", "three"),
        Column("inertial_w_std", "spread", "error"),
        Column("torque_w", "torque power [W]", "three"),
        Column("mae", "speed error [m/s]", "metres"),
        Column("mae_std", "spread", "error"),
        Column("depth_rmse", "depth RMSE [m]", "metres"),
    )
    return ["### Speed and power", Table(columns, shown)]
