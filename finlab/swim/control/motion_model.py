"""The model behind `FaultMonitor`: a robot's next velocities, from what its actuators do, and what
is unknown of it.

Fossen's equations with the layout's body, actuators that lag, and a state z that holds, beside the
motion, what nobody has measured: the current, a wrench that stays, how far inertia, damping and
righting moment are from the layout's, the strength of each actuator, and what one that is stuck
gives. `hypotheses.py` is the filter that runs on it.
"""

import math
from itertools import combinations
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.control.contract import LEVER_M
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.attitude import quaternion_of, rotation_of_quaternion, to_body
from finlab.swim.vehicle.fossen import complete_body, dynamics_of

MOTION = slice(0, 6)
"""Velocity over ground and rates in the state, body frame [m/s, rad/s]."""
VELOCITY = slice(0, 3)
"""Velocity over ground."""
RATES = slice(3, 6)
"""Angular rates."""
TILT = slice(6, 8)
"""Roll and pitch [rad]."""
DEPTH = 8
"""Depth [m]."""
N_MOVING = 9
"""Numbers of the state that move by themselves: the others only drift."""
CURRENT = slice(9, 12)
"""Velocity of the water in the world [m/s]."""
UNKNOWN = slice(12, 18)
"""A wrench that stays, body frame [N, N m]."""
INERTIA = slice(18, 24)
"""How far mass and moments, with those of the water, are above the layout's, as a share."""
COUPLING = slice(24, 39)
"""Entries of the inertia matrix beside its diagonal, over the geometric mean of the two diagonal
entries of the layout."""
DAMPING = slice(39, 45)
"""How far the damping along each axis is above the layout's, as a share."""
RIGHTING = 45
"""The same of the righting moment."""
FIRST_ACTUATOR = 46
"""The strength of the first actuator; after the strengths what stuck ones give."""
SHARE_MIN = -0.7
"""Least of those shares: what is beyond it is no body."""
SHARE_MAX = 3.0
"""Greatest of them."""
NORM_MAX = 100.0
"""Norm of A dt at which a motion is over within a thousandth of the period, or has no bounds."""
TURN_ABOUT_COSINE = -0.9
"""Cosine of the angle to a direction below which an actuator that is to turn there may go either
way round."""
QUICK_RATE = 20.0
"""Rate from which one turns about within two periods [rad/s]."""
TURN_ABOUT_S = 1.2
"""How long its direction is unknown then [s]."""
COUPLING_MAX = 0.15
"""Greatest of the entries beside the diagonal: with all of them M still is positive definite."""
EXPONENT_MAX = 0.5
"""Norm of A dt up to which the series of the exponential is exact to 1e-7."""


class ModelStep(NamedTuple):
    """One period of a state z (d,), linearized."""

    state: Array
    """The state (d,) at the end of the period."""
    transition: Array
    """Derivatives (9, d) of its moving part by the state at the beginning; the others stay."""
    noise: Array
    """What the model may be wrong by, as squares of accelerations (3, 6): of all terms of the
    equation of motion; of how much the actuators' wrench changed; and of the forces of those that
    turn about, which way round is unknown."""
    acceleration: Array
    """Rate of change (9,) of the moving part at the beginning."""
    acceleration_slope: Array
    """Its derivatives (9, d)."""


class MotionModel:
    """The model of one robot; remembers what its actuators do.

    An actuator that is stuck gives a wrench that does not follow its command. What it gives is
    linear in few numbers: the force of a thruster [N], or the cosine and the sine of the angle at
    which a fin or a pod no longer turns. They stand in the state, 0 where nothing is stuck.
    """

    def __init__(self, layout: Layout) -> None:
        """Takes a layout, whose body is completed by U-CAT's."""
        self.dynamics = dynamics_of(complete_body(layout))
        self.inertia = np.array(self.dynamics.inertia)
        """Mass and moments (6,), those of the water that goes along included [kg, kg m^2]."""
        self._linear_damping = np.array(self.dynamics.linear_damping)
        self._quadratic_damping = np.array(self.dynamics.quadratic_damping)
        self._center_of_buoyancy = self.dynamics.center_of_buoyancy
        self._net_buoyancy = self.dynamics.buoyancy - self.dynamics.weight
        # Entries of the inertia matrix (21, 6, 6), the diagonal first, then those beside it.
        entries = []
        for k in range(6):
            entry = np.zeros((6, 6))
            entry[k, k] = self.inertia[k]
            entries.append(entry)
        for i, j in combinations(range(6), 2):
            entry = np.zeros((6, 6))
            entry[i, j] = entry[j, i] = math.sqrt(self.inertia[i] * self.inertia[j])
            entries.append(entry)
        self._entries = np.array(entries)
        self._plant = plant_of(layout)
        self.motion = ActuatorMotion(layout)
        """What the actuators do, if they follow their commands."""
        n = layout.n
        self.n = n
        parts = layout.actuators
        can_stick = ["stuck" in part.KIND.faults for part in parts]
        self.sticks = np.array(can_stick)
        """Which actuators (n,) may be stuck."""
        self.sticks_at_angle = self.sticks & self.motion.angles
        """Which of them keep an angle; the others keep a force."""
        owners = []
        for k in range(n):
            if can_stick[k]:
                owners += [k, k] if self.sticks_at_angle[k] else [k]
        self.held_owner = np.array(owners, dtype=int)
        """Actuator (h,) of each number of the state that says what a stuck one gives."""
        self.n_held = len(owners)
        self.strength = slice(FIRST_ACTUATOR, FIRST_ACTUATOR + n)
        """Strengths in the state."""
        self.held = slice(FIRST_ACTUATOR + n, FIRST_ACTUATOR + n + self.n_held)
        """What stuck ones give in the state."""
        self.size = FIRST_ACTUATOR + n + self.n_held
        """Numbers of the state, d."""
        self.held_of = [np.flatnonzero(self.held_owner == k) for k in range(n)]
        """Which of the held numbers belong to each actuator."""
        # An angle at which a pod or a fin would push along the first and the second own axis.
        basis = np.full((2, n), np.nan)
        basis[0, self.sticks_at_angle] = 0.0
        basis[1, self.sticks_at_angle] = 0.5 * math.pi
        self._basis_angles = basis
        self._wrench_before = np.zeros((n, 6))
        self._turning_s = np.zeros(n)
        rate = layout.rates[np.arange(n), [part.KIND.stuck_number for part in parts]]
        self._turns_slowly = self.motion.turns_fully & (rate < QUICK_RATE)
        self._effect_of_unit = self._unit_wrenches(layout)

    def _unit_wrenches(self, layout: Layout) -> Array:
        """Wrench (n, 6) of 1 N along the axis of each actuator whose command is a force."""
        wrench = np.zeros((layout.n, 6))
        for k in np.flatnonzero(self.sticks & ~self.sticks_at_angle):
            wrench[k] = self._plant.effectiveness[k, 0]
        return wrench

    def adopt(self, layout: Layout) -> None:
        """From now on forces are those of another layout with the same body."""
        self._plant = plant_of(layout)
        self._effect_of_unit = self._unit_wrenches(layout)

    def held_now(self) -> Array:
        """What each actuator would give on if it stuck now, as in the state (h,)."""
        direction = self.motion.direction
        result = np.zeros(self.n_held)
        for k in range(self.n):
            numbers = self.held_of[k]
            if len(numbers) == 2:
                result[numbers] = math.cos(direction[k]), math.sin(direction[k])
            elif len(numbers):
                result[numbers] = direction[k]
        return result

    def step(self, state: Array, yaw: float, command: Array, dt: float) -> ModelStep:
        """Carries a state on over a period.

        By the exponential Euler rule for z' = f(z), which stays stable however strongly the water
        damps (M. Hochbruck, A. Ostermann, Acta Numerica 19, 2010): with A = df/dz

            z <- z + dt phi_1(A dt) f(z),    phi_1(X) = (e^X - 1) / X

        Args:
            state: z (d,) at the beginning.
            yaw: heading [rad].
            command: (n, 3) in force over the period; NaN rows rest.
            dt: its length [s].
        """
        u, v, w, p, q, r, roll, pitch = state[:8].tolist()
        rotation = rotation_of_quaternion(*quaternion_of(roll, pitch, yaw))
        R = np.array(rotation).reshape(3, 3)  # rows: axes of the body in the world
        up = rotation[2::3]
        cu, cv, cw = to_body(rotation, *state[CURRENT].tolist())
        nu_r = np.array([u - cu, v - cv, w - cw, p, q, r])
        wrenches, held_wrenches, of_actuators = self._wrenches(command, nu_r, dt)
        strength = state[self.strength]
        tau = strength @ wrenches + state[self.held] @ held_wrenches + state[UNKNOWN]

        # M nu_r' = tau - T M nu_r - D nu_r - g, T of the momentum: (omega x p, omega x h + v x p).
        M = self._inertia_matrix(state)
        M_inverse = np.linalg.inv(M)
        momentum = M @ nu_r
        v_cross = cross_matrix(*nu_r[:3].tolist())
        omega_cross = cross_matrix(p, q, r)
        T = np.zeros((6, 6))
        T[:3, :3] = T[3:, 3:] = omega_cross
        T[3:, :3] = v_cross
        coriolis = T @ momentum
        damping = np.clip(state[DAMPING], SHARE_MIN, SHARE_MAX) + 1.0
        slowness = self._linear_damping + self._quadratic_damping * np.abs(nu_r)
        drag = slowness * nu_r
        righting_share = 1.0 + min(max(state[RIGHTING], SHARE_MIN), SHARE_MAX)
        right = tau - coriolis - damping * drag
        right[:3] += self._net_buoyancy * np.array(up)
        righting = self._righting(up)
        right[3:] += righting_share * righting
        acc_r = M_inverse @ right
        turning = (q * cw - r * cv, r * cu - p * cw, p * cv - q * cu)  # omega x c
        sin_roll = math.sin(roll)
        cos_roll = math.cos(roll)
        cos_pitch = math.cos(pitch)
        sin_pitch = math.sin(pitch)
        tan_pitch = sin_pitch / math.copysign(max(abs(cos_pitch), 0.05), cos_pitch)
        f = np.empty(N_MOVING)
        f[:6] = acc_r
        f[:3] -= turning
        f[6] = p + tan_pitch * (q * sin_roll + r * cos_roll)
        f[7] = q * cos_roll - r * sin_roll
        f[8] = -(up[0] * u + up[1] * v + up[2] * w)

        slope = np.zeros((N_MOVING, self.size))
        # d(T m)/d nu of a momentum m = (p, h) that stays: -(p x omega', h x omega' + p x v').
        by_turning = np.zeros((6, 6))
        p_cross = cross_matrix(*momentum[:3].tolist())
        by_turning[:3, 3:] = by_turning[3:, :3] = p_cross
        by_turning[3:, 3:] = cross_matrix(*momentum[3:].tolist())
        by_flow = by_turning - T @ M
        drag_slope = self._linear_damping + 2.0 * self._quadratic_damping * np.abs(nu_r)
        by_flow.ravel()[::7] -= damping * drag_slope
        by_flow = M_inverse @ by_flow
        slope[MOTION, MOTION] = by_flow
        up_by_roll = (0.0, cos_pitch * cos_roll, -cos_pitch * sin_roll)
        up_by_pitch = (-cos_pitch, -sin_pitch * sin_roll, -sin_pitch * cos_roll)
        # Turned by a little about an axis, the body sees the current c as c x axis less of it.
        current_cross = cross_matrix(cu, cv, cw)
        about_roll = (1.0, 0.0, 0.0)
        about_pitch = (0.0, cos_roll, -sin_roll)
        for column, turned_up, about in (
            (6, up_by_roll, about_roll),
            (7, up_by_pitch, about_pitch),
        ):
            by_tilt = np.empty(6)
            by_tilt[:3] = self._net_buoyancy * np.array(turned_up)
            by_tilt[3:] = righting_share * self._righting(turned_up)
            current_turned = current_cross @ about
            by_tilt = M_inverse @ by_tilt - by_flow[:, :3] @ current_turned
            by_tilt[:3] -= omega_cross @ current_turned
            slope[MOTION, column] = by_tilt
            slope[8, column] = -(turned_up[0] * u + turned_up[1] * v + turned_up[2] * w)
        slope[VELOCITY, RATES] += current_cross
        slope[6, 6] = tan_pitch * (q * cos_roll - r * sin_roll)
        slope[6, 7] = (1.0 + tan_pitch**2) * (q * sin_roll + r * cos_roll)
        slope[7, 6] = -q * sin_roll - r * cos_roll
        slope[6, 3:6] = 1.0, tan_pitch * sin_roll, tan_pitch * cos_roll
        slope[7, 4:6] = cos_roll, -sin_roll
        slope[8, 0:3] = -up[0], -up[1], -up[2]
        by_current = by_flow[:, :3] @ -R
        by_current[:3] -= omega_cross @ R
        slope[MOTION, CURRENT] = by_current
        slope[MOTION, UNKNOWN] = M_inverse
        # By an entry E of the inertia matrix: -M^-1 (E nu_r' + T E nu_r).
        of_acceleration = self._entries @ acc_r
        of_momentum = self._entries @ nu_r
        by_inertia = -(of_acceleration + of_momentum @ T.T)
        slope[MOTION, 18:39] = M_inverse @ by_inertia.T
        slope[MOTION, DAMPING] = -M_inverse * drag
        slope[MOTION, RIGHTING] = M_inverse[:, 3:] @ righting
        slope[MOTION, self.strength] = M_inverse @ wrenches.T
        slope[MOTION, self.held] = M_inverse @ held_wrenches.T

        F, phi = exponential(slope[:, :N_MOVING], dt)
        after = state.copy()
        after[:N_MOVING] += phi @ f
        transition = phi @ slope
        transition[:, :N_MOVING] = F
        # What the terms of the equation are worth: each is known to a share of its size.
        terms = np.square(drag) + np.square(coriolis) + np.square(M @ acc_r)
        terms += np.square(strength[:, None] * wrenches).sum(axis=0)
        return ModelStep(
            state=after,
            transition=transition,
            noise=np.array([terms, *of_actuators]) / np.square(self.inertia),
            acceleration=f,
            acceleration_slope=slope,
        )

    def _inertia_matrix(self, state: Array) -> Array:
        """M (6, 6) by a state."""
        shares = state[18:39].copy()
        shares[:6] = np.clip(shares[:6], SHARE_MIN, SHARE_MAX)
        shares[6:] = np.clip(shares[6:], -COUPLING_MAX, COUPLING_MAX)
        M = (shares @ self._entries.reshape(21, 36)).reshape(6, 6)
        M.ravel()[::7] += self.inertia
        return np.asarray(M)

    def _righting(self, up: tuple[float, ...]) -> Array:
        """The righting moment (3,) of the layout's body, b x B up."""
        bx, by, bz = self._center_of_buoyancy
        ax, ay, az = up
        moment = np.array([by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax])
        return np.asarray(self.dynamics.buoyancy * moment)

    def _wrenches(
        self, command: Array, flow: Array, dt: float
    ) -> tuple[Array, Array, tuple[Array, Array]]:
        """Moves the actuators on by a period.

        Returns:
            The wrench (n, 6) of each at full strength, mean over the period; that of each unit of
            what stuck ones give (h, 6); and squares (6,) of how much all changed, and of what those
            that turn about may give otherwise.
        """
        moves = self.motion
        self._note_turning(command, dt)
        moves.step(command, dt)
        now = moves.command
        effectiveness = self._plant.effectiveness
        pushes = moves.pushes
        if self.sticks_at_angle.any():
            both = moves.turned_to(
                np.array([now] * 3),
                np.concatenate([np.full((1, self.n), np.nan), self._basis_angles]),
            )
            force = self._plant.force(both, flow=flow)
            force *= pushes[:, None]
        else:
            force = self._plant.force(now, flow=flow)[None] * pushes[:, None]
        offset = self._plant.offset(force[0], flow=flow) / self.n
        wrench = np.matmul(force[:, :, None, :], effectiveness)[:, :, 0]
        wrench[0] += offset
        held = np.empty((self.n_held, 6))
        place = 0
        for k in range(self.n):
            count = len(self.held_of[k])
            if count == 2:
                held[place] = wrench[1, k]
                held[place + 1] = wrench[2, k]
            elif count == 1:
                held[place] = self._effect_of_unit[k]
            place += count
        # What stops, stops at once.
        works = np.isfinite(command[:, :1])
        mean = np.where(works, 0.5 * (self._wrench_before + wrench[0]), wrench[0])
        change = np.square(wrench[0] - self._wrench_before).sum(axis=0)
        self._wrench_before = wrench[0]
        turning = np.zeros(6)
        if self._turning_s.any():
            about = self._turning_s > 0.0
            # One that points the other way changes the force by twice its size.
            size = 2.0 * np.linalg.norm(force[0, about], axis=-1)
            effect = np.square(size[:, None, None] * effectiveness[about, 1:])
            turning = effect.sum(axis=(0, 1))
        return mean, held, (change, turning)

    def _note_turning(self, command: Array, dt: float) -> None:
        """Notes which actuators are to turn about."""
        moves = self.motion
        self._turning_s = np.maximum(self._turning_s - dt, 0.0)
        cosine = np.cos(moves.held_part(command) - moves.direction)
        turns_about = (cosine < TURN_ABOUT_COSINE) & self._turns_slowly
        self._turning_s[turns_about] = TURN_ABOUT_S


def cross_matrix(x: float, y: float, z: float) -> Array:
    """Returns the matrix (3, 3) of the cross product with a vector."""
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exponential(A: Array, dt: float) -> tuple[Array, Array]:
    """Returns e^(A dt) and dt phi_1(A dt), by their series and by doubling:

    phi_1(2 X) = (e^X + 1) phi_1(X) / 2,    e^(2 X) = (e^X)^2
    """
    X = A * dt
    norm = float(np.abs(X).sum(axis=1).max())
    halvings = 0
    if norm > NORM_MAX:
        X *= NORM_MAX / norm
        norm = NORM_MAX
    if norm > EXPONENT_MAX:
        halvings = min(math.ceil(math.log2(norm / EXPONENT_MAX)), 40)
        X = X / 2.0**halvings
    identity = np.eye(len(A))
    # phi_1 = 1 + X/2 + X^2/6 + X^3/24 + X^4/120 + X^5/720
    phi = identity + X / 6.0
    for divisor in (5.0, 4.0, 3.0, 2.0):
        phi = identity + (X @ phi) / divisor
    F = identity + X @ phi
    for _ in range(halvings):
        phi = 0.5 * (F @ phi + phi)
        F = F @ F
    return F, dt * phi


def gyration_radius(inertia: Array) -> Array:
    """Radii (3,) of gyration [m] of a robot with mass and moments (6,)."""
    radius = np.sqrt(inertia[3:] / inertia[:3].mean())
    return np.asarray(np.maximum(radius, 0.1 * LEVER_M))
