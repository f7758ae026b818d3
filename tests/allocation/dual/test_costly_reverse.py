"""Reverse that costs more than forward at full force is no proof that a wrench is out of reach."""

import numpy as np

from finlab.actuators.response import Line, RadialTable
from finlab.allocation.dual.newton import solve
from finlab.allocation.dual.robot import DualRobot


def _table(watts: float, most: float) -> RadialTable:
    """Power `watts` F^1.5 up to a largest force [N]."""
    top = 1.5 * watts * np.sqrt(most)
    return RadialTable.of_price(top, lambda price: np.minimum((price / (1.5 * watts)) ** 2, most))


def test_costly_reverse_is_within_reach() -> None:
    lines = [Line(np.eye(6)[i], _table(1.0, 10.0), _table(5.0, 10.0)) for i in range(3)]
    robot = DualRobot(lines)
    target = robot.basis.T @ (np.array([-9.0, -9.0, -9.0, 0.0, 0.0, 0.0]) / robot.scale)
    found = solve(robot, target[:, None])
    assert found.solved[0] and not found.beyond[0]
    np.testing.assert_allclose(found.value, 3 * 5.0 * 9.0**1.5, rtol=1e-9)
