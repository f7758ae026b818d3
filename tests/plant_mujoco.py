"""A robot in MuJoCo that is not quite the one that its layout describes: the plant that judges the
fault monitor.

Apart from the library's simulation: MuJoCo integrates the rigid body and applies the actuators'
forces at their sites; added mass with couplings, Coriolis terms, drag, buoyancy, current, lags and
sensors are written here. Forces of fins and pods follow the library's laws. World: z up; body: x
forward, y left, z up.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import mujoco
import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.control import DriveTelemetry, Measurement
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.fossen import complete_body

STEP_S = 0.02
"""A step of the simulation [s]."""
GRAVITY = 9.81
"""[m/s^2]."""


@dataclass(frozen=True)
class Spread:
    """How far the true robot may be from its layout: half-widths of uniform distributions."""

    body: float = 0.2
    """Mass, inertia, added mass, drag and height of the centre of buoyancy, each entry, as a
    share."""
    coupling: float = 0.1
    """Couplings of the added mass, over the geometric mean of the two diagonal entries."""
    buoyancy: float = 0.01
    """Buoyant force beyond the weight, as a share."""
    strength: float = 0.05
    """Force of an actuator, as a share."""
    lag: float = 0.2
    """Time constant of an actuator, as a share."""
    place: float = 0.005
    """Position of an actuator, each coordinate [m]."""
    angle: float = 0.02
    """Direction of an actuator [rad]."""
    current: float = 0.1
    """Speed of the water along each horizontal axis [m/s]; a tenth of it vertically."""


NO_SPREAD = Spread(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The robot is as its layout says, and the water rests."""


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations of samples and of biases, and delays."""

    rate: float = 0.01
    """[rad/s]."""
    rate_bias: float = 0.001
    """[rad/s]."""
    tilt: float = 0.01
    """[rad]."""
    tilt_bias: float = 0.005
    """[rad]."""
    velocity: float = 0.01
    """[m/s]."""
    velocity_bias: float = 0.002
    """[m/s]."""
    velocity_period_s: float = 0.2
    """Time between samples of the velocity log [s]."""
    velocity_delay_s: float = 0.1
    """How late they arrive [s]."""
    velocity_dropout: float = 0.02
    """Share of them that is lost."""
    depth: float = 0.005
    """[m]."""
    yaw: float = 0.02
    """[rad]."""
    acceleration: float = 0.05
    """Of the mean of a tenth of a second [m/s^2]."""
    acceleration_bias: float = 0.03
    """[m/s^2]."""


NO_NOISE = SensorNoise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Exact sensors."""


class TrueFault(NamedTuple):
    """What becomes of one actuator."""

    index: int
    """Of the actuator."""
    kind: str
    """`lost`, `weak`, `reversed` or `stuck`."""
    time_s: float
    """When [s]."""
    share: float = 0.35
    """Share of the force that is left of a weak one."""


def cross(first: Array, second: Array) -> Array:
    """Returns the cross product of two vectors (3,), quicker than numpy's."""
    a, b, c = first.tolist()
    x, y, z = second.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def turned(direction: Array, angle: float, rng: np.random.Generator) -> Array:
    """Returns rows of directions (m, 3), turned together about a random axis by up to an angle
    [rad]."""
    axis = rng.normal(size=3)
    axis *= rng.uniform(-angle, angle) / np.linalg.norm(axis)
    return direction + np.cross(axis, direction)


class TrueBody:
    """The numbers of the body that really swims."""

    def __init__(self, layout: Layout, spread: Spread, rng: np.random.Generator) -> None:
        """Draws a body near that of a layout."""
        body = complete_body(layout)
        zeros = (0.0,) * 6

        def drawn(values: object) -> Array:
            numbers = np.array(zeros if values is None else values, dtype=float)
            return numbers * (1.0 + rng.uniform(-spread.body, spread.body, numbers.shape))

        assert body.mass_kg is not None
        self.mass = float(drawn(body.mass_kg))
        self.inertia = drawn(body.inertia_kgm2)
        # Moments of a body: no one is greater than the sum of the other two.
        self.inertia = np.minimum(self.inertia, 0.999 * (self.inertia.sum() - self.inertia))
        diagonal = drawn(body.added_mass)
        share = np.triu(rng.uniform(-spread.coupling, spread.coupling, (6, 6)), 1)
        scale = np.sqrt(np.outer(diagonal, diagonal))
        self.added_mass = np.diag(diagonal) + (share + share.T) * scale
        self.linear_damping = drawn(body.linear_damping)
        self.quadratic_damping = drawn(body.quadratic_damping)
        center = drawn(body.center_of_buoyancy_m or (0.0, 0.0, 0.0))
        self.center_of_buoyancy = center
        net = rng.uniform(-spread.buoyancy, spread.buoyancy)
        given = body.mass_kg * GRAVITY if body.buoyancy_n is None else body.buoyancy_n
        share_of_weight = given / (body.mass_kg * GRAVITY)
        self.buoyancy = self.mass * GRAVITY * share_of_weight * (1.0 + net)
        self.current = rng.uniform(-spread.current, spread.current, 3) * (1.0, 1.0, 0.1)
        rigid = np.diag([self.mass] * 3 + self.inertia.tolist())
        self.total_inverse = np.linalg.inv(rigid + self.added_mass)


def model_of(body: TrueBody, places: Array) -> mujoco.MjModel:
    """Returns a free body with a site at each place (n, 3), and a motor along each axis there."""
    sites = []
    motors = []
    for i, place in enumerate(places):
        position = " ".join(repr(float(value)) for value in place)
        sites.append(f'<site name="s{i}" pos="{position}"/>')
        for axis in ("1 0 0", "0 1 0", "0 0 1"):
            motors.append(f'<motor site="s{i}" gear="{axis} 0 0 0"/>')
    for axis in ("1 0 0", "0 1 0", "0 0 1"):
        motors.append(f'<motor site="center" gear="0 0 0 {axis}"/>')
    inertia = " ".join(repr(float(value)) for value in body.inertia)
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="{STEP_S}" gravity="0 0 -{GRAVITY}" density="0" viscosity="0"/>
      <worldbody><body name="robot"><freejoint/>
        <inertial pos="0 0 0" mass="{body.mass!r}" diaginertia="{inertia}"/>
        <site name="center"/>{"".join(sites)}
      </body></worldbody>
      <actuator>{"".join(motors)}</actuator>
    </mujoco>""")


class TrueDrives:
    """Speeds and currents of thrusters: speeds go with the root of the force, currents with the
    third power of the speed. What a fault does to them depends on its cause, which is drawn."""

    def __init__(self, layout: Layout, rng: np.random.Generator) -> None:
        """Draws drives near those of a layout."""
        n = layout.n
        self._rng = rng
        self._lower = layout.lower[:, 0]
        self._upper = layout.upper[:, 0]
        self._speed = 3000.0 * (1.0 + rng.uniform(-0.1, 0.1, n))
        self._current = 20.0 * (1.0 + rng.uniform(-0.2, 0.2, n))
        self._of_speed = np.ones(n)
        self._of_current = np.ones(n)
        self._causes = rng.uniform(size=n)

    def fail(self, fault: TrueFault) -> None:
        """Something becomes of an actuator: a motor stands, or a propeller has gone; wires are
        swapped, or blades; weed drags, or a drive is slow."""
        k = fault.index
        is_first = self._causes[k] < 0.6
        slow = math.sqrt(fault.share)
        factors = {
            "lost": (0.0, 0.0) if is_first else (1.15, 0.12),
            "reversed": (-1.0, 1.0) if is_first else (1.0, 1.0),
            "weak": (slow, 2.5) if is_first else (slow, 1.0),
            "stuck": (1.0, 1.0),
        }
        self._of_speed[k], self._of_current[k] = factors[fault.kind]

    def telemetry(self, force: Array, is_force: Array) -> DriveTelemetry:
        """What drives say whose propellers would give forces (n,) if they were whole [N]."""
        rng = self._rng
        n = len(force)
        limits = np.where(force > 0.0, self._upper, -self._lower)
        root = np.sign(force) * np.sqrt(np.abs(force) / np.maximum(limits, 1e-9))
        share = root * self._of_speed
        speed = self._speed * share + 15.0 * rng.normal(size=n)
        current = self._current * np.abs(share) ** 3 * self._of_current
        current = current * (1.0 + 0.05 * rng.normal(size=n)) + 0.05 * rng.normal(size=n)
        speed[~is_force] = np.nan
        return DriveTelemetry(speed, current, np.zeros(n))


class TrueActuators:
    """Actuators that are a little stronger or slower than drawn, and sit a little askew."""

    def __init__(
        self,
        layout: Layout,
        spread: Spread,
        rng: np.random.Generator,
        rng_of_more: np.random.Generator,
    ) -> None:
        """Draws actuators near those of a layout, and from another generator their drives."""
        self.layout = layout
        n = layout.n
        self.strength = 1.0 + rng.uniform(-spread.strength, spread.strength, n)
        places = np.array([part.position for part in layout.actuators])
        self.places = places + rng.uniform(-spread.place, spread.place, (n, 3))
        frames = [turned(np.array(part.frame), spread.angle, rng) for part in layout.actuators]
        self.frames = np.array(frames)
        self.lag_s = np.array([getattr(part, "time_constant", 0.0) for part in layout.actuators])
        self.lag_s = self.lag_s * (1.0 + rng.uniform(-spread.lag, spread.lag, n))
        self.reaction = np.array(
            [getattr(part, "torque_per_newton", 0.0) or 0.0 for part in layout.actuators]
        )
        levers = np.cross(self.places[:, None], self.frames)
        levers[:, 0] += self.reaction[:, None] * self.frames[:, 0]
        self.effectiveness = np.concatenate([self.frames, levers], axis=2).reshape(-1, 6)
        """Wrench (3 n, 6) of 1 N along each own axis."""
        self._is_force = np.array(
            [not part.KIND.sticks_at_angle and part.type == "thruster" for part in layout.actuators]
        )
        self._plant = plant_of(layout)
        self._motion = ActuatorMotion(layout)
        self._force_of_thrusters = np.zeros(n)
        self.drives = TrueDrives(layout, rng_of_more)
        self.gain = np.ones(n)
        """Share of its force that each gives by its fault (n,)."""
        self.stuck_at = np.full(n, np.nan)
        """Where actuators (n,) are stuck; NaN where they are not."""

    def fail(self, fault: TrueFault) -> None:
        """Something becomes of an actuator, now."""
        k = fault.index
        self.drives.fail(fault)
        if fault.kind == "stuck":
            value = self._motion.direction[k]
            self.stuck_at[k] = self._force_of_thrusters[k] if self._is_force[k] else value
        else:
            self.gain[k] = {"lost": 0.0, "reversed": -1.0, "weak": fault.share}[fault.kind]

    def forces(self, command: Array, water: Array) -> Array:
        """Moves on by a step and returns forces (n, 3) in own frames [N].

        Args:
            command: (n, 3), NaN rows rest.
            water: velocity and rates (6,) through the water, body frame.
        """
        motion = self._motion
        motion.step(command, STEP_S)
        pushes = motion.pushes
        does = motion.turned_to(motion.command, np.where(self._is_force, np.nan, self.stuck_at))
        force = self._plant.force(does, flow=water) * pushes[:, None]
        asked = np.where(np.isfinite(command[:, 0]), command[:, 0], 0.0)
        decay = 1.0 - np.exp(-STEP_S / np.maximum(self.lag_s, 1e-6))
        is_free = self._is_force & np.isnan(self.stuck_at)
        self._force_of_thrusters += np.where(is_free, decay * (asked - self._force_of_thrusters), 0)
        force[self._is_force, 0] = self._force_of_thrusters[self._is_force]
        return np.asarray(force * (self.strength * self.gain)[:, None])

    def telemetry(self) -> DriveTelemetry:
        """What the drives say now."""
        return self.drives.telemetry(self._force_of_thrusters, self._is_force)

    def nominal(self, command: Array, water: Array, whole: bool = False) -> Array:
        """The wrench (6,) that a command would give by the layout with the faults of now, once it
        has been followed, at full strength.

        Args:
            command: (n, 3), NaN rows rest.
            water: velocity and rates (6,) through the water, body frame.
            whole: without the faults.
        """
        stuck_at = np.full(len(self.gain), np.nan) if whole else self.stuck_at
        rests = np.isnan(command[:, 0])
        does = np.where(rests[:, None], self._motion.command, command)
        does = self._motion.turned_to(does, stuck_at)
        force = self._plant.force(does, flow=water)
        if not whole:
            force *= self.gain[:, None]
        force[rests & ~(self._is_force & ~np.isnan(stuck_at))] = 0.0
        return np.asarray(self._plant.wrench_of(force, flow=water))


class MujocoRobot:
    """One robot under way in MuJoCo."""

    def __init__(
        self,
        layout: Layout,
        seed: int,
        spread: Spread | None = None,
        noise: SensorNoise | None = None,
        sensors: str = "dvl",
    ) -> None:
        """Draws a robot and puts it at rest.

        Args:
            layout: what is believed of it.
            seed: of the robot, its water and its sensors.
            spread: how far it is from its layout.
            noise: of the sensors.
            sensors: `dvl` for rates, tilt, depth and velocity, `imu` for no velocity; `+accelerometer`
                and `+esc` add an accelerometer, and telemetry of the drives.
        """
        rng = np.random.default_rng([seed, 0x60])
        self.layout = layout
        spread = Spread() if spread is None else spread
        self.body = TrueBody(layout, spread, rng)
        # What is drawn for sensors that not every run has leaves the other numbers as they are.
        self._rng_of_more = np.random.default_rng([seed, 0x63])
        self.actuators = TrueActuators(layout, spread, rng, self._rng_of_more)
        self._model = model_of(self.body, self.actuators.places)
        self.data = mujoco.MjData(self._model)
        self.time = 0.0
        self.noise = SensorNoise() if noise is None else noise
        self.sensors = sensors
        self._rng = rng
        noise = self.noise
        self._rate_bias = noise.rate_bias * rng.normal(size=3)
        self._tilt_bias = noise.tilt_bias * rng.normal(size=2)
        self._velocity_bias = noise.velocity_bias * rng.normal(size=3)
        self._acceleration_bias = noise.acceleration_bias * self._rng_of_more.normal(size=3)
        self._specific_force = np.zeros(3)  # summed over the steps since the last measurement
        self._steps = 0
        self._velocity = np.zeros(3) if sensors == "dvl" else np.full(3, np.nan)
        self._velocity_time = 0.0
        self._in_transit: list[tuple[float, Array]] = []
        self._next_velocity = 0.0
        self.acceleration = np.zeros(6)
        """Of the last step, as computed here (6,): of the centre of gravity and of the rates, body
        frame [m/s^2, rad/s^2]."""
        self.wrench = np.zeros(6)
        """What the actuators gave in the last step (6,), body frame [N, N m]."""

    @property
    def rotation(self) -> Array:
        """From the body frame to the world (3, 3)."""
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, self.data.qpos[3:7])
        return matrix.reshape(3, 3)

    @property
    def motion(self) -> Array:
        """Velocity over ground and rates (6,), body frame [m/s, rad/s]."""
        return np.concatenate([self.rotation.T @ self.data.qvel[:3], self.data.qvel[3:]])

    @property
    def water(self) -> Array:
        """Velocity through the water and rates (6,), body frame [m/s, rad/s]."""
        motion = self.motion
        motion[:3] -= self.rotation.T @ self.body.current
        return motion

    def fail(self, fault: TrueFault) -> None:
        """Something becomes of an actuator, now."""
        self.actuators.fail(fault)

    def step(self, command: Array, duration_s: float) -> None:
        """Swims with a command (n, 3) in force."""
        for _ in range(round(duration_s / STEP_S)):
            self._sample_velocity()
            self._step(command)

    def _step(self, command: Array) -> None:
        body = self.body
        actuators = self.actuators
        R = self.rotation
        velocity = R.T @ self.data.qvel[:3]
        omega = self.data.qvel[3:].copy()
        current = R.T @ body.current
        nu_r = np.concatenate([velocity - current, omega])
        force = actuators.forces(command, nu_r)
        in_body = (force[:, None] @ actuators.frames)[:, 0]
        reaction = (actuators.reaction * force[:, 0]) @ actuators.frames[:, 0]
        self.wrench = force.reshape(-1) @ actuators.effectiveness
        # Water: C_A(nu_r) nu_r by Kirchhoff's momenta, drag, buoyancy.
        momentum = body.added_mass @ nu_r
        p = momentum[:3]
        h = momentum[3:]
        munk = cross(nu_r[:3], p)
        coriolis = np.concatenate([cross(omega, p), cross(omega, h) + munk])
        drag = (body.linear_damping + body.quadratic_damping * np.abs(nu_r)) * nu_r
        up = R[2]
        lift = body.buoyancy * up
        buoyancy = np.concatenate([lift, cross(body.center_of_buoyancy, lift)])
        of_water = buoyancy - coriolis - drag
        # Added mass, implicitly: (M_RB + M_A) nu' = tau + ... + M_A c', c' = -omega x c.
        current_rate = np.concatenate([-cross(omega, current), np.zeros(3)])
        # The rigid body's: weight less C_RB(nu) nu.
        turning = cross(omega, velocity)
        of_body = np.concatenate(
            [-body.mass * (GRAVITY * up + turning), -cross(omega, body.inertia * omega)]
        )
        right = self.wrench + of_water + of_body + body.added_mass @ current_rate
        acceleration = body.total_inverse @ right
        of_water -= body.added_mass @ (acceleration - current_rate)
        self.data.ctrl[:-3] = in_body.ravel()
        self.data.ctrl[-3:] = reaction
        self.data.qfrc_applied[:3] = R @ of_water[:3]
        self.data.qfrc_applied[3:] = of_water[3:]
        mujoco.mj_step(self._model, self.data)
        self.acceleration = np.concatenate([acceleration[:3] + turning, acceleration[3:]])
        self._specific_force += self.acceleration[:3] + GRAVITY * up
        self._steps += 1
        self.time += STEP_S

    def _sample_velocity(self) -> None:
        noise = self.noise
        if self.sensors != "dvl" or self.time < self._next_velocity - 1e-9:
            return
        self._next_velocity += noise.velocity_period_s
        if self._rng.uniform() >= noise.velocity_dropout:
            sample = self.motion[:3] + self._velocity_bias
            sample = sample + noise.velocity * self._rng.normal(size=3)
            self._in_transit.append((self.time, sample))

    def measure(self) -> Measurement:
        """The newest samples."""
        noise = self.noise
        rng = self._rng
        while self._in_transit:
            taken, sample = self._in_transit[0]
            if taken + noise.velocity_delay_s > self.time + 1e-9:
                break
            self._velocity = sample
            self._velocity_time = taken
            self._in_transit.pop(0)
        R = self.rotation
        roll = math.atan2(R[2, 1], R[2, 2])
        pitch = -math.asin(min(max(R[2, 0], -1.0), 1.0))
        tilt = np.array([roll, pitch]) + self._tilt_bias + noise.tilt * rng.normal(size=2)
        rates = self.data.qvel[3:] + self._rate_bias + noise.rate * rng.normal(size=3)
        return Measurement(
            time=self.time,
            position=self.data.qpos[:3].copy(),
            yaw=math.atan2(R[1, 0], R[0, 0]) + noise.yaw * rng.normal(),
            velocity=self._velocity,
            depth=-self.data.qpos[2] + noise.depth * rng.normal(),
            rates=rates,
            roll=float(tilt[0]),
            pitch=float(tilt[1]),
            ages=(0.0, 0.0, self.time - self._velocity_time, 0.0),
            acceleration=self._measured_acceleration(),
            drives=self.actuators.telemetry() if "esc" in self.sensors.split("+") else None,
        )

    def _measured_acceleration(self) -> Array:
        """Mean specific force (3,) since the last measurement; NaN without an accelerometer."""
        mean = self._specific_force / max(self._steps, 1)
        has_sample = self._steps > 0 and "accelerometer" in self.sensors.split("+")
        self._specific_force = np.zeros(3)
        self._steps = 0
        if not has_sample:
            return np.full(3, np.nan)
        noise = self.noise.acceleration * self._rng_of_more.normal(size=3)
        return np.asarray(mean + self._acceleration_bias + noise)


class Path:
    """Sums of sines that a robot is to follow with its velocity and its yaw rate."""

    def __init__(self, layout: Layout, axes: tuple[str, ...], seed: int, gentle: bool) -> None:
        """Draws a path that asks for at most some 0.4 m/s and 0.4 rad/s, and for half of what the
        actuators can give.

        Args:
            layout: the robot.
            axes: what is commanded.
            seed: of the path.
            gentle: at 0.6 of the speed.
        """
        rng = np.random.default_rng([seed, 0x61])
        body = complete_body(layout)
        zeros = (0.0,) * 6
        self._linear = np.array(body.linear_damping or zeros)
        self._quadratic = np.array(body.quadratic_damping or zeros)
        assert body.mass_kg is not None and body.inertia_kgm2 is not None
        self._inertia = np.array([body.mass_kg] * 3 + list(body.inertia_kgm2))
        self._inertia = self._inertia + np.array(body.added_mass or zeros)
        reach = axis_reach(layout, axes)
        self.omega = rng.uniform(0.25, 0.9, (3, 6))
        self._phase = rng.uniform(0.0, 2.0 * np.pi, (3, 6))
        share = rng.dirichlet((2.0, 2.0, 2.0), 6).T
        # The sines hardly ever peak together.
        largest = np.array([0.4, 0.4, 0.4, 0.0, 0.0, 0.4]) / 0.8 * (0.6 if gentle else 1.0)
        # The speed at which drag and acceleration take 40 % of what the axis can give.
        speed = np.zeros(6)
        for axis in range(6):
            if reach[axis] <= 0.0:
                continue
            trial = largest[axis]
            while trial > 1e-3:
                drag = (self._linear[axis] + self._quadratic[axis] * trial) * trial
                inertial = self._inertia[axis] * 0.6 * trial
                if math.hypot(drag, inertial) < 0.4 * reach[axis]:
                    break
                trial *= 0.9
            speed[axis] = trial
        self._amplitude = share * speed

    def at(self, time: float) -> tuple[Array, Array]:
        """Velocity and acceleration (6,) at a time [s]."""
        angle = self.omega * time + self._phase
        velocity = (self._amplitude * np.sin(angle)).sum(axis=0)
        acceleration = (self._amplitude * self.omega * np.cos(angle)).sum(axis=0)
        return velocity, acceleration

    def wrench(self, time: float, measured: Measurement, is_closed: bool) -> Array:
        """The wrench (6,) that the path takes by the layout's body, with feedback.

        Args:
            time: [s].
            measured: the newest samples.
            is_closed: whether a velocity is measured.
        """
        velocity, acceleration = self.at(time)
        wanted = acceleration
        error = np.zeros(6)
        if is_closed:
            error[:3] = velocity[:3] - measured.velocity
        error[5] = velocity[5] - measured.rates[2]
        wanted = acceleration + np.array([0.8, 0.8, 0.8, 0.0, 0.0, 1.0]) * error
        drag = (self._linear + self._quadratic * np.abs(velocity)) * velocity
        return np.asarray(self._inertia * wanted + drag)


def axis_reach(layout: Layout, axes: tuple[str, ...]) -> Array:
    """What a robot gives along each commanded axis (6,), roughly [N, N m]."""
    plant = plant_of(layout)
    rng = np.random.default_rng(0)
    command = rng.uniform(layout.lower, layout.upper, (500, layout.n, 3))
    wrench = plant.wrench(command)
    names = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
    is_wanted = np.array([name in axes for name in names])
    return np.asarray(np.where(is_wanted, np.abs(wrench).std(axis=0) * 1.5, 0.0))


def random_frame(seed: int) -> Layout:
    """A frame of six to eight random thrusters that spans all axes, with a random body."""
    from finlab.layout.load import parse_layout

    rng = np.random.default_rng([seed, 0x62])
    n = int(rng.integers(6, 9))
    while True:
        places = rng.uniform(-1.0, 1.0, (n, 3)) * (0.3, 0.25, 0.15)
        directions = rng.normal(size=(n, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        B = np.concatenate([directions, np.cross(places, directions) / 0.25], axis=1).T
        if np.linalg.cond(B) < 12.0:
            break
    mass = float(np.exp(rng.uniform(np.log(8.0), np.log(40.0))))
    inertia = mass * rng.uniform(0.012, 0.03, 3)
    scale = float(np.clip(mass / 12.0, 0.5, 2.0))
    actuators = []
    for i in range(n):
        actuators.append(
            {
                "name": f"t{i + 1}",
                "type": "thruster",
                "position_m": places[i].tolist(),
                "axis": directions[i].tolist(),
                "force_n": [-40.0 * scale, 50.0 * scale],
                "time_constant_s": float(rng.uniform(0.05, 0.2)),
                "model": {"type": "power_law", "forward": 0.997, "reverse": 1.449, "exponent": 1.5},
            }
        )
    body = {
        "mass_kg": mass,
        "inertia_kgm2": inertia.tolist(),
        "added_mass": (
            rng.uniform(0.3, 1.3, 6) * np.array([mass] * 3 + (0.6 * inertia).tolist())
        ).tolist(),
        "linear_damping": (
            rng.uniform(0.2, 0.8, 6) * mass * np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.02])
        ).tolist(),
        "quadratic_damping": (
            rng.uniform(1.0, 5.0, 6) * mass * np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.02])
        ).tolist(),
        "center_of_buoyancy_m": [0.0, 0.0, float(rng.uniform(0.01, 0.04))],
    }
    mapping = {
        "format": "finlab-layout",
        "version": 2,
        "name": f"frame_{seed}",
        "body": body,
        "actuators": actuators,
    }
    return parse_layout(mapping)


def scaled(spread: Spread, share: float) -> Spread:
    """Returns a spread with all half-widths times a share."""
    return replace(spread, **{name: share * value for name, value in vars(spread).items()})
