"""`finlab eval robots`: fitted robots against what their fins truly do."""

from typing import Annotated

from tyro.conf import arg

from finlab.cli.eval_arguments import Count, Name, Names, Output
from finlab.cli.inputs import check_positive
from finlab.errors import DataError

OUTPUT = Output()


def robots(
    layout: Annotated[str, arg(metavar="LAYOUT")] = "A",
    plants: Names = "offset,wake,inflow,flexible",
    targets: Count = 100,
    runs: Count = 16,
    method: Name = "search",
    seed: Count = 0,
    output: Annotated[Output, arg(name="")] = OUTPUT,
) -> None:
    """Fit a robot to five minutes of swimming on plants that its layout knows nothing of.

    Args:
        layout: layout file or the name of a shipped layout.
        plants: what the fins truly do, names with commas between.
        targets: wrenches asked of the layout as drawn, the fitted one and the true one.
        runs: closed loops with each of them; a run takes some seconds.
        method: who answers.
        seed: draws everything.
    """
    from finlab.cli.inputs import open_robot
    from finlab.evaluation.experiments.robot_fits import robot_fit_rows
    from finlab.evaluation.method_specs import load_method_spec
    from finlab.evaluation.report.sections.robot_fits import robot_fit_blocks
    from finlab.sim import PLANTS

    check_positive(targets=targets, runs=runs)
    names = [name.strip() for name in plants.split(",") if name.strip()]
    if unknown := [name for name in names if name not in PLANTS]:
        raise DataError(f"plants: expected some of {', '.join(PLANTS)}, got {unknown[0]!r:.60}")
    robot = open_robot(layout).layout
    rows = robot_fit_rows(robot, load_method_spec(method), names, targets=targets, runs=runs, seed=seed)
    output.show(*robot_fit_blocks(rows, robot.name, targets, runs), rows=rows)
