"""Many targets at once: each row is what a single call would say, policies, failures and damage included."""

import copy
import pickle

import numpy as np
import pytest

from finlab.allocation import Health, Policy
from finlab.assets import shipped_checkpoints
from finlab.errors import AllocationError
from finlab.layout import FinModelSpec, load_layout
from finlab.physics import Plant
from tests.allocation.quick import OF_FINS, quick_allocator
from tests.any_robot import AnyRobot

POLICIES = (
    "direction",
    "priority",
    Policy(axis_weights=(1.0, 1.0, 10.0, 1.0, 1.0, 0.1)),
    Policy("priority", order=(("Tz",), ("Fx", "Fz"))),
)

pytestmark = pytest.mark.skipif(
    not {"default", "paper"} <= set(shipped_checkpoints()), reason="no trained checkpoints in the tree"
)


def wrenches(n: int = 6) -> np.ndarray:
    """Wrenches of which the later ones are out of reach."""
    size = np.geomspace(0.1, 30.0, n)[:, None]
    return size * np.random.default_rng(0).normal(size=(n, 6)) * [1.0, 0.3, 1.0, 0.05, 0.05, 0.1]


@pytest.mark.parametrize("policy", POLICIES, ids=str)
@pytest.mark.parametrize("method", ["dual", "mdn"])
def test_policies_answer_as_in_single_calls(method: str, policy: Policy | str) -> None:
    allocator, layout, targets = quick_allocator(method), load_layout("octo"), wrenches()
    health = Health.of(weak={layout.names[1]: 0.7})
    failed = [layout.names[0]]
    batch = allocator.allocate_batch(layout, targets, failed=failed, policy=policy, health=health, seed=1)
    singles = [
        allocator.allocate(layout, target, failed=failed, policy=policy, health=health, seed=1)
        for target in targets
    ]
    assert 0 < batch.reachable.sum() < len(targets)
    assert batch.reachable.tolist() == [single.reachable for single in singles]
    for row, single in enumerate(singles):
        assert batch.layout == single.layout and batch.failed == single.failed
        if not single.reachable:
            np.testing.assert_array_equal(batch.command[row], single.command)
            np.testing.assert_allclose(batch.err_norm[row], single.err_norm, rtol=1e-12)
            np.testing.assert_allclose(batch.power[row], single.power, rtol=1e-12)


def test_the_plain_policy_shares_the_work_and_reaches_as_much() -> None:
    allocator, layout, targets = AnyRobot(), load_layout("A"), wrenches(20)
    batch = allocator.allocate_batch(layout, targets)
    errors = np.array([allocator.allocate(layout, target).err_norm for target in targets])
    np.testing.assert_allclose(batch.err_norm, errors, rtol=1e-6, atol=1e-5)
    weighted = allocator.allocate_batch(layout, targets, policy=Policy(axis_weights=(1, 1, 10, 1, 1, 1)))
    heave = np.abs(weighted.unallocated[:, 2]) - np.abs(batch.unallocated[:, 2])
    assert (heave <= 1e-2).all() and heave.min() < -0.01


@pytest.mark.parametrize("method", OF_FINS)
def test_batches_are_plain_data_judged_by_the_plant(method: str) -> None:
    allocator, layout, targets = quick_allocator(method), load_layout("ucat"), wrenches(4)
    batch = allocator.allocate_batch(layout, targets, failed=[layout.names[2]], seed=5)
    np.testing.assert_allclose(batch.wrench, Plant(layout).wrench(batch.command), atol=1e-12)
    np.testing.assert_allclose(batch.forces, Plant(layout).fin_forces(batch.command), atol=1e-12)
    np.testing.assert_allclose(batch.err_norm, np.linalg.norm((targets - batch.wrench) / batch.scale, axis=1))
    assert len(batch) == 4 and batch.effort.shape == (4,)
    assert (batch.wrench_expected is not None) == (method == "paper")
    np.testing.assert_allclose(batch.power, np.nansum(Plant(layout).power(batch.command), axis=-1))
    for twin in (pickle.loads(pickle.dumps(batch)), copy.copy(batch), copy.deepcopy(batch)):
        assert twin == batch
    assert allocator.allocate_batch(layout, targets, failed=[layout.names[2]], seed=5) == batch
    assert allocator.allocate_batch(layout, 0.5 * targets, failed=[layout.names[2]], seed=5) != batch


@pytest.mark.parametrize("method", OF_FINS)
def test_empty_batches_have_the_shapes_of_full_ones(method: str) -> None:
    layout = load_layout("A")
    batch = quick_allocator(method).allocate_batch(layout, np.empty((0, 6)))
    assert batch.command.shape == batch.forces.shape == (0, 4, 3) and batch.wrench.shape == (0, 6)
    assert batch.err_norm.shape == batch.effort.shape == batch.solve_ms.shape == batch.reachable.shape == (0,)


@pytest.mark.parametrize("method", OF_FINS)
def test_batches_carry_the_note_about_unknown_fins(method: str) -> None:
    layout = load_layout("A")
    strange = layout.replace_actuator("back_left", model=FinModelSpec("lighthill"))
    batch = quick_allocator(method).allocate_batch(strange, wrenches(2))
    assert batch.unknown_fins == (("back_left",) if method == "paper" else ())
    assert len(batch.notes) == len(batch.unknown_fins) and all("back_left" in note for note in batch.notes)


def test_a_method_that_does_not_know_the_policy_says_so_at_once() -> None:
    allocator, layout = AnyRobot("analytic"), load_layout("A")
    for policy in ("priority", Policy(axis_weights=(2.0, 1.0, 1.0, 1.0, 1.0, 1.0))):
        with pytest.raises(AllocationError, match="minimizes the plain error"):
            allocator.allocate_batch(layout, [[0.1, 0, 0, 0, 0, 0]], policy=policy)
    with pytest.raises(AllocationError, match="health: expected a Health, got 'weak'"):
        allocator.allocate_batch(layout, [[0.1, 0, 0, 0, 0, 0]], health="weak")  # type: ignore[arg-type]
