"""Least energies against closed forms and against random multistart on the commands."""

from collections.abc import Callable

import numpy as np
import pytest

from finlab.allocation.baselines.multistart import Multistart
from finlab.forces.least_energy import least_energy
from finlab.forces.thrust_curve import plant_curves
from finlab.inference.normalization import Normalization
from finlab.layout import Layout

Layouts = Callable[[str], Layout]
WRENCHES = np.concatenate([np.diag([1, 1, 1, 0.1, 0.1, 0.1]), [[1.2, 0, 0.5, 0, 0, 0.15]]])


def test_a_pair_shares_heave_evenly(shipped: Layouts) -> None:
    layout = shipped("pair")
    curves = plant_curves(layout)
    up = 0.1 * 0.25  # the zero direction's cost at a quarter turn
    energy = least_energy(layout, [[0, 0, 4.0, 0, 0, 0], [0, 0, 0, 0, 0.5, 0], [0, 0, 40.0, 0, 0, 0]])
    assert energy[0] == pytest.approx(2 * (curves.lookup(np.full((1, 2), 2.0))[0, 0, 2] + up), rel=1e-3)
    assert np.isnan(energy[1:]).all()  # a torque it has not, a force beyond its reach


@pytest.mark.parametrize("name", ["A", "mixed", "restricted"])
def test_no_multistart_finds_much_less(shipped: Layouts, name: str) -> None:
    layout = shipped(name)
    energy = least_energy(layout, WRENCHES)
    sigma = np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
    method = Multistart(Normalization(np.zeros(6), sigma), n_candidates=24, n_steps=30, energy_tradeoff=1e-3)
    found = [method.allocate(layout, wrench) for wrench in WRENCHES]
    assert all(answer.err_norm < 1e-2 for answer in found)
    assert (energy <= [1.03 * answer.energy for answer in found]).all()


def test_wide_arcs_and_failures(wide: Layout) -> None:
    wrench = [[0.5, 0.0, 0.5, 0.0, 0.0, 0.05]]
    whole = least_energy(wide, wrench)
    assert np.isfinite(whole).all()
    assert np.isnan(least_energy(wide, wrench, failed=wide.names[:3])).all()
    assert least_energy(wide, np.zeros((1, 6))) < whole
