"""Robots fitted to swims: what allocations for them miss, and what their closed loops cost."""

from collections.abc import Sequence

from finlab.evaluation.report.document import Block, Column, Row, Table

ERRORS = (
    Column("plant", "plant", "code"),
    Column("used", "used besides"),
    Column("drawn_mean", "err_norm as drawn, mean", "error"),
    Column("fitted_mean", "fitted", "error"),
    Column("true_mean", "true model", "error"),
    Column("times_smaller", "times smaller", "three"),
    Column("drawn_median", "median as drawn", "error"),
    Column("fitted_median", "fitted", "error"),
    Column("trusted", "trusted"),
    Column("fit_s", "fit [s]", "three"),
)
LOOPS = (
    Column("plant", "plant", "code"),
    Column("believed", "believed"),
    Column("ate", "ATE [m]", "metres"),
    Column("depth_rmse", "depth RMSE [m]", "metres"),
    Column("depth_rmse_over_true", "over true model", "ratio", "depth_rmse_over_true_interval"),
    Column("depth_under_way", "under way [m]", "metres"),
    Column("depth_under_way_over_true", "over true model", "ratio", "depth_under_way_over_true_interval"),
    Column("torque_w", "torque power [W]", "three"),
    Column("torque_w_over_true", "over true model", "ratio", "torque_w_over_true_interval"),
)


def robot_fit_blocks(rows: Sequence[Row], layout: str, targets: int, runs: int) -> list[Block]:
    """The whole section."""
    loops = [
        {"plant": row["plant"], "believed": which, **loop}
        for row in rows
        for which, loop in row["loops"].items()
    ]
    return [
        "## Fitted robots",
        (
            f"Layout {layout} swam five minutes of excitation on each plant, with sensor noise, and was "
            f"fitted. {targets} wrenches of random commands are asked of the layout as drawn, of the fitted "
            "one and of the true model, at random speeds through the water; the error is that of what fins "
            "then truly give. The true model is a layout made from the plant itself, as far as a layout can "
            "describe it."
        ),
        Table(ERRORS, rows),
        (
            f"Closed loops: {runs} circles from rest with each layout that the allocator believes, sensors "
            "with noise alone, and intervals in which the ratios of another seed should land. Under way: the "
            "depth from 15 s on."
        ),
        Table(LOOPS, loops),
    ]
