"""Least power against closed forms and against what solvers on the commands find."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.actuators.law import Blade
from finlab.analysis.score_card import least_power
from finlab.layout import FinModelSpec, load_layout
from finlab.layout.axes import AXES

WRENCHES = np.concatenate([np.diag([1, 1, 1, 0.1, 0.1, 0.1]), [[1.2, 0, 0.5, 0, 0, 0.15]]])


def least_for(force: float, blade: Blade) -> float:
    """The least power [W] of U-CAT's fin that gives a force [N], by brute force."""
    amplitude = np.linspace(0.05, 0.6, 20001)
    frequency = np.sqrt(force / 4.737410112522892) / np.sin(amplitude)
    power = blade.power(amplitude, frequency)
    return float(power[(frequency >= 0.1) & (frequency <= 2.1)].min())


def test_a_pair_shares_heave_evenly() -> None:
    layout = replace(load_layout("pair"), axes=AXES)
    power = least_power(layout, [[0, 0, 4.0, 0, 0, 0], [0, 0, 0, 0, 0.5, 0], [0, 0, 40.0, 0, 0, 0]])
    assert power[0] == pytest.approx(2 * least_for(2.0, Blade()), rel=3e-3)
    assert np.isnan(power[1:]).all()  # a torque it has not, a force beyond its reach


def test_failures() -> None:
    layout, wrench = load_layout("A"), [[0.5, 0.0, 0.5, 0.0, 0.0, 0.05]]
    assert np.isfinite(least_power(layout, wrench)).all()
    assert np.isnan(least_power(layout, wrench, failed=layout.names[:3])).all()


def test_nothing_costs_nothing_even_without_fins() -> None:
    layout = load_layout("A")
    power = least_power(layout, [np.zeros(6), np.eye(6)[0]], failed=layout.names)
    assert power[0] == 0.0 and np.isnan(power[1])


def test_it_grows_faster_than_the_wrench() -> None:
    power = least_power(load_layout("A"), np.outer([0.25, 0.5, 1.0, 2.0], WRENCHES[-1]))
    assert (power[1:] > 2.0 * power[:-1]).all() and (power[1:] < 4.0 * power[:-1]).all()


def test_larger_blades_of_the_same_thrust_take_more_power() -> None:
    layout = load_layout("A")
    long = FinModelSpec("drag", (("area", 0.02 / 1.44), ("lever", 0.12)))
    other = replace(layout, actuators=tuple(replace(fin, model=long) for fin in layout.fins))
    assert (least_power(other, WRENCHES) > 1.02 * least_power(layout, WRENCHES)).all()
