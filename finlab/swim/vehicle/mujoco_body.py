"""A robot's body in MuJoCo (extra `mujoco`), in place of `vehicle.py`.

The model is the one that `finlab layout convert ROBOT out.xml` writes. MuJoCo integrates its rigid
body; motors at sites push with the forces of thrusters, pods and fins, whose hinges stand at the
angles that the layout's lags and rates lead to. As an external wrench comes what the model has no
motor for: the forces of rudders, forces across a motor, what actuators do to each other, and the
water. MuJoCo's own fluid is off: it leaves out the added mass that resists acceleration. The water
is Fossen's, as in `vehicle.py`: added mass, its Coriolis and Munk's terms, damping, buoyancy, and
a current.

Each step is one of the midpoint rule, of order 2: `mj_step` over half of it, by the external wrench
at its beginning, and from there again over all of it, by that at its middle.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from finlab.arrays import Array
from finlab.exchange.exchange import Exchange
from finlab.exchange.mjcf_control import control_of, motor_forces
from finlab.exchange.mjcf_write import write_mjcf
from finlab.layout import Layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.swim.vehicle.attitude import rotation_of_quaternion, to_body, to_world
from finlab.swim.vehicle.body_integrator import ActuatorLoad
from finlab.swim.vehicle.fossen import complete_body, water_wrench
from finlab.swim.vehicle.vehicle import STATE_SIZE, Vehicle

STEP_S = 0.005
"""Longest step of MuJoCo [s]."""
POSE = slice(0, 7)
"""Of `qpos`: place [m] and quaternion (w, x, y, z) of the robot's free joint."""
LINEAR = slice(0, 3)
"""Of `qvel` and `qfrc_applied` at the free joint: along the world's axes."""
ANGULAR = slice(3, 6)
"""Of the same: about the body's own axes."""


class MujocoBody:
    """The body of one robot; it keeps nothing from one call to the next."""

    def __init__(
        self, layout: Layout, current: Sequence[float] = (0.0, 0.0, 0.0), step_s: float = STEP_S
    ) -> None:
        """Makes the model.

        Args:
            layout: the robot; what its body does not say is U-CAT's.
            current: velocity (3,) of the water in the world [m/s].
            step_s: longest step of MuJoCo [s].

        Raises:
            LayoutError: the current is no velocity.
        """
        body = complete_body(layout)
        assert body.mass_kg is not None and body.inertia_kgm2 is not None
        self._layout = layout
        self._vehicle = Vehicle(body, current)
        self._mass = body.mass_kg
        self._moments = body.inertia_kgm2
        self._step_s = step_s
        self._effectiveness = own_effectiveness(layout).reshape(-1, 6)
        self._other_indices = np.flatnonzero(~layout.is_fin)
        self.model = _model_of(replace(layout, body=body))
        """The model in MuJoCo."""
        self.data = mujoco.MjData(self.model)
        """Its state after the last step."""
        of_joint = mujoco.mjtTrn.mjTRN_JOINT
        self._servos = np.flatnonzero(self.model.actuator_trntype == of_joint)
        hinges = self.model.actuator_trnid[self._servos, 0]
        self._angles = self.model.jnt_qposadr[hinges]

    @property
    def current(self) -> tuple[float, ...]:
        """Velocity of the water (3,) in the world [m/s]."""
        return self._vehicle.current

    def velocity_in_water(self, state: Array) -> Array:
        """Returns the velocity relative to the water and the angular rates (6,) of a state (13,),
        body frame [m/s, rad/s]."""
        return self._vehicle.velocity_in_water(state)

    def advance(self, state: Array, load: ActuatorLoad, dt: float) -> Array:
        """Returns the states (K, 13) after each of K periods.

        Args:
            state: at the beginning (13,).
            load: what the actuators give in each period.
            dt: a period [s].

        Raises:
            LayoutError: the body moves too fast to be simulated.
        """
        count = len(load.wrench)
        control = self._control(load)
        by_motors = motor_forces(self._layout, control).reshape(count, -1) @ self._effectiveness
        without_motor = load.wrench - by_motors
        states = np.empty((count, STATE_SIZE))
        for k in range(count):
            self._begin(state, control[k])
            n_steps = max(math.ceil(dt / self._step_s - 1e-9), self._vehicle.n_steps(state[7:], dt))
            for _ in range(n_steps):
                self._step(load.wrench[k].tolist(), without_motor[k].tolist(), dt / n_steps)
            state = states[k] = self._state()
        return states

    def _control(self, load: ActuatorLoad) -> Array:
        """The ctrl (K, nu) in each period."""
        command = np.zeros(load.force.shape)
        command[:, self._other_indices] = load.others
        return control_of(self._layout, command, load.force)

    def _begin(self, state: Array, control: Array) -> None:
        """Puts the robot into a state (13,), with its hinges at the angles of a ctrl (nu,)."""
        data = self.data
        data.ctrl[:] = control
        data.qpos[POSE] = state[POSE]
        data.qpos[self._angles] = control[self._servos]
        rotation = rotation_of_quaternion(*state[3:7].tolist())
        data.qvel[:] = 0.0
        data.qvel[LINEAR] = to_world(rotation, *state[7:10].tolist())
        data.qvel[ANGULAR] = state[10:]

    def _state(self) -> Array:
        """The state (13,) of the robot."""
        data = self.data
        rotation = rotation_of_quaternion(*data.qpos[3:7].tolist())
        velocity = to_body(rotation, *data.qvel[LINEAR].tolist())
        return np.concatenate([data.qpos[POSE], velocity, data.qvel[ANGULAR]])

    def _step(self, tau: Sequence[float], without_motor: Sequence[float], step_s: float) -> None:
        """Moves on by a step of the midpoint rule.

        Args:
            tau: wrench of all actuators (6,), body frame [N, N m].
            without_motor: the part of it that no motor of the model gives.
            step_s: length of the step [s].
        """
        data = self.data
        options = self.model.opt
        position = data.qpos.copy()
        velocity = data.qvel.copy()
        time = data.time
        self._apply(tau, without_motor)
        options.timestep = 0.5 * step_s
        mujoco.mj_step(self.model, data)
        self._apply(tau, without_motor)
        data.qpos[:] = position
        data.qvel[:] = velocity
        data.time = time
        options.timestep = step_s
        mujoco.mj_step(self.model, data)

    def _apply(self, tau: Sequence[float], without_motor: Sequence[float]) -> None:
        """Sets the external wrench of the state that MuJoCo is in; arguments as of `_step`."""
        data = self.data
        rotation = rotation_of_quaternion(*data.qpos[3:7].tolist())
        u, v, w = to_body(rotation, *data.qvel[LINEAR].tolist())
        cu, cv, cw = to_body(rotation, *self._vehicle.current)
        nu_r = (u - cu, v - cv, w - cw, *data.qvel[ANGULAR].tolist())
        up = rotation[2::3]
        water = water_wrench(self._vehicle.dynamics, (self._mass, *self._moments), nu_r, up, tau)
        applied = [a + b for a, b in zip(water, without_motor, strict=True)]
        data.qfrc_applied[LINEAR] = to_world(rotation, *applied[:3])
        data.qfrc_applied[ANGULAR] = applied[3:]


def _model_of(layout: Layout) -> mujoco.MjModel:
    """The model of a robot whose body is complete."""
    model = mujoco.MjModel.from_xml_string(write_mjcf(layout, Exchange(), ""))
    body = layout.body
    assert body is not None
    # MuJoCo compiles moments that no solid has into balanced ones; here they are as drawn.
    base = model.jnt_bodyid[0]
    model.body_inertia[base] = body.inertia_kgm2
    mujoco.mj_setConst(model, mujoco.MjData(model))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    # The layout's lags, rates and limits have been kept before; a motion that diverges is refused
    # by `Vehicle.n_steps`, and must not begin anew.
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= (
        flags.mjDSBL_CONSTRAINT | flags.mjDSBL_CLAMPCTRL | flags.mjDSBL_AUTORESET
    )
    return model
