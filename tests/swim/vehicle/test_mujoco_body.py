"""A body in MuJoCo beside our own: the same paths as MuJoCo's step goes to 0, the wrench of the
model's motors, closed loops with faults, and what is refused.

Two integrators judge each other: the core's, of order 4, has the forces of water and actuators as
one wrench; MuJoCo has them from motors at sites, from hinges, and as an external wrench.
"""

from dataclasses import replace

import numpy as np
import pytest

import finlab
from finlab.arrays import Array
from finlab.assets import shipped_layouts
from finlab.errors import FinlabError, LayoutError
from finlab.exchange.mjcf_control import control_of, motor_forces
from finlab.interaction.jets import Jets
from finlab.layout import Body, Layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.swim.simulation import ClosedLoop, Fault, make_trajectory
from finlab.swim.simulation.devices import FORCE, ActuatorForce
from finlab.swim.simulation.excite import excitation
from finlab.swim.vehicle.attitude import quaternion_of
from finlab.swim.vehicle.body_integrator import ActuatorLoad
from finlab.swim.vehicle.fin_motion import FinMotion
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.plants import body_integrator
from finlab.swim.vehicle.vehicle import vehicle_of
from tests.random_robots import KINDS, load, random_robot
from tests.sampled_cases import sampled

mujoco = pytest.importorskip("mujoco", reason="mujoco is an optional extra")

from finlab.swim.vehicle.mujoco_body import MujocoBody  # noqa: E402

DT = 0.02
"""A period in which actuators give the same [s]."""
CURRENT = (0.1, -0.05, 0.02)
"""Velocity of the water [m/s]."""
WATER = np.array([0.8, 0.1, -0.1, 0.0, 0.0, 0.1])
"""How the water meets rudders [m/s, rad/s]."""
SHARE = 0.1
"""Of their forces that actuators give: all of random ones would spin a small robot."""

SMALL_ROBOTS = sorted(set(shipped_layouts()) - {"drillship", "supply"})
"""Shipped robots; ships have no mass, and U-CAT's would be thrown about by their thrusters."""


def uneven_body(layout: Layout) -> Layout:
    """A robot that floats up, whose water lifts it beside its centre of gravity."""
    body = complete_body(layout)
    assert body.mass_kg is not None
    lift = 1.02 * 9.81 * body.mass_kg
    return replace(
        layout, body=replace(body, center_of_buoyancy_m=(0.01, -0.02, 0.05), buoyancy_n=lift)
    )


def start() -> Array:
    """A state (13,) under way, heeling."""
    turn = quaternion_of(0.3, -0.2, 0.7)
    return np.array([1.0, -2.0, -3.0, *turn, 0.3, -0.1, 0.05, 0.2, -0.1, 0.3])


def random_load(layout: Layout, seed: int, seconds: float) -> ActuatorLoad:
    """What actuators give that follow another random command every half second."""
    rng = np.random.default_rng(seed)
    forces = ActuatorForce(layout, FinMotion(layout))
    share = np.full(layout.n, SHARE)
    water = WATER if forces.feels_flow else None
    parts = []
    for _ in range(round(seconds / 0.5)):
        command = rng.uniform(layout.lower, layout.upper)
        moved = forces.move(command, DT, round(0.5 / DT))
        output = forces.output(moved, DT, share, water)
        wrench = forces.wrench(output[..., FORCE], water)
        parts.append(ActuatorLoad(wrench, output[..., FORCE], moved.others))
    return ActuatorLoad(*map(np.concatenate, zip(*parts, strict=True)))


@pytest.mark.parametrize("kind", sampled(KINDS, every=3))
def test_paths_agree_as_the_step_goes_to_0(kind: str) -> None:
    layout = uneven_body(load(random_robot(kind, 0, 5)))
    given = random_load(layout, 0, 3.0)
    own = vehicle_of(layout, CURRENT).advance(start(), given, DT)
    off = []
    for step_s in (DT, DT / 2, DT / 4):
        states = MujocoBody(layout, CURRENT, step_s).advance(start(), given, DT)
        off.append(np.abs(states - own).max(axis=0))
    assert np.linalg.norm(own[-1, :3] - own[0, :3]) > 0.3, "it moved"
    for coarse, fine in zip(off, off[1:], strict=False):
        assert fine.max() < 0.3 * coarse.max(), "of order 2: a quarter at half of the step"
    assert off[-1][:7].max() < 1e-4, "metres, parts of a quaternion"
    assert off[-1][7:].max() < 1e-3, "metres a second, radians a second"


@pytest.mark.parametrize("kind", sampled([kind for kind in KINDS if kind != "rudders"], every=4))
def test_the_models_motors_give_the_wrench(kind: str) -> None:
    """MuJoCo computes it by the sites' places and axes and by the hinges' angles."""
    layout = load(random_robot(kind, 1, 5))
    given = random_load(layout, 1, 0.5)
    body = MujocoBody(layout)
    at_rest = np.array([0.0, 0.0, 0.0, 1.0, *9 * [0.0]])
    for k in range(0, len(given.wrench), 7):
        one = ActuatorLoad(*(values[k : k + 1] for values in given))
        body.advance(at_rest, one, 1e-9)
        mujoco.mj_forward(body.model, body.data)
        np.testing.assert_allclose(body.data.qfrc_actuator[:6], one.wrench[0], atol=1e-9)


def test_what_no_motor_gives_is_the_rudders_and_the_jets_part() -> None:
    layout = load(random_robot("rudders", 0, 5))
    given = random_load(layout, 2, 0.5)
    command = np.zeros(given.force.shape)
    command[:, ~layout.is_fin] = given.others
    by_motors = motor_forces(layout, control_of(layout, command, given.force))
    is_rudder = np.array([part.KIND.driven_by_flow for part in layout.actuators])
    assert is_rudder.any() and np.abs(given.force[:, is_rudder]).max() > 0.01
    assert not by_motors[:, is_rudder].any()
    np.testing.assert_allclose(by_motors[:, ~is_rudder], given.force[:, ~is_rudder], atol=1e-12)

    thrusters = uneven_body(replace(finlab.load_layout("bluerov2_heavy"), interaction=Jets()))
    given = random_load(thrusters, 3, 2.0)
    effectiveness = own_effectiveness(thrusters).reshape(-1, 6)
    of_motors = given.force.reshape(len(given.force), -1) @ effectiveness
    assert np.abs(given.wrench - of_motors).max() > 1e-3, "jets meet each other"
    own = vehicle_of(thrusters, CURRENT).advance(start(), given, DT)
    states = MujocoBody(thrusters, CURRENT).advance(start(), given, DT)
    np.testing.assert_allclose(states[:, :7], own[:, :7], atol=1e-4)


def test_moments_of_no_solid_are_as_drawn() -> None:
    """MuJoCo's compiler would balance them."""
    body = Body(mass_kg=10.0, inertia_kgm2=(0.1, 0.1, 0.9))
    layout = replace(finlab.load_layout("bluerov2"), body=body)
    given = random_load(layout, 4, 2.0)
    own = vehicle_of(layout).advance(start(), given, DT)
    states = MujocoBody(layout).advance(start(), given, DT)
    np.testing.assert_allclose(states, own, atol=1e-4)


@pytest.mark.parametrize("name", sampled(SMALL_ROBOTS, every=4))
def test_shipped_robots_swim_as_in_our_own_plant(name: str) -> None:
    """Through the closed loop, whose noise is the same."""
    layout = finlab.load_layout(name)
    paths = []
    for plant in ("finlab", "mujoco"):
        loop = ClosedLoop(
            layout,
            finlab.Allocator(layout),
            make_trajectory("circle"),
            plant=plant,
            current=CURRENT,
            seed=3,
        )
        for _ in range(30):
            loop.step()
        paths.append(loop.log.position)
    assert np.abs(paths[0] - paths[1]).max() < 1e-3


@pytest.mark.parametrize("kind", ["lost", "torn", "stuck"])
def test_faults_and_truths_are_those_of_any_swim(kind: str) -> None:
    layout = finlab.load_layout("catamaran")
    fault = Fault(layout.names[0], 2.0, kind)  # type: ignore[arg-type]
    logs = []
    for plant in ("finlab", "mujoco"):
        loop = ClosedLoop(
            layout,
            finlab.Allocator(layout),
            make_trajectory("circle"),
            failures=[fault],
            truth=uneven_body(layout),
            plant=plant,
            seed=4,
        )
        for _ in range(60):
            loop.step()
        logs.append(loop.log)
    own, other = logs
    assert own.alive[-1].tolist() == other.alive[-1].tolist()
    assert np.abs(own.position - other.position).max() < 1e-3
    assert np.abs(own.measured - other.measured).max() < 1e-2
    np.testing.assert_allclose(own.force, other.force, atol=0.05 * np.abs(own.force).max())


def test_a_swim_that_excites_takes_a_plant() -> None:
    loop = excitation(finlab.load_layout("A"), 60.0, plant="mujoco")
    assert isinstance(loop.vehicle, MujocoBody)
    loop.step()


def test_what_is_refused() -> None:
    layout = finlab.load_layout("bluerov2")
    with pytest.raises(FinlabError, match="plant: expected one of finlab, mujoco, got 'gazebo'"):
        body_integrator("gazebo", layout, (0.0, 0.0, 0.0))
    with pytest.raises(LayoutError, match="expected a velocity of three finite numbers"):
        MujocoBody(layout, (0.0, np.nan, 0.0))
    tumbling = start()
    tumbling[10:] = 1e6
    with pytest.raises(LayoutError, match="its motion changes"):
        MujocoBody(layout).advance(tumbling, random_load(layout, 0, 0.5), DT)


def test_a_light_body_that_water_holds_takes_shorter_steps() -> None:
    """Damping that a step of MuJoCo would not bear."""
    body = Body(
        mass_kg=0.1, inertia_kgm2=(1e-3, 1e-3, 1e-3), linear_damping=(*3 * [40.0], *3 * [0.05])
    )
    layout = replace(finlab.load_layout("bluerov2"), body=body)
    given = random_load(layout, 5, 1.0)
    own = vehicle_of(layout).advance(start(), given, DT)
    states = MujocoBody(layout).advance(start(), given, DT)
    np.testing.assert_allclose(states[-1], own[-1], atol=0.02)
