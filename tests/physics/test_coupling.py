"""What fins take from each other and from speed: by hand, and derivatives against differences."""

import numpy as np
import pytest

from finlab import load_allocator
from finlab.layout import Interaction, Jet, Layout, load_layout
from finlab.physics import Plant, plant_of
from finlab.physics.coupled_plant import CoupledPlant

VELOCITY = (0.15, -0.05, 0.03, 0.1, -0.2, 0.3)


@pytest.fixture(scope="module")
def coupled() -> Layout:
    rng = np.random.default_rng(4)
    layout = load_layout("A")
    jets = tuple(
        Jet(a, b, tuple(rng.uniform(0.0, 0.15, 2))) for a in layout.names for b in layout.names if a != b
    )
    return _with(layout, Interaction(jets, 0.4, 2.0, (0.35, 0.1), VELOCITY))


def _with(layout: Layout, interaction: Interaction) -> Layout:
    return Layout(layout.name, layout.fins, layout.description, layout.body, interaction)


def test_one_jet_by_hand() -> None:
    layout = load_layout("A")
    names = layout.names
    one = _with(layout, Interaction((Jet(names[0], names[3], (0.2, 0.1)),), 0.5))
    command = np.tile([0.5, 1.0, 0.0], (4, 1))
    alone, found = Plant(layout).forces(command), plant_of(one).forces(command)
    np.testing.assert_array_equal(found[:3], alone[:3])
    thrust = np.linalg.norm(alone[0])
    jet = -Plant(layout).fin_forces(command)[0] / thrust
    way = layout.position[3] - layout.position[0]
    cosine = float(jet @ way / np.linalg.norm(way))
    lost = (0.2 * np.exp(2.0 * (cosine - 1.0)) + 0.1 * np.exp(8.0 * (cosine - 1.0))) * thrust / (thrust + 0.5)
    np.testing.assert_allclose(found[3], alone[3] * (1.0 - lost), rtol=1e-12)
    assert lost > 0.05


def test_speed_by_hand() -> None:
    layout = load_layout("A")
    fast = _with(layout, Interaction((), inflow=(0.3, 0.2))).moving((0.2, 0, 0, 0, 0, 0))
    command = np.tile([0.5, 1.0, 0.0], (4, 1))
    alone, found = Plant(layout).fin_forces(command), plant_of(fast).fin_forces(command)
    along = alone / np.linalg.norm(alone, axis=1, keepdims=True)
    j = 0.2 * along[:, 0] / np.hypot(2 * np.pi * 0.5 * 0.2, 0.05)
    kept = 1.0 - 0.3 * np.tanh(j) - 0.2 * np.tanh(j) ** 2
    np.testing.assert_allclose(found, alone * kept[:, None], rtol=1e-12)


def test_derivatives_agree_with_differences(coupled: Layout) -> None:
    plant = plant_of(coupled)
    assert isinstance(plant, CoupledPlant)
    command = plant.sample(np.random.default_rng(1), (20,))
    wrench, jacobian = plant.linearize(command)
    np.testing.assert_allclose(wrench, plant.wrench(command), atol=1e-12)
    force, own_jacobian = plant.force_and_jacobian(command)
    np.testing.assert_allclose(force, plant.force(command), atol=1e-12)
    step = 1e-6
    for i in range(4):
        for k in range(3):
            up, down = command.copy(), command.copy()
            up[:, i, k] += step
            down[:, i, k] -= step
            by = (plant.wrench(up) - plant.wrench(down)) / (2 * step)
            np.testing.assert_allclose(jacobian[:, :, 3 * i + k], by, atol=2e-6)
            own = (plant.force(up) - plant.force(down))[:, i] / (2 * step)
            np.testing.assert_allclose(own_jacobian[:, i, k], own, atol=2e-6)


def test_answers_are_exact_by_the_coupled_plant(coupled: Layout) -> None:
    allocator = load_allocator()
    rng = np.random.default_rng(2)
    targets = plant_of(coupled).wrench(Plant(coupled).sample(rng, (40,))) * 0.7
    batch = allocator.allocate_batch(coupled, targets)
    assert np.median(batch.err_norm) < 1e-5 and np.quantile(batch.err_norm, 0.9) < 1e-3
    single = allocator.allocate(coupled, targets[0])
    np.testing.assert_allclose(plant_of(coupled).wrench(single.command), single.wrench, atol=1e-12)
    ignorant = allocator.allocate_batch(_with(coupled, Interaction()), targets)
    missed = np.linalg.norm(plant_of(coupled).wrench(ignorant.command) - targets, axis=1)
    assert np.median(missed) > 0.05


def test_a_lost_fin_takes_nothing(coupled: Layout) -> None:
    lost = coupled.names[1]
    left = coupled.without([lost])
    assert left.interaction is not None
    assert not any(lost in (jet.source, jet.target) for jet in left.interaction.jets)
    assert len(left.interaction.jets) == 6
    answer = load_allocator().allocate(coupled, [0.5, 0, 0.3, 0, 0, 0.05], failed=[lost])
    assert answer.err_norm < 1e-3
    np.testing.assert_allclose(
        plant_of(left).wrench(np.delete(answer.command, 1, axis=0)), answer.wrench, atol=1e-9
    )
