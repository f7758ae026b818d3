"""Forces of moving fins: the mean, within the cycle, and the soft fin against theory."""

import math

import numpy as np
import pytest

from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout
from finlab.physics import Plant
from finlab.physics.blade import Blade
from finlab.sim.fin_force import FinForce, FlexibleForce, MeanForce, RippleForce, SoftFin
from finlab.vehicle.fin_motion import FinMotion

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


def test_a_fin_that_hangs_still_gives_nothing(pair: Layout) -> None:
    motion = flapping(pair, 0.4, 1.5, 0.8)
    command = motion.command.copy()
    command[0] = np.nan
    motion.step(command, DT)
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


def test_a_plate_that_turns_drags_as_its_strips_do(pair: Layout) -> None:
    """At a steady speed the water that a plate carries pulls along it, so what is left across it is drag."""
    speed, motion, force = 3.0, flapping(pair, 0.0, 0.0, 0.0), RippleForce(pair)
    motion.direction_rate[:] = speed
    blade, dt = Blade(), 1e-4
    for _ in range(3):
        motion.direction[:] += speed * dt
        found = force.step(motion, dt)[0]
    angle = motion.angle[0] + math.pi
    across = found[1:] @ (-math.sin(angle), math.cos(angle))
    edges = np.linspace(0.0, blade.length, 2001)
    middle, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    strips = 0.5 * blade.density * blade.drag_coefficient * blade.width * width * (middle * speed) ** 2
    assert across == pytest.approx(-strips.sum(), rel=1e-3)
    assert (strips * middle).sum() == pytest.approx(blade.drag * speed**2, rel=1e-5), (
        "of torque, not of force"
    )


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
