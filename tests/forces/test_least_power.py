"""Least power against closed forms and against what solvers on the commands find."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from finlab.actuators.fin.blade import Blade
from finlab.forces.fin_sets import FinSets, fin_sets
from finlab.forces.least_power import cheapest, least_power, power_problem, variant
from finlab.layout import FinModelSpec, Layout
from tests.any_robot import AnyRobot

Layouts = Callable[[str], Layout]
WRENCHES = np.concatenate([np.diag([1, 1, 1, 0.1, 0.1, 0.1]), [[1.2, 0, 0.5, 0, 0, 0.15]]])


def least_for(force: float, blade: Blade) -> float:
    """The least power [W] of U-CAT's fin that gives a force [N], by brute force."""
    amplitude = np.linspace(0.05, 0.6, 20001)
    frequency = np.sqrt(force / 4.737410112522892) / np.sin(amplitude)
    power = blade.power(amplitude, frequency)
    return float(power[(frequency >= 0.1) & (frequency <= 2.1)].min())


def test_a_pair_shares_heave_evenly(shipped: Layouts) -> None:
    layout = shipped("pair")
    power = least_power(layout, [[0, 0, 4.0, 0, 0, 0], [0, 0, 0, 0, 0.5, 0], [0, 0, 40.0, 0, 0, 0]])
    assert power[0] == pytest.approx(2 * least_for(2.0, Blade()), rel=3e-3)
    assert np.isnan(power[1:]).all()  # a torque it has not, a force beyond its reach


@pytest.mark.parametrize("name", ["A", "mixed", "restricted", "hexa"])
def test_commands_need_no_less_and_hardly_more(shipped: Layouts, name: str) -> None:
    """They cannot rest altogether, which costs next to nothing."""
    layout = shipped(name)
    power = least_power(layout, WRENCHES)
    method = AnyRobot()
    found = [method.allocate(layout, wrench) for wrench in WRENCHES]
    assert all(answer.err_norm < 1e-5 for answer in found)
    ratio = np.array([answer.power for answer in found]) / power
    assert ratio.min() > 0.965 and ratio.max() < 1.01


def test_wide_arcs_and_failures(wide: Layout) -> None:
    wrench = [[0.5, 0.0, 0.5, 0.0, 0.0, 0.05]]
    whole = least_power(wide, wrench)
    assert np.isfinite(whole).all()
    assert np.isnan(least_power(wide, wrench, failed=wide.names[:3])).all()
    assert least_power(wide, np.zeros((1, 6))) < whole


def test_nothing_costs_nothing_even_without_fins(shipped: Layouts) -> None:
    layout = shipped("A")
    power = least_power(layout, [np.zeros(6), np.eye(6)[0]], failed=layout.names)
    assert power[0] == 0.0 and np.isnan(power[1])
    assert cheapest(power_problem(layout), np.empty((0, 6))).shape == (0,)


def test_it_grows_faster_than_the_wrench(shipped: Layouts) -> None:
    power = least_power(shipped("A"), np.outer([0.25, 0.5, 1.0, 2.0], WRENCHES[-1]))
    assert (power[1:] > 2.0 * power[:-1]).all() and (power[1:] < 4.0 * power[:-1]).all()


def test_a_variant_is_the_robot_itself_placed_anew(shipped: Layouts) -> None:
    layout = shipped("A")
    moved = replace(
        layout, fins=tuple(replace(f, mounting_angle=f.mounting_angle + 0.2) for f in layout.fins)
    )
    pairs = zip(fin_sets(layout)[:4], fin_sets(moved)[:4], strict=True)
    both = FinSets(*(np.concatenate(pair) for pair in pairs))
    problem = power_problem(layout)
    for row, robot in enumerate((layout, moved)):
        target = WRENCHES / [1.0, 1.0, 1.0, 0.2, 0.2, 0.2]
        np.testing.assert_allclose(
            cheapest(variant(problem, both, row), target), least_power(robot, WRENCHES), rtol=1e-9
        )


def test_larger_blades_of_the_same_thrust_take_more_power(shipped: Layouts) -> None:
    layout = shipped("A")
    long = FinModelSpec("drag", (("area", 0.02 / 1.44), ("lever", 0.12)))
    other = replace(layout, actuators=tuple(replace(fin, model=long) for fin in layout.fins))
    assert (least_power(other, WRENCHES) > 1.02 * least_power(layout, WRENCHES)).all()
