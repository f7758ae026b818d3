"""Robots fitted to swims: what allocations for them miss, and what their closed loops cost."""

from collections.abc import Sequence

from finlab.evaluation.report.document import Block, Column, Row, Table

ERRORS = (
    Column("plant", "plant", "code"),
    Column("used", "used besides"),
    Column("before_mean", "err_norm before, mean", "error"),
    Column("after_mean", "after", "error"),
    Column("times_smaller", "times smaller", "three"),
    Column("before_median", "median before", "error"),
    Column("after_median", "after", "error"),
    Column("trusted", "trusted"),
    Column("fit_s", "fit [s]", "three"),
)
LOOPS = (
    Column("plant", "plant", "code"),
    Column("believed", "believed"),
    Column("ate", "ATE [m]", "metres"),
    Column("depth_rmse", "depth RMSE [m]", "metres"),
    Column("torque_w", "torque power [W]", "three"),
    Column("depth_over_true", "depth over true model", "three"),
    Column("power_over_true", "power over true model", "three"),
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
            f"fitted. {targets} wrenches of random commands are asked of the layout as drawn (before) and of "
            "the fitted one (after), at random speeds through the water; what the fins then truly give tells "
            "the error."
        ),
        Table(ERRORS, rows),
        (
            f"Closed loops: {runs} circles with each layout that the allocator believes in. The true model "
            "is a layout that says all that there is to know, where one can."
        ),
        Table(LOOPS, loops),
    ]
