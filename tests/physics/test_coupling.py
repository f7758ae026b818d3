"""What fins take from each other and from speed: by hand, and derivatives against differences."""

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.errors import CommandError
from finlab.layout import Interaction, Jet, Layout, load_layout
from finlab.physics import Plant, plant_of
from finlab.physics.coupled_plant import CoupledPlant
from tests.any_robot import AnyRobot

FLOW = np.array([0.15, -0.05, 0.03, 0.1, -0.2, 0.3])


@pytest.fixture(scope="module")
def coupled() -> Layout:
    rng = np.random.default_rng(4)
    layout = load_layout("A")
    jets = tuple(
        Jet(a, b, tuple(rng.uniform(0.0, 0.15, 2))) for a in layout.names for b in layout.names if a != b
    )
    return _with(layout, Interaction(jets, 0.4, 2.0, (0.35, 0.1)))


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
    fast, flow = _with(layout, Interaction((), inflow=(0.3, 0.2))), np.array([0.2, 0, 0, 0, 0, 0])
    command = np.tile([0.5, 1.0, 0.0], (4, 1))
    alone, found = Plant(layout).fin_forces(command), plant_of(fast).fin_forces(command, flow=flow)
    along = alone / np.linalg.norm(alone, axis=1, keepdims=True)
    j = 0.2 * along[:, 0] / np.hypot(2 * np.pi * 0.5 * 0.2, 0.05)
    kept = 1.0 - 0.3 * np.tanh(j) - 0.2 * np.tanh(j) ** 2
    np.testing.assert_allclose(found, alone * kept[:, None], rtol=1e-12)


@pytest.mark.parametrize("flow", [None, FLOW, np.random.default_rng(5).normal(0.0, 0.2, (20, 6))])
def test_derivatives_agree_with_differences(coupled: Layout, flow: np.ndarray | None) -> None:
    plant = plant_of(coupled)
    assert isinstance(plant, CoupledPlant)
    command = plant.sample(np.random.default_rng(1), (20,))
    wrench, jacobian = plant.linearize(command, flow=flow)
    np.testing.assert_allclose(wrench, plant.wrench(command, flow=flow), atol=1e-12)
    force, own_jacobian = plant.force_and_jacobian(command, flow=flow)
    np.testing.assert_allclose(force, plant.force(command, flow=flow), atol=1e-12)
    step = 1e-6
    for i in range(4):
        for k in range(3):
            up, down = command.copy(), command.copy()
            up[:, i, k] += step
            down[:, i, k] -= step
            by = (plant.wrench(up, flow=flow) - plant.wrench(down, flow=flow)) / (2 * step)
            np.testing.assert_allclose(jacobian[:, :, 3 * i + k], by, atol=2e-6)
            own = (plant.force(up, flow=flow) - plant.force(down, flow=flow))[:, i] / (2 * step)
            np.testing.assert_allclose(own_jacobian[:, i, k], own, atol=2e-6)


def test_each_command_has_a_flow_of_its_own(coupled: Layout) -> None:
    plant, rng = plant_of(coupled), np.random.default_rng(6)
    command, flows = plant.sample(rng, (7,)), rng.normal(0.0, 0.2, (7, 6))
    together = plant.wrench(command, flow=flows)
    for k, flow in enumerate(flows):
        np.testing.assert_allclose(plant.wrench(command[k], flow=flow), together[k], atol=1e-12)
    np.testing.assert_allclose(plant.wrench(command[0], flow=flows)[0], together[0], atol=1e-12)
    np.testing.assert_array_equal(plant.at(flows).wrench(command), together)
    still = plant_of(_with(coupled, Interaction()))
    assert still.at(flows) is still
    np.testing.assert_array_equal(still.wrench(command, flow=flows), Plant(coupled).wrench(command))


def test_answers_are_exact_by_the_coupled_plant_at_the_flow(coupled: Layout) -> None:
    allocator, plant = AnyRobot(), plant_of(coupled)
    rng = np.random.default_rng(2)
    targets = plant.wrench(Plant(coupled).sample(rng, (40,)), flow=FLOW) * 0.7
    batch = allocator.allocate_batch(coupled, targets, flow=FLOW)
    assert np.median(batch.err_norm) < 1e-5 and np.quantile(batch.err_norm, 0.9) < 1e-3
    np.testing.assert_allclose(plant.wrench(batch.command, flow=FLOW), batch.wrench, atol=1e-12)
    single = allocator.allocate(coupled, targets[0], flow=FLOW)
    np.testing.assert_allclose(plant.wrench(single.command, flow=FLOW), single.wrench, atol=1e-12)
    assert single.flow is not None and not single.notes
    ignorant = allocator.allocate_batch(_with(coupled, Interaction()), targets)
    missed = np.linalg.norm(plant.wrench(ignorant.command, flow=FLOW) - targets, axis=1)
    assert np.median(missed) > 0.05


def test_a_flow_that_no_fin_feels_is_said_and_changes_nothing() -> None:
    layout, allocator, target = load_layout("A"), AnyRobot(), [0.5, 0, 0.3, 0, 0, 0.05]
    still, moving = (allocator.allocate(layout, target, flow=flow) for flow in (np.zeros(6), FLOW))
    np.testing.assert_array_equal(still.command, moving.command)
    assert still.flow is None and "the flow is without effect" in moving.notes[-1]


@pytest.mark.parametrize("flow", [[0.1] * 3, [np.nan] * 6, [1e3, 0, 0, 0, 0, 0], "fast"])
def test_a_flow_that_is_none_is_refused(flow: object) -> None:
    with pytest.raises(CommandError, match="flow: "):
        Allocator(load_layout("A")).allocate([1, 0, 0, 0, 0, 0], flow=flow)


def test_a_lost_fin_takes_nothing(coupled: Layout) -> None:
    lost = coupled.names[1]
    left = coupled.without([lost])
    assert left.interaction is not None
    assert not any(lost in (jet.source, jet.target) for jet in left.interaction.jets)
    assert len(left.interaction.jets) == 6
    answer = Allocator(coupled).allocate([0.5, 0, 0.3, 0, 0, 0.05], failed=[lost])
    assert answer.err_norm < 1e-3
    np.testing.assert_allclose(
        plant_of(left).wrench(np.delete(answer.command, 1, axis=0)), answer.wrench, atol=1e-9
    )
