"""Method `mdn`: proposals of the mixture, each searched to its end, whatever the network has
learned."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from finlab.assets import checkpoint_path
from finlab.errors import AllocationError, CheckpointError
from finlab.layout import FinModelSpec, Layout, load_layout
from finlab.physics import Plant
from finlab.physics.objective import command_effort
from finlab.research.mdn.answers import follow
from finlab.research.mdn.features import features_of, shares
from finlab.research.mdn.method import STEPS, Mdn, MdnSettings
from finlab.research.networks.checkpoint import read_checkpoint
from finlab.research.random_layouts import random_layout
from tests.allocator_cache import AllocatorCache

TARGET = [0.5, -0.3, 1.0, 0.05, -0.02, 0.1]
"""A wrench within reach of the robots here [N, N m]."""


@pytest.fixture(scope="module")
def untrained(untrained_mdn: Path) -> AllocatorCache:
    """The method with weights that nobody trained."""
    return AllocatorCache("mdn", checkpoint=untrained_mdn)


@pytest.fixture(scope="module")
def shipped() -> AllocatorCache:
    """The method with the checkpoint in the tree."""
    return AllocatorCache("mdn")


def plant_force(layout: Layout, command: np.ndarray) -> np.ndarray:
    """What matters of commands."""
    return np.asarray(Plant(layout).force(command))


def reachable_wrenches(layout: Layout, count: int, seed: int = 0) -> np.ndarray:
    """Wrenches (count, 6) of random commands."""
    plant = Plant(layout)
    return plant.wrench(plant.sample(np.random.default_rng(seed), (count,)))


@pytest.mark.parametrize("n", [2, 4, 8, 12])
def test_answers_are_exact_even_where_nothing_was_learned(
    n: int, untrained: AllocatorCache
) -> None:
    layout = random_layout(np.random.default_rng(n), n_fins=n, limits="varied")
    layout = layout.replace_actuator("fin_1", model=FinModelSpec("soft", (("e", 0.2), ("d", 0.1))))
    targets = reachable_wrenches(layout, 20)
    answer = untrained.allocate_batch(layout, targets)
    error = answer.err_norm
    assert np.mean(error < 1e-4) >= 0.95 and error.max() < 0.05


def test_a_batch_costs_what_single_calls_do(shipped: AllocatorCache, layout_a: Layout) -> None:
    targets = reachable_wrenches(layout_a, 6)
    together = shipped.allocate_batch(layout_a, targets)
    np.testing.assert_allclose(Plant(layout_a).wrench(together.command), targets, atol=1e-4)
    alone = [shipped.allocate(layout_a, target).effort for target in targets]
    np.testing.assert_allclose(np.array(together.effort), np.array(alone), rtol=0.01)


def method_of(robot: AllocatorCache, layout: Layout) -> tuple[Mdn, np.ndarray]:
    """The method of a robot, and `TARGET` (1, 6) as it is normalized there."""
    method = robot.on(layout)._whole.method
    assert isinstance(method, Mdn)
    return method, np.array([TARGET]) / method.asked_scale


def weights(robot: AllocatorCache, layout: Layout) -> np.ndarray:
    """Of the mixture's components, for `TARGET`."""
    method, target = method_of(robot, layout)
    return np.asarray(method.mixture(features_of(method.robot.view, target)).complex_parts()[0][0])


def test_candidates_keep_the_name_of_their_component(
    shipped: AllocatorCache, layout_a: Layout
) -> None:
    answer = shipped.allocate(layout_a, TARGET)
    count = MdnSettings().n_candidates
    expected = [f"component {k + 1}" for k in np.argsort(-weights(shipped, layout_a))[:count]]
    assert answer.samples is not None and answer.candidates is not None
    assert list(answer.samples.source[: len(expected)]) == expected
    assert set(answer.candidates.source) <= set(expected)
    # A candidate is what its own component's proposal leads to, and no other one.
    method, target = method_of(shipped, layout_a)
    force = method.proposals(target, 0).force
    for command, source in zip(answer.candidates.command, answer.candidates.source, strict=True):
        ends = [
            follow(method.robot, target, force[:, k : k + 1], 1, STEPS).command[0, 0]
            for k, name in enumerate(answer.samples.source)
            if name == source
        ]
        assert any(
            np.allclose(plant_force(layout_a, command), plant_force(layout_a, end), atol=5e-3)
            for end in ends
        )


def test_from_tick_to_tick_candidates_keep_it_too(shipped: AllocatorCache) -> None:
    layout = load_layout("octo")
    alone = shipped.allocate(layout, TARGET)
    again = shipped.allocate(layout, TARGET, previous=alone.command)
    assert alone.candidates is not None and again.candidates is not None
    # What is within the servos' rates is answered as without a past, component by component.
    assert again.candidates == alone.candidates
    away = shipped.allocate(layout, -0.5 * np.array(TARGET), previous=alone.command).candidates
    assert away is not None and "the way it moves now" in away.source


def test_more_candidates_than_components_are_drawn_by_a_seed(
    shipped: AllocatorCache, layout_a: Layout
) -> None:
    many = AllocatorCache("mdn", n_candidates=40)
    first, again, other = (many.allocate(layout_a, TARGET, seed=seed).samples for seed in (0, 0, 1))
    assert first is not None and other is not None
    assert len(first) == 40 and first == again and first != other
    still = AllocatorCache("mdn", n_candidates=40, temperature=0.0)
    means = still.allocate(layout_a, TARGET).samples
    assert (
        means is not None and len({command.tobytes() for command in means.command.round(9)}) <= 16
    )


def test_components_are_drawn_as_often_as_they_weigh(
    shipped: AllocatorCache, layout_a: Layout
) -> None:
    """Behind the means, 8,000 draws; and their spread is the component's own, by the
    temperature."""
    weight = weights(shipped, layout_a)
    method, target = method_of(shipped, layout_a)
    m = len(weight)
    proposal = method.proposals(target, 3, m + 8000)
    drawn = proposal.component[0, m:]
    share = np.bincount(drawn, minlength=m) / len(drawn)
    np.testing.assert_allclose(share, weight / weight.sum(), atol=0.02)
    assert sorted(proposal.component[0, :m]) == list(range(m))
    assert (np.diff(weight[proposal.component[0, :m]]) <= 0.0).all()


def test_it_goes_on_from_the_previous_command(shipped: AllocatorCache, layout_a: Layout) -> None:
    before = shipped.allocate(layout_a, TARGET)
    near = np.array(TARGET) + [0.02, 0.0, 0.01, 0.0, 0.0, 0.0]
    answer = shipped.allocate(layout_a, near, previous=before.command)
    turned = np.angle(np.exp(1j * (answer.command - before.command)[:, 2]))
    assert np.abs(turned).max() < 0.4
    np.testing.assert_allclose(answer.wrench, near, atol=1e-4)


def test_shares_are_squares_of_roots_and_at_most_one() -> None:
    root = np.array([0.0, 0.5j, -1.0, 2.0 + 0j])
    np.testing.assert_allclose(shares(root), [0.0, 0.25j, -1.0, 1.0])


def test_refuses_other_networks_and_settings() -> None:
    with pytest.raises(CheckpointError, match="fed 'raw', expected one that is fed 'forces'"):
        AllocatorCache("mdn", read_checkpoint(checkpoint_path("paper"))).on(load_layout("A"))
    with pytest.raises(AllocationError, match="n_candidates: expected"):
        AllocatorCache("mdn", n_candidates=0)
    with pytest.raises(AllocationError, match="temperature: expected"):
        AllocatorCache("mdn", temperature=-1.0)


def test_it_needs_no_torch() -> None:
    code = (
        "import sys; sys.modules['torch'] = None\n"
        "import finlab\n"
        "a = finlab.Allocator(finlab.load_layout('A'), 'mdn').allocate([1, 0, 0.5, 0, 0, 0.1])\n"
        "assert a.err_norm < 1e-4"
    )
    subprocess.run([sys.executable, "-c", code], timeout=60, check=True)


def test_samples_tell_what_the_plant_says_of_them(
    shipped: AllocatorCache, layout_a: Layout
) -> None:
    plant = Plant(layout_a)
    told = shipped.allocate(layout_a, TARGET).samples
    assert told is not None and len(told) == 48
    assert ((told.command >= plant.lower) & (told.command <= plant.upper)).all()
    np.testing.assert_allclose(told.wrench, plant.wrench(told.command), atol=1e-9)
    error = np.linalg.norm((told.wrench - TARGET) / shipped.on(layout_a).scale, axis=-1)
    np.testing.assert_allclose(told.err_norm, error, rtol=1e-9)
    np.testing.assert_allclose(told.effort, command_effort(told.command, plant.upper), rtol=1e-9)
    np.testing.assert_allclose(told.power, plant.power(told.command).sum(-1), rtol=1e-9)


def test_samples_are_the_proposed_forces(shipped: AllocatorCache, layout_a: Layout) -> None:
    """As near as the compiled fins come, where a fin can give what is proposed."""
    method, target = method_of(shipped, layout_a)
    told = shipped.allocate(layout_a, TARGET).samples
    force = method.proposals(target, 0).force[0]
    assert told is not None
    given = Plant(layout_a).force(told.command)
    fins = method.robot.forces.fins
    able = (np.abs(force) > 2.0 * fins.smallest) & (np.abs(force) < 0.99 * fins.maximum)
    assert able.mean() > 0.5
    np.testing.assert_allclose(
        (given[..., 1] + 1j * given[..., 2])[able], force[able], atol=0.02 * fins.maximum.max()
    )


@pytest.mark.parametrize("policy", ["closest", "direction", "priority"])
def test_out_of_reach_it_delivers_what_the_default_method_does(
    policy: str, shipped: AllocatorCache, layout_a: Layout
) -> None:
    far = 20.0 * np.array(TARGET)
    answer, other = (
        method.allocate(layout_a, far, policy=policy) for method in (shipped, AllocatorCache())
    )
    np.testing.assert_allclose(answer.wrench, other.wrench, atol=1e-3 * answer.scale[0])
    assert answer.effort is not None and other.effort is not None
    assert answer.effort <= other.effort * (1.0 + 1e-6)
    batch = shipped.allocate_batch(layout_a, [far, TARGET], policy=policy)
    np.testing.assert_allclose(batch.wrench[0], other.wrench, atol=1e-3 * answer.scale[0])
    assert batch.err_norm[1] < 1e-6


def test_from_tick_to_tick_no_fin_turns_faster_than_its_servo(shipped: AllocatorCache) -> None:
    layout = load_layout("hexa")
    before = None
    plant = Plant(layout)
    worst = 0.0
    for k in range(30):
        wanted = np.array(TARGET) * np.cos(0.2 * k)
        answer = shipped.allocate(layout, wanted, previous=before)
        if before is not None:
            change = np.abs(answer.command - before)
            turn = change[:, 2]
            change[:, 2] = np.where(plant.full_turn, np.minimum(turn, 2.0 * np.pi - turn), turn)
            assert (change <= 0.1 * layout.rates + 1e-12).all()
        before = answer.command
        worst = max(worst, answer.err_norm)
    assert worst < 0.05
