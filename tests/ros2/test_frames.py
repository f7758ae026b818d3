"""Wrenches in other frames, against rotations and points made by other formulas."""

import math

import numpy as np
import pytest
from finlab_allocator.frames import StaticFrames, rotation_of
from scipy.spatial.transform import Rotation

from finlab.errors import CommandError

IDENTITY = (0.0, 0.0, 0.0, 1.0)
HALF = math.sqrt(0.5)


def test_a_quaternion_turns_as_scipy_has_it() -> None:
    for seed in range(20):
        turn = Rotation.random(random_state=seed)
        np.testing.assert_allclose(rotation_of(turn.as_quat()), turn.as_matrix(), atol=1e-12)


def test_a_force_at_a_mast_is_a_torque_about_the_base() -> None:
    frames = StaticFrames()
    frames.add("base_link", "mast", (0.0, 0.0, 2.0), IDENTITY)
    moved = frames.wrench_in("base_link", "mast", np.array([3.0, 0, 0, 0, 0, 0.5]))
    np.testing.assert_allclose(moved, [3, 0, 0, 0, 6, 0.5], atol=1e-12)


def test_a_frame_with_z_down_changes_signs() -> None:
    frames = StaticFrames()
    frames.add("base_link", "base_link_frd", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    moved = frames.wrench_in("base_link", "base_link_frd", np.arange(1.0, 7.0))
    np.testing.assert_allclose(moved, [1, -2, -3, 4, -5, -6], atol=1e-12)


def test_a_wrench_does_the_same_work_in_each_frame() -> None:
    """Power is the same in each frame: w . v, with the twist of the frame moved by other formulas."""
    rng = np.random.default_rng(1)
    frames = StaticFrames()
    poses: dict[str, tuple[Rotation, np.ndarray]] = {}
    for parent, child in [("hull", "base_link"), ("hull", "pod"), ("pod", "tip")]:
        turn = Rotation.random(random_state=rng)
        place = rng.normal(size=3)
        frames.add(parent, child, tuple(place), tuple(turn.as_quat()))
        above, shift = poses.get(parent, (Rotation.identity(), np.zeros(3)))
        poses[child] = (above * turn, above.apply(place) + shift)
    for _ in range(10):
        wrench = rng.normal(size=6)
        moved = frames.wrench_in("base_link", "tip", wrench)
        velocity, rates = rng.normal(size=(2, 3))  # of the hull's origin, in the hull
        work = []
        twists = []
        for frame, each in (("tip", wrench), ("base_link", moved)):
            turn, place = poses[frame]
            local_velocity = turn.inv().apply(velocity + np.cross(rates, place))
            twist = np.concatenate([local_velocity, turn.inv().apply(rates)])
            twists.append(twist)
            work.append(each @ twist)
        assert work[0] == pytest.approx(work[1], abs=1e-10)
        np.testing.assert_allclose(
            frames.twist_in("base_link", "tip", twists[0]), twists[1], atol=1e-10
        )


def test_the_velocity_of_a_mast_is_that_of_the_base_and_a_lever() -> None:
    frames = StaticFrames()
    frames.add("base_link", "dvl", (0.0, 0.0, -2.0), (0.0, 0.0, HALF, HALF))
    # At the DVL, which looks to the left: 1 m/s along its x, while the robot pitches by 0.5 rad/s
    # about y, which is the DVL's x: the lever of 2 m adds nothing along y, and 1 m/s along x.
    moved = frames.twist_in("base_link", "dvl", np.array([1.0, 0, 0, 0.5, 0, 0]))
    np.testing.assert_allclose(moved, [1.0, 1.0, 0, 0, 0.5, 0], atol=1e-12)


def test_the_base_may_be_the_child_or_stand_apart() -> None:
    frames = StaticFrames()
    frames.add("imu", "base_link", (0.0, 0.0, 1.0), (0.0, 0.0, HALF, HALF))
    wrench = np.array([0.0, 2.0, 0, 0, 0, 0])
    np.testing.assert_allclose(
        frames.wrench_in("base_link", "imu", wrench), [2, 0, 0, 0, -2, 0], atol=1e-12
    )
    np.testing.assert_allclose(frames.wrench_in("base_link", "base_link", wrench), wrench)


def test_what_is_not_known_is_refused_by_name() -> None:
    frames = StaticFrames()
    frames.add("base_link", "dvl", (0.0, 0.0, 0.0), IDENTITY)
    frames.add("map", "odom", (0.0, 0.0, 0.0), IDENTITY)
    for unknown in ("map", "odom", "nowhere"):
        with pytest.raises(CommandError, match=f"frame '{unknown}': no static transform") as error:
            frames.wrench_in("base_link", unknown, np.zeros(6))
        assert str(error.value).endswith("expected one of base_link, dvl")


@pytest.mark.parametrize(
    ("translation", "quaternion"),
    [
        ((math.nan, 0.0, 0.0), IDENTITY),
        ((0.0, math.inf, 0.0), IDENTITY),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, math.nan)),
        ((0.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0)),
    ],
)
def test_what_is_no_pose_is_refused(
    translation: tuple[float, float, float], quaternion: tuple[float, float, float, float]
) -> None:
    frames = StaticFrames()
    with pytest.raises(CommandError, match="frame 'odd': expected finite metres and a unit"):
        frames.add("base_link", "odd", translation, quaternion)
    with pytest.raises(CommandError, match="no static transform leads from it"):
        frames.wrench_in("base_link", "odd", np.zeros(6))


def test_circles_and_floods_end_in_a_sentence() -> None:
    frames = StaticFrames()
    frames.add("a", "b", (0.0, 0.0, 0.0), IDENTITY)
    frames.add("b", "a", (0.0, 0.0, 0.0), IDENTITY)
    with pytest.raises(CommandError, match="make a circle"):
        frames.wrench_in("base_link", "a", np.zeros(6))
    flood = StaticFrames()
    with pytest.raises(CommandError, match="more than 1000 frames are not kept"):
        for k in range(1001):
            flood.add("base_link", f"f{k}", (0.0, 0.0, 0.0), IDENTITY)
    flood.add("base_link", "f3", (1.0, 0.0, 0.0), IDENTITY)  # one that is known may change
