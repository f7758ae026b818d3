"""Open axes are filled with what the actuators give along with the wanted ones."""

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout
from finlab.layout.damage import NO_DAMAGE, Damage
from finlab.layout.effectiveness import layout_effectiveness
from finlab.swim.control import Completion

AXES = ("Fx", "Fz", "Tz")
"""Axes that a controller asks for."""
WANTED_INDICES = [0, 2, 5]
"""Their indices in a wrench."""


def shipped(name: str) -> Layout:
    """A shipped robot by its name."""
    return load_layout(shipped_layouts()[name])


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_the_papers_layouts_hold_the_open_axes_at_zero(name: str) -> None:
    complete = Completion(shipped(name), NO_DAMAGE, AXES)
    assert complete.controllable
    wrench = np.array([4.0, 9.0, 1.0, 9.0, 9.0, 0.3])
    np.testing.assert_allclose(complete(wrench), [4.0, 0, 1.0, 0, 0, 0.3], atol=1e-9)


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_any_one_fin_lost_leaves_them_controllable_and_the_target_reachable(name: str) -> None:
    robot = shipped(name)
    for fin in robot.names:
        complete = Completion(robot, Damage([fin]), AXES)
        assert complete.controllable, fin
        wrench = np.array([4.0, 0, 1.0, 0, 0, 0.3])
        full = complete(wrench)
        np.testing.assert_allclose(full[WANTED_INDICES], wrench[WANTED_INDICES], atol=1e-9)
        planar = layout_effectiveness(robot.without([fin]))
        rest = full - planar @ np.linalg.lstsq(planar, full, rcond=None)[0]
        np.testing.assert_allclose(rest, 0.0, atol=1e-8)


def test_open_axes_are_as_small_as_they_can_be() -> None:
    """Against a search over all forces that give the wanted axes exactly."""
    robot = shipped("A")
    lost = ("front_left", "front_right")
    wrench = np.array([3.0, 0, 0.8, 0, 0, 0.2])
    full = Completion(robot, Damage(lost), AXES)(wrench)
    planar = layout_effectiveness(robot.without(lost))
    scale = np.array([1, 1, 1, 4, 4, 4])

    def size(w: np.ndarray) -> float:
        return float(np.linalg.norm((w * scale)[[1, 3, 4]]))

    particular = np.linalg.lstsq(planar[WANTED_INDICES], wrench[WANTED_INDICES], rcond=None)[0]
    null = np.linalg.svd(planar[WANTED_INDICES])[2][3:].T
    rng = np.random.default_rng(0)
    others = [size(planar @ (particular + null @ (5 * rng.standard_normal(1)))) for _ in range(500)]
    assert size(full) <= min(others) + 1e-9


ROV_AXES = ("Fx", "Fy", "Fz", "Tz")
"""What is asked of a vehicle of thrusters."""
ROV_INDICES = [0, 1, 2, 5]


def test_what_a_stuck_thruster_pushes_is_made_up_for_in_the_wanted_axes() -> None:
    """Five thrusters are left of six: they cannot hold the open axes as well, and must not try."""
    robot = shipped("bluerov2")
    rng = np.random.default_rng(0)
    allocator = Allocator(robot)
    for name in robot.names:
        damage = Damage(stuck={name: float(rng.uniform(-6.0, 6.0))})
        wanted = rng.uniform(-4.0, 4.0, 6) * (1.0, 1.0, 1.0, 0.0, 0.0, 0.2)
        asked = Completion(robot, damage, ROV_AXES)(wanted)
        np.testing.assert_allclose(asked[ROV_INDICES], wanted[ROV_INDICES], atol=1e-9)
        given = allocator.allocate(asked, damage=damage, policy="closest").wrench
        np.testing.assert_allclose(given, asked, atol=1e-6)


def test_open_axes_beside_a_stuck_thruster_are_as_small_as_they_can_be() -> None:
    """Against a search over all forces that give the wanted axes exactly."""
    robot = shipped("bluerov2_heavy")
    damage = Damage(lost=["lift_rear_left"], stuck={"lift_front_right": 7.0})
    wanted = np.array([3.0, 1.0, 2.0, 0.0, 0.0, 0.4])
    asked = Completion(robot, damage, ROV_AXES)(wanted)
    B = layout_effectiveness(robot)
    constant = 7.0 * B[:, robot.index("lift_front_right")]
    others = B[:, [k for k, n in enumerate(robot.names) if n not in {*damage.lost, *damage.stuck}]]
    B_c = others[ROV_INDICES]
    particular = np.linalg.lstsq(B_c, (wanted - constant)[ROV_INDICES], rcond=None)[0]
    null_basis = np.linalg.svd(B_c)[2][len(B_c) :].T
    rng = np.random.default_rng(0)
    forces = particular + 20.0 * rng.standard_normal((2000, null_basis.shape[1])) @ null_basis.T
    torques = np.linalg.norm((forces @ others.T + constant)[:, [3, 4]], axis=1)
    assert np.linalg.norm(asked[[3, 4]]) <= torques.min() + 1e-9
    # And it is one of them.
    rest = asked - constant
    nearest = others @ np.linalg.lstsq(others, rest, rcond=None)[0]
    np.testing.assert_allclose(nearest, rest, atol=1e-9)


def test_a_pod_that_no_longer_turns_pushes_along_one_direction() -> None:
    robot = shipped("catamaran")
    pod = next(part for part in robot.actuators if part.KIND.sticks_at_angle)
    axes = ("Fx", "Fy", "Tz")
    angle = 0.5 * (pod.lower[0] + pod.upper[0])
    stuck = Completion(robot, Damage(stuck={pod.name: angle}), axes)
    running = Completion(robot, Damage(running={pod.name: (angle, 5.0)}), axes)
    lost = Completion(robot, Damage(lost=[pod.name]), axes)
    # One more direction than without it; and where it runs on, the same that are left without it.
    assert np.linalg.matrix_rank(stuck.matrix) == 3
    np.testing.assert_allclose(running.matrix, lost.matrix, atol=1e-9)
    wanted = np.array([4.0, 1.0, 0.0, 0.0, 0.0, 2.0])
    damage = Damage(stuck={pod.name: angle})
    given = Allocator(robot).allocate(stuck(wanted), damage=damage, policy="closest").wrench
    np.testing.assert_allclose(given[[0, 1, 5]], wanted[[0, 1, 5]], atol=1e-6)


def test_the_last_one_that_obeys_may_be_stuck() -> None:
    robot = shipped("bluerov2")
    damage = Damage(lost=robot.names[1:], stuck={robot.names[0]: 2.0})
    complete = Completion(robot, damage, ROV_AXES)
    assert not complete.controllable
    constant = 2.0 * layout_effectiveness(robot)[:, 0]
    np.testing.assert_allclose(complete(np.ones(6)), constant, atol=1e-12)
