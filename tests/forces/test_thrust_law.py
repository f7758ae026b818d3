"""Thrust laws against the plant, and their cheapest commands against a fine grid."""

import numpy as np
import pytest

from finlab.forces.thrust_law import thrust_laws
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
    law = thrust_laws(layout)[0]
    assert law.minimum == pytest.approx(thrust.min(), rel=1e-9)
    assert law.maximum == pytest.approx(thrust.max(), rel=1e-9)
    # No command on the grid gives its thrust for less, and for each thrust some command comes close.
    energy = fin_energy(command, np.array(limits.upper))
    excess = energy - law.energy_at(thrust)
    assert excess.min() > -2e-3
    for level in np.linspace(0.05, 0.95, 7) * law.maximum:
        near = np.abs(thrust - level) < 0.005 * law.maximum
        assert excess[near].min() < 2e-2


def test_a_table_counts_with_its_largest_thrust(tmp_path: object) -> None:
    path = f"{tmp_path}/forces.csv"
    turn = np.linspace(-np.pi, np.pi, 9)
    write_table(path, DRAG, np.linspace(0.0, 0.7, 8), np.linspace(0.0, 2.5, 8), turn)
    drag = thrust_laws(one_fin(FinModelSpec(), Limits()))[0]
    table = thrust_laws(one_fin(FinModelSpec("table", (("path", path),)), Limits()))[0]
    assert table.maximum == pytest.approx(drag.maximum, rel=0.02)
    assert 0.0 <= table.spread < 0.2 * table.maximum
    assert np.allclose(table.energy, drag.energy, atol=0.15)
