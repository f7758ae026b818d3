"""What layouts do not say: jets, inflow, and a robot that is not built as drawn."""

import ast
import math
from pathlib import Path

import numpy as np
import pytest

from finlab import load_allocator
from finlab.layout import Layout, load_layout
from finlab.sim import PLANTS, ClosedLoop, make_trajectory
from finlab.sim.fin_force import MeanForce
from finlab.sim.inflow import InflowForce
from finlab.sim.offset import OffsetForce
from finlab.sim.plants import make_plant
from finlab.sim.wake import MOST, WakeForce
from finlab.vehicle.attitude import euler
from finlab.vehicle.body import complete_body
from finlab.vehicle.fin_motion import FinMotion
from finlab.vehicle.vehicle import Vehicle

ROOT = Path(__file__).resolve().parents[2]
TRUTHS = {f"finlab.sim.{name}" for name in ("plants", "wake", "inflow", "offset", "fin_force")}


@pytest.fixture(scope="module")
def robot() -> Layout:
    return load_layout("A")


def beating(layout: Layout, direction: float, amplitude: float = 0.5, frequency: float = 1.0) -> FinMotion:
    motion = FinMotion(layout)
    motion.amplitude[:], motion.frequency[:], motion.direction[:] = amplitude, frequency, direction
    return motion


def test_fins_behind_a_jet_lose_thrust_and_those_before_it_none(robot: Layout) -> None:
    motion = beating(robot, 0.0)
    motion.direction[:] = np.where(MeanForce(robot).columns[:, 1, 0] > 0.0, 0.0, math.pi)
    plain = np.linalg.norm(MeanForce(robot).step(motion, 0.02), axis=1)
    left = np.linalg.norm(WakeForce(robot).step(motion, 0.02), axis=1) / plain
    behind = robot.position[:, 0] < 0.0  # all push ahead
    assert (left[~behind] > 0.98).all() and (left[behind] < 0.95).all()
    assert (left >= 1.0 - MOST).all()


def test_a_jet_aimed_at_a_near_fin_takes_up_to_the_most_and_none_flows_from_a_fin_at_rest() -> None:
    pair = load_layout("pair")
    fins = [fin.name for fin in pair.fins]
    pair = pair.replace_fin(fins[0], position=(0.1, 0.0, 0.0), mounting_angle=-math.pi / 2)
    pair = pair.replace_fin(fins[1], position=(-0.1, 0.0, 0.0), mounting_angle=-math.pi / 2)
    wake = WakeForce(pair)
    forward = np.array([[0.0, 50.0, 0.0], [0.0, 1.0, 0.0]])
    assert MeanForce(pair).columns[0, 1, 0] == pytest.approx(1.0)
    assert 0.9 * MOST < wake.loss(forward)[1] <= MOST and wake.loss(forward)[0] < 1e-6
    aside = np.array([[0.0, 0.0, 50.0], [0.0, 1.0, 0.0]])
    assert wake.loss(aside)[1] < 0.01
    assert not wake.loss(forward * [[0.0], [1.0]])[1] > 1e-9
    assert wake.loss(np.vstack([forward[0] * 0.006, forward[1]]))[1] == pytest.approx(
        wake.loss(forward)[1] / 2, rel=0.02
    )


def test_thrust_falls_with_the_speed_along_it(robot: Layout) -> None:
    motion, inflow = beating(robot, 0.0), InflowForce(robot)
    plain = MeanForce(robot).step(motion, 0.02)
    assert inflow.step(motion, 0.02) == pytest.approx(plain)
    water = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    ahead = inflow.columns[:, 1, 0]  # how much of the thrust is along x
    share = np.linalg.norm(inflow.step(motion, 0.02, water), axis=1) / np.linalg.norm(plain, axis=1)
    tip = 2 * math.pi * 1.0 * 0.5 * 0.2
    np.testing.assert_allclose(share, 1.0 - 0.4 * np.tanh(0.2 * ahead / tip), rtol=1e-9)
    turning = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    spun = np.linalg.norm(inflow.step(motion, 0.02, turning), axis=1) / np.linalg.norm(plain, axis=1)
    lever = inflow.columns[:, 1, 5]  # yaw per newton is the fin's speed along its thrust per yaw rate
    np.testing.assert_allclose(spun, 1.0 - 0.4 * np.tanh(lever / tip), rtol=1e-9)


def test_a_robot_built_askew_feels_its_fins_elsewhere(robot: Layout) -> None:
    true, drawn = OffsetForce(robot), MeanForce(robot)
    motion = beating(robot, 0.7)
    np.testing.assert_array_equal(true.step(motion, 0.02), drawn.step(motion, 0.02))
    turn = np.einsum("nw,nw->n", true.columns[:, 1, :3], drawn.columns[:, 1, :3])
    np.testing.assert_allclose(np.degrees(np.arccos(turn)), 5.0, rtol=1e-6)
    # One newton upwards pitches about the true centre: 1.6 cm further behind, 1.2 cm to the left of it.
    np.testing.assert_allclose(
        true.columns[:, 2, 3:5] - drawn.columns[:, 2, 3:5], np.tile([-0.012, -0.016], (4, 1)), atol=1e-12
    )


def test_the_water_moves_past_a_robot_that_drifts(robot: Layout) -> None:
    vehicle = Vehicle(complete_body(robot), (0.1, -0.05, 0.02))
    rng = np.random.default_rng(5)
    state = rng.standard_normal(13)
    state[3:7] /= np.linalg.norm(state[3:7])
    # The world's axes in the body by the derivative of the position at unit speeds.
    turn = np.array([vehicle.derivative([*state[:7], *row, 0, 0, 0], [0.0] * 6)[:3] for row in np.eye(3)])
    seen = vehicle.velocity_in_water(state)
    np.testing.assert_allclose(seen[:3], state[7:10] - turn @ np.array(vehicle.current), atol=1e-12)
    np.testing.assert_array_equal(seen[3:], state[10:])


@pytest.mark.parametrize("name", ["wake", "inflow", "offset"])
def test_robots_stay_afoot_on_every_truth(name: str, robot: Layout) -> None:
    loop = ClosedLoop(robot, load_allocator(), make_trajectory("circle"), plant=name)
    for _ in range(120):
        loop.step()
    assert np.abs(euler(loop.state[3:7])[:2]).max() < 0.3
    assert np.linalg.norm(loop.log.position[-1] - loop.log.reference[-1]) < 0.5
    given = loop.log.allocated - loop.log.delivered
    assert np.linalg.norm(given[60:].mean(axis=0)) > 0.01


def test_every_truth_is_named() -> None:
    assert list(PLANTS) == ["mean", "ripple", "flexible", "wake", "inflow", "offset"]
    assert isinstance(make_plant("offset", load_layout("pair")), OffsetForce)


def _imported(module: str) -> set[str]:
    """Modules of finlab that a module imports, anywhere in its file."""
    path = ROOT / (module.replace(".", "/") + ".py")
    path = path if path.exists() else ROOT / module.replace(".", "/") / "__init__.py"
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    modules = {name for name in found if name.split(".")[0] == "finlab"}
    base = ROOT
    return {
        name
        for name in modules
        if (base / (name.replace(".", "/") + ".py")).exists() or (base / name.replace(".", "/")).is_dir()
    }


def _reached(modules: set[str]) -> set[str]:
    """Those modules and all that they import, and so on; not the front door, which imports on demand."""
    known: set[str] = set()
    left = set(modules)
    while left:
        module = left.pop()
        known.add(module)
        left |= _imported(module) - known - {"finlab"}
    return known


@pytest.mark.parametrize("room", ["fit", "control"])
def test_what_learns_never_sees_the_truth(room: str) -> None:
    files = (ROOT / "finlab" / room).rglob("*.py")
    own = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in files}
    assert len(own) > 4
    assert not {name for name in _reached(own) if name.startswith("finlab.sim")}


def test_the_check_of_imports_sees_through_other_modules() -> None:
    assert _reached({"finlab.evaluation.experiments.closed_loop"}) >= TRUTHS
