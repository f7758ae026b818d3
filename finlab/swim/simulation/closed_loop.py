"""A robot that swims: sensors, controller, allocator, actuators and body, one control period at a
time."""

import math
from collections import deque
from collections.abc import Sequence
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.policy import Policy, PolicyName, as_policy
from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.damage import Damage, FaultKind
from finlab.physics import plant_of
from finlab.swim.control import (
    Completion,
    Controller,
    Diagnosis,
    FaultMonitor,
    Foresighted,
    Learner,
    Measurement,
    Setpoint,
    TrackingController,
)
from finlab.swim.control.contract import NO_WRENCH, asked_of_weak
from finlab.swim.simulation.devices import (
    DRIVING_POWER,
    FORCE,
    INERTIAL_POWER,
    N_COLUMNS,
    ActuatorForce,
    ActuatorSteps,
    Sensors,
    SensorSettings,
)
from finlab.swim.simulation.log import RunLog, Tick, log_of_ticks
from finlab.swim.simulation.task import Trajectory
from finlab.swim.simulation.truth import Fault, checked_truth, damage_of
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.attitude import quaternion_of
from finlab.swim.vehicle.body_integrator import ActuatorLoad
from finlab.swim.vehicle.fin_motion import FinMotion
from finlab.swim.vehicle.plants import body_integrator
from finlab.swim.vehicle.vehicle import STATE_SIZE

LOOKAHEAD_TICKS = 10
"""Ticks whose wrenches the allocator is given in advance."""
SETPOINTS_AT_ONCE = 50
"""Ticks whose setpoints are computed at once: one at a time costs more."""


class ClosedLoop:
    """One robot under way. Make it, then call `step` until `done`, and `fail` and `mend` in
    between.

        loop = ClosedLoop(layout, finlab.Allocator(layout), make_trajectory("lissajous"))
        while not loop.done:
            tick = loop.step()

    A step takes one control period, 0.1 s by the shipped gains. Nothing in here waits: whoever
    shows a run steps it at the pace of the clock.

    Args:
        layout: the robot; what its body does not say is U-CAT's.
        allocator: of the layout, by any method.
        task: the path, such as `make_trajectory` gives.
        controller: by default the tracking controller of the layout.
        policy: what the allocator does with a wrench that is out of reach; by default its own
            `policy_under_way`, of robots with rudders `closest`.
        sensors: rates and noise; the defaults of `SensorSettings`.
        current: velocity (3,) of the water in the world [m/s].
        failures: what becomes of actuators, and when; (name, time [s]) is one that is lost.
        announced: whether what happens is announced to the allocator; else a monitor has to notice.
        monitor: watches the robot, gives the allocator what it finds, and takes what is announced.
        learner: finds out what the actuators really are; allocator and monitor then work with that.
        truth: the robot that really swims, such as `perturbed(layout, damping=2.0)`, where `layout`
            is only what allocator, controller and monitor believe of it; it has the same actuators.
        plant: what integrates its body, a name in `PLANTS`: `finlab`, the library's own, or
            `mujoco`, which needs that extra.
        seed: of the sensors' noise and of the allocator.

    Raises:
        FinlabError: an allocator of another robot, an unknown actuator or kind of failure, a time
            that is none, a truth that has other actuators, or an unknown plant.
    """

    def __init__(
        self,
        layout: Layout,
        allocator: Allocator,
        task: Trajectory,
        controller: Controller | None = None,
        *,
        policy: Policy | PolicyName | None = None,
        sensors: SensorSettings | None = None,
        current: Sequence[float] = (0.0, 0.0, 0.0),
        failures: Sequence[Fault | tuple[str, float]] = (),
        announced: bool = True,
        monitor: FaultMonitor | None = None,
        learner: Learner | None = None,
        truth: Layout | None = None,
        plant: str = "finlab",
        seed: int = 0,
    ) -> None:
        """Puts the robot at rest at the start of its task."""
        if allocator.layout != layout:
            raise FinlabError(
                f"allocator: expected one for layout {layout.name!r:.60}, got one for "
                f"{allocator.layout.name!r:.60} or another state of it; make it with "
                "Allocator(layout)"
            )
        events = [Fault(*failure).checked() for failure in failures]
        layout.indices([event.name for event in events], "failures")
        self.layout = layout
        self.allocator = allocator
        self.task = task
        self.seed = seed
        self.controller = controller = (
            TrackingController(layout) if controller is None else controller
        )
        self._foresighted = controller if isinstance(controller, Foresighted) else None
        # Rudders that the flow leaves weak must not stop the propeller.
        under_way = "closest" if layout.flow_driven else allocator.policy_under_way
        self.policy = as_policy(under_way if policy is None else policy)
        truth = layout if truth is None else checked_truth(layout, truth)
        self.vehicle = body_integrator(plant, truth, current)
        """The body that really swims, and the current; it may be replaced on the way."""
        self.fin_motion = FinMotion(truth)
        """The fins' motion: amplitude, frequency, zero direction and phase of each."""
        self._forces = ActuatorForce(truth, self.fin_motion)
        self.motion = self._forces.motion
        """The motion of all actuators."""
        self._sensors = Sensors(
            SensorSettings() if sensors is None else sensors, np.random.default_rng(seed)
        )
        self._pending = sorted(events, key=lambda event: event.time_s)
        self.announced = announced
        self.monitor = monitor
        self.learner = learner
        self._begin()

    def _begin(self) -> None:
        """The state at the start, and what is known then."""
        layout = self.layout
        n = self.layout.n
        self.broken: dict[str, Fault] = {}
        """What is true: the actuators that are not whole now, by name."""
        self._announced_faults: dict[str, Fault] = {}
        self._stuck_at = np.full(n, np.nan)
        self._note_faults()
        self._no_beliefs = _constant(np.full(n, np.nan))
        self.verdict: Diagnosis | None = None
        """What the monitor believed at the last step; None without one."""
        self._completion: Completion | None = None
        self._completed_damage: Damage | None = None
        self._ticks: list[Tick] = []
        self._setpoints: deque[Setpoint] = deque()
        """Of this tick and the next ones."""
        self._command: Array | None = None
        # What the command came from, before a monitor's pushes.
        self._allocation_before: Allocation | None = None
        self.period_s = self.controller.period_s
        """Length of a step [s]."""
        self._plant = plant_of(layout)
        self._flow: Array | None = None
        self._believed_motion = ActuatorMotion(layout)
        self._wrench_before = NO_WRENCH
        start, heading = self.task.start()
        self.state = np.zeros(STATE_SIZE)
        """State (13,): position (world), quaternion (w, x, y, z), velocity and rates (body); SI."""
        self.state[:3] = start
        self.state[3:7] = quaternion_of(0.0, 0.0, heading)
        self.controller.reset()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return len(self._ticks) * self.period_s

    @property
    def done(self) -> bool:
        """Whether the task is over."""
        return self.time >= self.task.duration_s - 1e-9

    @property
    def controllable(self) -> bool:
        """Whether the working actuators can give what the controller commands, in small."""
        return self._current_completion().controllable

    @property
    def log(self) -> RunLog:
        """The record so far."""
        return log_of_ticks(
            self._ticks,
            layout=self.layout.name,
            names=self.layout.names,
            method=self.allocator.method,
            controller=self.controller.name,
            task=self.task.name,
            water="current" if any(self.vehicle.current) else "still",
            seed=self.seed,
        )

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the actuators that are lost now, whoever knows of it."""
        return tuple(name for name, fault in self.broken.items() if fault.kind == "lost")

    @property
    def told(self) -> tuple[str, ...]:
        """Names of the actuators that were announced as broken."""
        return tuple(self._announced_faults)

    @property
    def damage(self) -> Damage:
        """What the allocator is given: what was announced, or what the monitor has found."""
        return self._announced_damage if self.verdict is None else self.verdict.damage

    def fail(
        self,
        name: str,
        kind: FaultKind = "lost",
        share: float = 0.5,
        *,
        announced: bool | None = None,
    ) -> None:
        """Something becomes of an actuator, now. Raises LayoutError: there is no actuator of that
        name, or it is the last that works; FinlabError: the kind or the share is none.

        Args:
            name: of the actuator.
            kind: lost (it gives nothing; a fin hangs still), torn (it gives a share of its
                force), stuck (a fin beats but no longer turns, nor does an azimuth; a rudder stays
                as it is, and so does the force of a thruster) or whole.
            share: of the force that a torn actuator gives.
            announced: whether the allocator knows at once; by default as the swim was made.
        """
        fault = Fault(name, self.time, kind, share).checked()
        index = self.layout.index(name)
        if kind == "lost":
            self.layout.without([*(other for other in self.lost if other != name), name])
        self._stuck_at[index] = self.motion.direction[index] if kind == "stuck" else np.nan
        if kind == "stuck" and index in self.motion.fin_indices:
            self.fin_motion.rate[2, np.searchsorted(self.motion.fin_indices, index)] = 0.0
        tells = self.announced if announced is None else announced
        for known in (self.broken, self._announced_faults) if tells else (self.broken,):
            known.pop(name, None)
            if kind != "whole":
                known[name] = fault
        self._note_faults()
        if tells and self.monitor is not None:
            strength = {"lost": 0.0, "torn": share}.get(kind, 1.0)
            self.verdict = self.monitor.tell(name, strength, self._stuck_at[index])

    def _note_faults(self) -> None:
        """What follows from the faults that there are and those that were announced, which hardly
        ever change."""
        names = self.layout.names
        lost = self.lost
        self._alive = _constant(np.array([name not in lost for name in names]))
        share = np.ones(len(names))
        for fault in self.broken.values():
            if fault.kind == "torn":
                share[self.layout.index(fault.name)] = fault.share
        self._share = share
        self._is_stuck = not np.isnan(self._stuck_at).all()
        self._announced_damage = damage_of(self.layout, self._announced_faults, self._stuck_at)

    def mend(self, name: str, *, announced: bool | None = None) -> None:
        """An actuator works again as it should; a `LayoutError` where there is none of that
        name."""
        self.fail(name, "whole", announced=announced)

    def step(self) -> Tick:
        """Swims for one control period and returns what happened."""
        time = self.time
        while self._pending and self._pending[0].time_s <= time + 1e-9:
            event = self._pending.pop(0)
            self.fail(event.name, event.kind, event.share)
        measurement = self._sensors.measure(time, self.state.tolist())
        if self.monitor is not None:
            self.verdict = self.monitor.step(measurement, self._command)
        if self._plant.feels_flow:  # what the sensors know of it: the water itself is taken to rest
            self._flow = np.concatenate([measurement.velocity, measurement.rates])
        setpoint = self._next_setpoints()[0]
        completion = self._current_completion()
        delivered = self._delivered()
        wrench = completion(self.controller.wrench(measurement, setpoint, delivered))
        allocation = self.allocator.allocate(
            wrench,
            damage=self.damage,
            flow=self._flow,
            previous=self._allocation_before,
            reference=self._reference(completion),
            policy=self.policy,
            seed=self.seed,
        )
        self._allocation_before = allocation
        if self.monitor is None:
            command = asked_of_weak(self.layout, self.damage, allocation.command)
        else:
            command = self.monitor.sent(allocation.command)
        tick = self._simulate(measurement, setpoint, wrench, command, allocation.solve_ms)
        self._command = command
        self._setpoints.popleft()
        self._ticks.append(tick)
        learned = None if self.learner is None else self.learner.step(tick.measured, tick.command)
        if learned is not None:
            self._believe(learned)
        return tick

    def _believe(self, layout: Layout) -> None:
        """From now on allocator and monitor take the robot for this one."""
        self.allocator = self.allocator.on(layout)
        self._plant = plant_of(layout)
        self._announced_faults = {
            name: fault for name, fault in self._announced_faults.items() if fault.kind != "torn"
        }
        self._note_faults()
        if self.monitor is not None:
            self.monitor.adopt(layout)
        self._completion = None

    def run(self) -> RunLog:
        """Swims to the end of the task."""
        while not self.done:
            self.step()
        return self.log

    def _next_setpoints(self) -> deque[Setpoint]:
        """The setpoints of this tick and of those that the allocator is given in advance, and
        perhaps more."""
        setpoints = self._setpoints
        if len(setpoints) <= LOOKAHEAD_TICKS:
            first = len(self._ticks) + len(setpoints)
            ticks = np.arange(first, first + SETPOINTS_AT_ONCE)
            # What comes after the end is not swum: a path that ends under way is swum to its end.
            times = np.minimum(ticks * self.period_s, self.task.duration_s)
            setpoints.extend(self.task.setpoints(times))
        return setpoints

    def _reference(self, completion: Completion) -> Array | None:
        """The wrenches (K, 6) that will be asked for at the next ticks, where the controller can
        tell."""
        if self._foresighted is None:
            return None
        expected = self._foresighted.ahead(list(islice(self._setpoints, LOOKAHEAD_TICKS + 1)))
        return completion(expected)

    def _delivered(self) -> Array:
        """Wrench (6,) over the last period, if the actuators that are not taken for lost do what
        they were commanded [N, N m]."""
        if self._command is None:
            return NO_WRENCH
        believed = self._believed_motion
        believed.step(self._as_believed(self._command), self.period_s)
        force = self._plant.force(believed.command, flow=self._flow) * believed.pushes[:, None]
        if lost := self.damage.lost:
            force[list(self.layout.indices(lost))] = 0.0
        before = self._wrench_before
        self._wrench_before = self._plant.wrench_of(force, flow=self._flow)
        return 0.5 * (before + self._wrench_before)

    def _current_completion(self) -> Completion:
        """What completes the controller's wrench for what the actuators can do now."""
        damage = self.damage
        if self._completion is None or damage != self._completed_damage:
            controller = self.controller
            self._completion = Completion(
                self.allocator.layout, damage, controller.axes, controller.free
            )
            self._completed_damage = damage
        return self._completion

    def _as_believed(self, command: Array) -> Array:
        """What a command (n, 3) is taken to have the actuators do: stuck ones do not heed it."""
        stuck = self.damage.stuck
        if not stuck:
            return command
        stuck_at = np.full(self.layout.n, np.nan)
        stuck_at[list(self.layout.indices(list(stuck)))] = list(stuck.values())
        return self.motion.turned_to(command, stuck_at)

    def _for_drives(self, command: Array) -> Array:
        """What drives make of a command (n, 3): a lost actuator is not moved, a stuck one does not
        turn."""
        result = command
        if self.broken:
            result = np.where(self._alive[:, None], command, np.nan)
        return self.motion.turned_to(result, self._stuck_at) if self._is_stuck else result

    def _simulate(
        self,
        measurement: Measurement,
        setpoint: Setpoint,
        wrench: Array,
        command: Array,
        solve_ms: float,
    ) -> Tick:
        """Moves actuators and body over one period.

        Args:
            measurement: that the controller was given.
            setpoint: that the controller was given.
            wrench: that the allocator was asked for (6,) [N, N m].
            command: of the actuators over the period (n, 3).
            solve_ms: time of the allocation [ms].
        """
        time = self.time
        before = self.state
        n_steps = max(1, math.ceil(self.period_s / self._forces.step_s - 1e-9))
        dt = self.period_s / n_steps
        sent = command if self.learner is None else command * self.learner.factor
        mean = self._swim(self._for_drives(sent), dt, n_steps, time)
        beliefs = (self._no_beliefs,) * 3 if self.verdict is None else self.verdict[1:4]
        return Tick(
            time=time,
            position=before[:3].copy(),
            quaternion=before[3:7].copy(),
            motion=before[7:].copy(),
            flow=np.array(self.vehicle.current),
            measured=measurement.as_array(),
            reference=setpoint.position,
            reference_surge=setpoint.surge,
            asked=wrench,
            allocated=self._allocated(self._as_believed(command)),
            delivered=mean.wrench,
            command=sent,
            fin_motion=self.motion.command,
            force=mean.force,
            inertial_power=mean.inertial_power,
            driving_power=mean.driving_power,
            alive=self._alive,
            fault_probability=beliefs[0],
            strength=beliefs[1],
            strength_std=beliefs[2],
            solve_ms=solve_ms,
        )

    def _allocated(self, command: Array) -> Array:
        """The wrench (6,) that a command (n, 3) gives once the actuators have followed it [N, N
        m]."""
        if self.damage.lost:
            return self._plant.wrench(command, flow=self._flow)
        # Nothing is NaN, and nothing has to be checked.
        force = self._plant.force(command, flow=self._flow)
        return self._plant.wrench_of(force, flow=self._flow)

    def _swim(self, command: Array, dt: float, n_steps: int, time: float) -> "MeanOutput":
        """Moves actuators and body over K steps, lets the sensors sample on the way, and returns
        what the actuators gave.

        Args:
            command: of the drives (n, 3); NaN rows are lost.
            dt: length of a step [s].
            n_steps: how many, K.
            time: at the beginning [s].
        """
        moved = self._forces.move(command, dt, n_steps)
        output, wrench, states = self._integrated(moved, dt)
        self.state = states[-1].copy()
        for k, state in enumerate(states[:-1].tolist(), start=1):
            # The sample at the end belongs to the next period.
            self._sensors.sample(time + k * dt, state)
        delivered = np.add.reduce(wrench) / n_steps
        mean = np.add.reduce(output) / n_steps
        return MeanOutput(
            delivered,
            self._forces.in_body(mean[:, FORCE], delivered),
            mean[:, INERTIAL_POWER],
            mean[:, DRIVING_POWER],
        )

    def _integrated(self, moved: ActuatorSteps, dt: float) -> tuple[Array, Array, Array]:
        """Returns what the actuators give in K steps, as `ActuatorForce.output`, its wrenches (K,
        6) [N, N m], and the states (K, 13) of the body after each; what does not depend on how that
        moves through the water is one call for all steps.

        Args:
            moved: how the actuators move.
            dt: length of a step [s].
        """
        forces = self._forces
        vehicle = self.vehicle
        if not forces.feels_flow:
            output = forces.output(moved, dt, self._share, None)
            wrench = forces.wrench(output[..., FORCE], None)
            load = ActuatorLoad(wrench, output[..., FORCE], moved.others)
            return output, wrench, vehicle.advance(self.state, load, dt)
        n_steps = len(moved.others)
        wrench = np.empty((n_steps, 6))
        states = np.empty((n_steps, STATE_SIZE))
        if forces.laws_feel_flow:
            output = np.empty((n_steps, self.layout.n, N_COLUMNS))
        else:
            output = forces.output(moved, dt, self._share, None)
        state = self.state
        for k in range(n_steps):
            step = slice(k, k + 1)
            water = vehicle.velocity_in_water(state)
            if forces.laws_feel_flow:
                output[step] = forces.output(moved.at(k), dt, self._share, water)
            wrench[step] = forces.wrench(output[step, :, FORCE], water)
            load = ActuatorLoad(wrench[step], output[step, :, FORCE], moved.others[step])
            state = vehicle.advance(state, load, dt)[0]
            states[k] = state
        return output, wrench, states


class MeanOutput(NamedTuple):
    """What n actuators gave in a period, on average."""

    wrench: Array
    """(6,) [N, N m]."""
    force: Array
    """Forces (n, 3) in the body frame [N], with a share of what the actuators do to each other."""
    inertial_power: Array
    """(n,) [W]."""
    driving_power: Array
    """(n,) [W]."""


def _constant(values: NDArray[Any]) -> NDArray[Any]:
    """An array that all ticks of a swim share, which nobody may change."""
    values.setflags(write=False)
    return values
