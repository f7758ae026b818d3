"""Fins over time: lag, limits, forces within the cycle, power, and the soft fin against theory."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout
from finlab.physics import Plant
from finlab.physics.blade import OWN_INERTIA, Blade
from finlab.sim.fin_force import FinForce, FlexibleForce, MeanForce, RippleForce, SoftFin
from finlab.sim.fin_motion import FinMotion, Servo, fin_power

DT = 0.01


@pytest.fixture(scope="module")
def pair() -> Layout:
    return load_layout(shipped_layouts()["pair"])


def flapping(layout: Layout, amplitude: float, frequency: float, direction: float) -> FinMotion:
    """Fins that have followed a command for long."""
    motion = FinMotion(layout)
    motion.amplitude[:], motion.frequency[:], motion.direction[:] = amplitude, frequency, direction
    return motion


def cycle_mean(force: FinForce, motion: FinMotion, cycles: int = 10, skip: int = 5) -> np.ndarray:
    """Mean force (3,) of the first fin over whole cycles."""
    command = motion.command.copy()
    per_cycle = round(1.0 / (command[0, 1] * DT))
    forces = []
    for _ in range((cycles + skip) * per_cycle):
        motion.step(command, DT)
        forces.append(force.step(motion, DT)[0])
    return np.mean(forces[skip * per_cycle :], axis=0)


def test_the_filters_are_critically_damped_and_exact(pair: Layout) -> None:
    """Against the differential equation x'' = k (k/4 (x* - x) - x') by SciPy."""
    motion, command = FinMotion(pair), np.array([[0.3, 1.0, 1.2], [0.5, 0.7, -0.4]])
    for _ in range(37):
        motion.step(command, DT)
    for value, aim, k in ((motion.amplitude, command[:, 0], 15.0), (motion.direction, command[:, 2], 7.0)):
        for i in range(2):
            exact = solve_ivp(
                lambda _, y, k=k, goal=aim[i]: [y[1], k * (k / 4 * (goal - y[0]) - y[1])],
                (0.0, 37 * DT),
                [0.0, 0.0],
                rtol=1e-10,
                atol=1e-12,
            )
            assert value[i] == pytest.approx(exact.y[0, -1], abs=1e-8)


def test_fins_turn_the_short_way_over_the_seam(pair: Layout) -> None:
    motion = FinMotion(pair)
    motion.direction[:] = 3.0
    for _ in range(300):
        motion.step(np.tile([0.2, 1.0, -3.0], (2, 1)), DT)
    np.testing.assert_allclose(motion.direction, 2 * math.pi - 3.0, atol=1e-3)


def test_speed_limit_cuts_fast_flapping_and_turning(pair: Layout) -> None:
    motion = FinMotion(pair, Servo(speed_limit=4.0))
    speeds = []
    for _ in range(300):
        motion.step(np.tile([0.6, 2.0, 3.1], (2, 1)), DT)
        speeds.append(np.abs(motion.amplitude * 2 * math.pi * 2.0).max())
    assert max(speeds) <= 4.0 + 1e-9
    free, slow = FinMotion(pair), FinMotion(pair, Servo(speed_limit=0.5))
    for _ in range(50):
        for each in (free, slow):
            each.step(np.tile([0.05, 0.1, 3.0], (2, 1)), DT)
    assert slow.direction[0] < free.direction[0] - 0.5


def test_a_lost_fin_stops_where_it_is_and_gives_nothing(pair: Layout) -> None:
    motion = flapping(pair, 0.4, 1.5, 0.8)
    command = motion.command.copy()
    command[0] = np.nan
    motion.step(command, DT)
    assert motion.amplitude[0] == motion.speed[0] == 0.0
    assert motion.direction[0] == 0.8
    assert (MeanForce(pair).step(motion, DT)[0] == 0.0).all()


@pytest.mark.parametrize("name", ["A", "mixed"])
def test_steady_fins_give_the_plants_force(name: str) -> None:
    layout = load_layout(shipped_layouts()[name])
    motion = FinMotion(layout)
    command = np.tile([0.4, 1.3, 0.7], (layout.n_fins, 1))
    for _ in range(400):
        motion.step(command, DT)
    force = MeanForce(layout).step(motion, DT)
    wanted = np.linalg.norm(Plant(layout).fin_forces(command), axis=1)
    np.testing.assert_allclose(np.linalg.norm(force, axis=1), wanted, rtol=1e-6)


@pytest.mark.parametrize("direction", [0.0, 1.1])
def test_ripple_has_the_mean_of_the_fin_law(pair: Layout, direction: float) -> None:
    mean = MeanForce(pair).step(flapping(pair, 0.45, 2.0, direction), DT)[0]
    ripple = cycle_mean(RippleForce(pair), flapping(pair, 0.45, 2.0, direction))
    np.testing.assert_allclose(ripple, mean, atol=0.01 * np.linalg.norm(mean))


def test_ripple_is_no_small_thing(pair: Layout) -> None:
    motion, force = flapping(pair, 0.4, 1.5, 0.0), RippleForce(pair)
    command = motion.command.copy()
    seen = []
    for _ in range(200):
        motion.step(command, DT)
        seen.append(force.step(motion, DT)[0])
    assert np.std(np.array(seen)[5:, 2]) > np.linalg.norm(MeanForce(pair).step(motion, DT)[0])


def test_a_stiff_soft_fin_is_lighthills_rigid_plate(pair: Layout) -> None:
    """Elongated-body theory of a rigid plate: T = 1/2 m L^2 (2 pi f)^2 a J1(a), along the zero direction."""
    from scipy.special import j1

    amplitude, frequency = 0.5, 1.0
    shape = Blade()
    theory = (
        0.5
        * shape.virtual_mass
        * shape.length**2
        * (2 * math.pi * frequency) ** 2
        * amplitude
        * j1(amplitude)
    )
    soft = FlexibleForce(pair, SoftFin(stiffness=60.0))
    along, across = cycle_mean(soft, flapping(pair, amplitude, frequency, 0.0))[1:]
    assert along == pytest.approx(theory, rel=0.05)
    assert abs(across) < 0.02 * theory


def test_the_soft_fins_thrust_is_of_the_fin_laws_order_and_rises_faster(pair: Layout) -> None:
    ratios = []
    for frequency in (1.0, 2.0):
        law = np.linalg.norm(MeanForce(pair).step(flapping(pair, 0.35, frequency, 0.6), DT)[0])
        soft = cycle_mean(FlexibleForce(pair), flapping(pair, 0.35, frequency, 0.6))
        assert np.arctan2(soft[2], soft[1]) == pytest.approx(0.6, abs=0.03)
        ratios.append(np.linalg.norm(soft) / law)
    assert 0.6 < ratios[0] < 1.0 < ratios[1] < 1.4


def test_mean_inertial_power_is_what_a_sinusoid_has(pair: Layout) -> None:
    """Mean of |I alpha omega| over a cycle: I A^2 (2 pi f)^3 / pi."""
    amplitude, frequency = 0.4, 1.25
    motion = flapping(pair, amplitude, frequency, 0.0)
    command = motion.command.copy()
    inertial, torque = [], []
    for _ in range(10 * round(1 / (frequency * DT))):
        motion.step(command, DT)
        power = fin_power(motion, Blade())
        inertial.append(power.inertial[0])
        torque.append(power.torque[0])
    swing = 2 * math.pi * frequency
    assert np.mean(inertial) == pytest.approx(OWN_INERTIA * amplitude**2 * swing**3 / math.pi, rel=0.01)
    assert np.mean(torque) > np.mean(inertial)
