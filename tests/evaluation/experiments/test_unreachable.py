"""The judge of wrenches out of reach, and the table."""

import math

import numpy as np
import pytest

from finlab.cli import main
from finlab.evaluation.experiments.unreachable import Judge
from finlab.layout import Fin, Layout, Limits
from finlab.physics import Plant

ALL = np.ones(6, dtype=bool)
SIGMA = np.array([2.0, 3.0, 4.0, 0.5, 0.6, 0.7])


def surge_robot(arc: tuple[float, float] = (-math.pi, math.pi)) -> tuple[Layout, float]:
    """Two fins abeam that push along x and z, and the thrust of one [N]."""
    limits = Limits(zero_direction=arc)
    fins = [
        Fin(name, (0.0, y, 0.0), -math.pi / 2, limits) for name, y in (("port", 0.2), ("starboard", -0.2))
    ]
    layout = Layout("pair", tuple(fins))
    full = np.array([[*limits.upper[:2], 0.5 * sum(arc)]] * 2)
    return layout, float(np.linalg.norm(Plant(layout).fin_forces(full)[0]))


def test_the_judge_knows_a_case_by_hand() -> None:
    layout, thrust = surge_robot()
    judge = Judge(layout, SIGMA)
    wanted = np.array([4.0 * thrust, 0, 0, 0, 0, 0]) / SIGMA
    assert judge.largest_share(wanted) == pytest.approx(0.5, abs=1e-5)
    assert judge.least_error(wanted, ALL) == pytest.approx(2.0 * thrust / SIGMA[0], rel=1e-5)
    assert judge.least_error(np.array([0, 5.0, 0, 0, 0, 0]), ALL) == pytest.approx(5.0, rel=1e-5)  # no sway


def test_arcs_wider_than_half_a_turn_are_tried_in_halves() -> None:
    layout, thrust = surge_robot((-math.radians(130), math.radians(130)))
    judge = Judge(layout, SIGMA)
    assert len(judge.arcs) == 4
    back = np.array([-2.0 * thrust, 0, 0, 0, 0, 0]) / SIGMA
    # Neither fin can point straight back; both at their stops, one up and one down, would roll the robot.
    roll = np.array([False, True, True, True, True, True])
    assert judge.least_error(back, ~roll) == pytest.approx(
        2.0 * thrust * (1.0 - math.cos(math.radians(50))) / SIGMA[0], rel=1e-4
    )


def test_the_verb_prints_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "unreachable", "--layouts", "4", "--seed", "5000"]) == 0
    printed = capsys.readouterr().out
    assert "direction" in printed and "excess, largest" in printed
