"""Thrust curves of fins by their own laws, against the plant and a fine grid of commands."""

import numpy as np
import pytest

from finlab.forces.thrust_curve import plant_curves
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.physics import Plant, make_law, write_table
from finlab.physics.energy import fin_energy

DRAG = make_law(FinModelSpec())

SPECS = [
    FinModelSpec(),
    FinModelSpec("drag", (("area", 0.03),)),
    FinModelSpec("lighthill", (("length", 0.14), ("width", 0.08))),
]


def one_fin(spec: FinModelSpec, limits: Limits) -> Layout:
    return Layout("one", (Fin("fin", (0.1, 0.2, 0.0), 0.3, limits, spec),))


@pytest.mark.parametrize("spec", SPECS)
def test_thrust_and_energy_agree_with_the_plant(spec: FinModelSpec) -> None:
    limits = Limits((0.1, 0.7), (0.2, 2.5))
    layout = one_fin(spec, limits)
    amplitude, frequency = np.meshgrid(np.linspace(0.1, 0.7, 301), np.linspace(0.2, 2.5, 301))
    command = np.stack([amplitude, frequency, np.zeros_like(amplitude)], axis=-1)
    thrust = np.linalg.norm(Plant(layout).fin_forces(command[..., None, :])[..., 0, :], axis=-1)
    curves = plant_curves(layout)
    assert curves.minimum[0] == pytest.approx(thrust.min(), rel=1e-9)
    assert curves.maximum[0] == pytest.approx(thrust.max(), rel=1e-9)
    # No command on the grid gives its thrust for less, and for each thrust some command comes close.
    energy = fin_energy(command, np.array(limits.upper))
    excess = energy - curves.lookup(thrust[..., None])[..., 0, 2]
    assert excess.min() > -2e-3
    for level in np.linspace(0.05, 0.95, 7) * curves.maximum[0]:
        near = np.abs(thrust - level) < 0.005 * curves.maximum[0]
        assert excess[near].min() < 2e-2


def test_a_table_counts_with_its_largest_thrust(tmp_path: object) -> None:
    path = f"{tmp_path}/forces.csv"
    turn = np.linspace(-np.pi, np.pi, 9)
    write_table(path, DRAG, np.linspace(0.0, 0.7, 8), np.linspace(0.0, 2.5, 8), turn)
    drag = plant_curves(one_fin(FinModelSpec(), Limits()))
    table = plant_curves(one_fin(FinModelSpec("table", (("path", path),)), Limits()))
    assert table.maximum == pytest.approx(drag.maximum, rel=0.02)
    assert 0.0 <= table.spread < 0.2 * table.maximum
    assert np.allclose(table.table[..., 2], drag.table[..., 2], atol=0.15)


def test_a_soft_fin_counts_up_to_its_saturation_in_its_strongest_direction() -> None:
    spec = FinModelSpec("soft", (("e", 0.2), ("phi_e", 1.0)))
    limits = Limits((0.05, 0.8), (0.1, 3.0))
    layout = one_fin(spec, limits)
    axes = [np.linspace(*ends, n) for ends, n in ((limits.amplitude, 161), (limits.frequency, 161))]
    grid = np.stack(np.meshgrid(*axes, np.linspace(-np.pi, np.pi, 25), indexing="ij"), axis=-1)
    thrust = np.linalg.norm(Plant(layout).fin_forces(grid[..., None, :])[..., 0, :], axis=-1)
    curves = plant_curves(layout)
    assert curves.maximum[0] == pytest.approx(thrust.max(), rel=2e-3)
    assert curves.spread[0] == pytest.approx(thrust.max() - thrust.max(axis=(0, 1)).min(), rel=2e-2)
    found = curves.lookup(np.linspace(0.0, 1.0, 50)[:, None] * curves.maximum)[:, 0]
    assert (np.diff(found[:, 2]) >= 0.0).all()
    # Beyond saturation nothing is gained: the curve ends there.
    assert found[-1, 0] * found[-1, 1] < 0.7 * limits.amplitude[1] * limits.frequency[1]
