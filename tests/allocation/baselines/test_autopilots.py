"""PX4's and ArduSub's allocation: numbers by hand, what they promise at limits, and what robots
they take."""

from dataclasses import replace

import numpy as np
import pytest

from finlab import Allocator, load_layout
from finlab.allocation.baselines.autopilots import (
    ArduSub,
    Px4,
    Px4Settings,
    frame_factors,
    normalised,
)
from finlab.arrays import Array
from finlab.errors import AllocationError, LayoutError
from finlab.exchange.motor_factors import FRAMES, SIGNS
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.physics.objective import wrench_scale_of

HEAVY = load_layout("bluerov2_heavy")
"""Eight thrusters, for which PX4's results were worked out by hand."""
GOLDEN = {
    (20, 0, 0, 0, 0, 0): (-7.0711, -7.0711, 7.0711, 7.0711, 0.4661, 0.4661, -0.4661, -0.4661),
    (0, 20, 0, 0, 0, 0): (-7.2202, 7.2202, -6.9219, 6.9219, -0.2558, 0.2558, -0.2558, 0.2558),
    (0, 0, 20, 0, 0, 0): (0, 0, 0, 0, -5, -5, -5, -5),
    (0, 0, 0, 2, 0, 0): (0, 0, 0, 0, 2.3256, -2.3256, 2.3256, -2.3256),
    (0, 0, 0, 0, 2, 0): (0, 0, 0, 0, 4.2373, 4.2373, -4.2373, -4.2373),
    (0, 0, 0, 0, 0, 2): (-2.9836, 2.9836, 2.9836, -2.9836, 0, 0, 0, 0),
    (30, 15, -20, 0, 1, 3): (-20.4971, -0.7161, 9.8905, 11.3227, 7.6259, 8.0097, 1.9903, 2.3741),
}
"""Wrench [N, N m] -> forces of the pseudo-inverse [N]."""


def px4(layout: Layout, desaturation: str = "sequential") -> Px4:
    """PX4's method of a robot, with the way in which it gives up axes."""
    return Px4(layout, Px4Settings(desaturation), wrench_scale_of(layout))


def forces(layout: Layout, method: str, target: Array, **settings: str) -> Array:
    """Forces (n,) [N] that a method gives for a wrench."""
    command: Array = Allocator(layout, method, **settings).allocate(target).command[:, 0]
    return command


@pytest.mark.parametrize("wrench", GOLDEN)
@pytest.mark.parametrize("form", ["none", "sequential", "axes"])
def test_within_its_limits_px4_is_the_pseudo_inverse(wrench: tuple[float, ...], form: str) -> None:
    np.testing.assert_allclose(
        forces(HEAVY, "px4", np.array(wrench, float), desaturation=form), GOLDEN[wrench], atol=6e-5
    )


def test_the_mix_is_normalised_as_px4_does() -> None:
    mix = px4(HEAVY).mix
    tilt = np.sqrt((mix[:, :2] ** 2).sum(axis=0) / ((mix[:, :2] != 0.0).sum(axis=0) / 2.0))
    assert tilt.max() == pytest.approx(1.0) and mix[:, 2].max() == pytest.approx(1.0)
    for column in np.abs(mix[:, 3:].T):
        assert column[column > 0.0].mean() == pytest.approx(1.0)
    # A quadrotor by hand: four rotors up, at arms of 1, with a torque of 0.05 N m per newton.
    x = np.array([1.0, -1, 1, -1])
    y = np.array([1.0, -1, -1, 1])
    turn = np.array([1.0, 1, -1, -1])
    quad = np.array([-y, x, 0.05 * turn, 0 * x, 0 * x, -np.ones(4)])
    mix, scale = normalised(np.linalg.pinv(quad))
    expected = np.array([-y * 0.5**0.5, x * 0.5**0.5, turn, 0 * x, 0 * x, -np.ones(4)]).T
    np.testing.assert_allclose(mix, expected, atol=1e-12)
    np.testing.assert_allclose(scale, [0.25 * 2**0.5] * 2 + [5.0] + [0.25] * 3)


def test_at_its_limits_px4_keeps_roll_and_gives_up_yaw_and_lift() -> None:
    plant = plant_of(HEAVY)
    target = np.array([0.0, 0, 150, 12, 0, 60])
    wrench = plant.wrench(Allocator(HEAVY, "px4").allocate(target).command)
    clipped = plant.wrench(Allocator(HEAVY, "px4", desaturation="none").allocate(target).command)
    assert wrench[3] == pytest.approx(12.0, rel=1e-3) and clipped[3] < 11.5
    assert wrench[2] < 150 and 0 < wrench[5] < 60


def test_desaturation_makes_the_excess_of_both_sides_alike() -> None:
    """Of a column along which outputs are moved as they like, both ends are equally far beyond."""
    method = px4(HEAVY)
    u = np.zeros((1, 8))
    u[0, :4] = 1.5, -0.2, -0.2, 1.0  # along yaw, + - - +
    moved = method._desaturated(u, 2)
    np.testing.assert_allclose(moved[0, 4:], 0.0)
    # First by -0.5: 1.0, 0.3, 0.3, 0.5; then nothing is beyond.
    np.testing.assert_allclose(moved[0, :4], [1.0, 0.3, 0.3, 0.5], atol=1e-9)


@pytest.mark.parametrize("name", FRAMES)
def test_a_frame_of_ardusub_is_known_in_any_order_and_any_way_round(name: str) -> None:
    factors = FRAMES[name]
    rng = np.random.default_rng(len(factors))
    order = rng.permutation(len(factors))
    sign = rng.choice([-1.0, 1.0], len(factors))
    lever = rng.uniform(0.85, 1.0, factors.shape) * np.array([0.2, 0.12, 0.17, 1, 0.7, 0.7])
    own = sign[:, None] * factors[order] * lever
    found = frame_factors(own + rng.uniform(-0.01, 0.01, own.shape) * (own == 0.0))
    np.testing.assert_array_equal(found, sign[:, None] * factors[order])


def test_bluerov2_heavy_has_the_factors_of_its_frame() -> None:
    method = ArduSub(HEAVY, ArduSub.settings_class(), wrench_scale_of(HEAVY))
    np.testing.assert_array_equal(method.factors, FRAMES["VECTORED_6DOF"])
    lost = HEAVY.without(["rear_left", "lift_front_left"])
    method = ArduSub(lost, ArduSub.settings_class(), wrench_scale_of(HEAVY))
    np.testing.assert_array_equal(
        method.factors, np.delete(FRAMES["VECTORED_6DOF"], [3, 5], axis=0)
    )


@pytest.mark.parametrize("axis", range(6))
def test_one_axis_of_ardusub_alone_gives_what_is_asked_up_to_its_limits(axis: int) -> None:
    """Without arms that couple axes a demand gives its wrench; too much of it gives the same
    direction."""
    level = [replace(part, position=(*part.position[:2], 0.0)) for part in HEAVY.actuators]
    plant = plant_of(replace(HEAVY, actuators=tuple(level)))
    allocator = Allocator(plant.layout, "ardusub")
    target = np.zeros(6)
    target[axis] = 5.0 if axis < 3 else 1.0
    near = plant.wrench(allocator.allocate(target).command)
    assert near[axis] == pytest.approx(target[axis])
    command_out_of_reach = allocator.allocate(1e3 * target).command
    np.testing.assert_allclose(
        plant.wrench(command_out_of_reach)[axis] * near / target[axis],
        plant.wrench(command_out_of_reach),
        atol=1e-9,
    )
    assert ((command_out_of_reach == plant.lower) | (command_out_of_reach == plant.upper))[
        :, 0
    ].any()


def test_ardusub_scales_its_groups_apart() -> None:
    allocator = Allocator(HEAVY, "ardusub")
    both = allocator.allocate([400.0, 0, 20, 0, 0, 0]).command[:, 0]
    np.testing.assert_allclose(both[4:], [-5.0] * 4)
    np.testing.assert_allclose(np.abs(both[:4]), [39.91] * 4)
    signs = SIGNS[4] * FRAMES["VECTORED_6DOF"][:4, 4]
    np.testing.assert_array_equal(np.sign(both[:4]), signs)


@pytest.mark.parametrize("method", ["px4", "ardusub"])
def test_they_take_thrusters_alone_and_no_policy(method: str) -> None:
    with pytest.raises(
        LayoutError, match=f"method {method} works for robots of thrusters only, and .* is of type"
    ):
        Allocator(load_layout("turtle_hybrid"), method)
    with pytest.raises(AllocationError, match=f"method '{method}' minimizes the plain error"):
        Allocator(HEAVY, method).allocate(np.zeros(6), policy="priority")


def test_a_setpoint_of_px4_turns_and_pushes_in_its_frame() -> None:
    """Of x forward, y right, z down: roll, pitch and yaw, then surge, sway and heave."""
    method = px4(HEAVY)
    wrench_of_setpoint = method.plant.effectiveness[:, 0].T * method._largest @ method.mix
    from_own_frame = np.kron(np.eye(2), np.diag([1.0, -1.0, -1.0]))
    given = (from_own_frame @ wrench_of_setpoint)[[3, 4, 5, 0, 1, 2]]
    assert (np.diag(given) > 0.0).all()
    # A setpoint of 1 asks for the unit of its axis.
    along_axis = np.abs(np.diag(wrench_of_setpoint[[3, 4, 5, 0, 1, 2]]))
    np.testing.assert_allclose(along_axis, method.setpoint_unit[[3, 4, 5, 0, 1, 2]], rtol=2e-3)


def test_px4_takes_the_stronger_way_of_each_thruster_for_its_full_strength() -> None:
    ends = [(-50.0, 20.0), (-20.0, 50.0), (-30.0, 30.0), (0.0, 40.0)] * 2
    uneven = [replace(part, force=force) for part, force in zip(HEAVY.actuators, ends, strict=True)]
    method = px4(replace(HEAVY, actuators=tuple(uneven)))
    np.testing.assert_allclose(method._largest, np.abs(ends).max(axis=1))
    np.testing.assert_allclose(method._low * method._largest, np.array(ends)[:, 0])
    np.testing.assert_allclose(method._high * method._largest, np.array(ends)[:, 1])


def test_yaw_may_exceed_the_range_of_px4_by_its_margin() -> None:
    method = px4(HEAVY)
    column = method.mix[:, 2]
    forward = int(np.flatnonzero(column > 0.5)[0])
    edge = method._high[forward] + 0.15 * (method._high - method._low)[forward]
    for beyond, moves in ((-0.01, False), (0.01, True)):
        u = np.zeros((1, 8))
        u[0, forward] = edge + beyond
        moved = method._desaturated(u, 2, margin=0.15)
        assert bool((moved != u).any()) == moves
    # What is beyond on the other side has no margin.
    u = np.zeros((1, 8))
    u[0, forward] = method._low[forward] - 0.01
    assert (method._desaturated(u, 2, margin=0.15) != u).any()


def test_a_half_step_back_leaves_both_excesses_of_px4_alike() -> None:
    """The whole step brings one end within and takes the other one out as far; half of that is
    taken back."""
    method = px4(HEAVY)
    heave = method.mix[:, 5]
    first, second = np.flatnonzero(np.abs(heave) >= 0.2)[:2]
    assert heave[first] == pytest.approx(heave[second])
    u = np.zeros((1, 8))
    u[0, first] = method._high[first] + 0.4
    u[0, second] = method._low[second]
    moved = method._desaturated(u, 5)[0]
    assert moved[first] - method._high[first] == pytest.approx(0.2)
    assert method._low[second] - moved[second] == pytest.approx(0.2)


@pytest.mark.parametrize("group", [(0, 1, 3), (2, 4, 5)])
def test_each_group_of_ardusub_is_scaled_down_until_all_its_thrusters_fit(
    group: tuple[int, ...],
) -> None:
    """By the one that exceeds its own limits most, on the side on which it pushes."""
    ends = [(-20.0, 50.0), (-50.0, 20.0), (-30.0, 45.0), (-45.0, 30.0)] * 2
    uneven = [replace(part, force=force) for part, force in zip(HEAVY.actuators, ends, strict=True)]
    layout = replace(HEAVY, actuators=tuple(uneven))
    low, high = np.array(ends).T
    allocator = Allocator(layout, "ardusub")
    wrench_axis = [3, 4, 5, 2, 0, 1]  # of roll, pitch, yaw, throttle, forward, lateral
    rng = np.random.default_rng(6)
    for _ in range(8):
        target = np.zeros(6)
        target[[wrench_axis[column] for column in group]] = rng.normal(size=3)
        force = 1e3 * forces(layout, "ardusub", 1e-3 * target)
        share = np.where(force > 0.0, high, low) / np.where(np.abs(force) > 1e-9, force, np.nan)
        fits = float(np.nanmin(share))
        np.testing.assert_allclose(
            allocator.allocate(3.0 * fits * target).command[:, 0], fits * force, atol=1e-6
        )
        np.testing.assert_allclose(
            allocator.allocate(0.9 * fits * target).command[:, 0], 0.9 * fits * force, atol=1e-6
        )


def test_a_setpoint_of_ardusub_asks_for_the_mean_of_both_ways_of_all_thrusters() -> None:
    method = ArduSub(HEAVY, ArduSub.settings_class(), wrench_scale_of(HEAVY))
    full = np.mean([0.5 * (part.force[1] - part.force[0]) for part in HEAVY.actuators])
    wrench_of_column = method.plant.effectiveness[:, 0].T @ (full * method.factors)
    for column, axis in enumerate([3, 4, 5, 2, 0, 1]):
        along_axis = SIGNS[column] * wrench_of_column[axis, column]
        assert method.setpoint_unit[axis] == pytest.approx(along_axis)


def test_an_axis_of_little_force_or_torque_counts_beside_its_own_kind_alone() -> None:
    """Torques are small numbers beside forces, and still are served."""
    factors = FRAMES["VECTORED_6DOF"]
    lever = np.array([0.05, 0.04, 0.06, 1.0, 0.9, 0.9])
    np.testing.assert_array_equal(frame_factors(factors * lever), factors)
    # Where one axis is hardly served beside its kind, the frame is not meant: geometry suggests.
    uneven = lever * np.linspace(0.8, 1.0, len(factors))[:, None]
    np.testing.assert_array_equal(frame_factors(factors * uneven), factors)
    for weak in range(6):
        traces = factors * uneven * np.where(np.arange(6) == weak, 0.05, 1.0)
        strongest = np.abs(traces).max(axis=0)
        np.testing.assert_allclose(frame_factors(traces), traces / strongest)
