"""A robot that swims: sensors, controller, allocator, fins and body, one control period at a time."""

import math
from collections.abc import Sequence

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.control import Completion, Controller, Measurement, VelocityController, WaypointController
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.physics.fin_motion import FinMotion, Servo, fin_power
from finlab.physics.vehicle import STATE_SIZE, Vehicle, complete_body, quaternion_of_yaw
from finlab.sim.log import RunLog, Tick, log_of_ticks
from finlab.sim.plants import make_plant
from finlab.sim.sensors import Sensors, SensorSettings
from finlab.sim.task import Cruise, Task


class ClosedLoop:
    """One robot under way. Make it, then call `step` until `done`; `fail` and `mend` fins as you like.

        loop = ClosedLoop(layout, finlab.load_allocator(), make_trajectory("lissajous"))
        while not loop.done:
            tick = loop.step()

    A step takes one control period, 0.1 s by the shipped gains. Nothing in here waits: whoever shows a run
    steps it at the pace of the clock.
    """

    def __init__(
        self,
        layout: Layout,
        allocator: Allocator,
        task: Task,
        controller: Controller | None = None,
        *,
        plant: str = "mean",
        steady: bool = False,
        sensors: SensorSettings | None = None,
        servo: Servo | None = None,
        current: Sequence[float] = (0.0, 0.0, 0.0),
        failures: Sequence[tuple[str, float]] = (),
        seed: int = 0,
    ) -> None:
        """Puts the robot at rest at the start of its task.

        Args:
            layout: the robot; what its body does not say is U-CAT's.
            allocator: any method.
            task: a `Trajectory` or a `Cruise`.
            controller: by default the waypoint controller for trajectories, the velocity controller for
                cruises.
            plant: what the fins really do; see `PLANTS`.
            steady: whether the allocator is given its previous command, so that fins turn little per tick.
            sensors: rates and noise; the defaults of `SensorSettings`.
            servo: what drives the fins.
            current: velocity of the water (3,) in the world [m/s].
            failures: names of fins, each with the time [s] at which it is lost.
            seed: of the sensors' noise and of the allocator.

        Raises:
            FinlabError: an unknown fin or plant, or a time that is none.
        """
        layout.indices([name for name, _ in failures])
        for name, time in failures:
            if not (math.isfinite(time) and time >= 0.0):
                raise FinlabError(f"failure of {name}: expected a time of 0 s or more, got {time}")
        self.layout = layout
        self.allocator = allocator
        self.task = task
        usual = VelocityController if isinstance(task, Cruise) else WaypointController
        self.controller = usual() if controller is None else controller
        self.plant = plant
        self.steady = steady
        self.seed = seed
        self.vehicle = Vehicle(complete_body(layout), current)
        self.fins = FinMotion(layout, servo)
        """The fins' motion: amplitude, frequency, zero direction and phase of each."""
        self._fin_force = make_plant(plant, layout)
        self._plant = plant_of(layout)
        self._sensors = Sensors(SensorSettings() if sensors is None else sensors, np.random.default_rng(seed))
        self._pending = sorted(failures, key=lambda failure: failure[1])
        self.failed: tuple[str, ...] = ()
        """Names of the fins that are lost now."""
        self._completion: dict[tuple[str, ...], Completion] = {}
        self._ticks: list[Tick] = []
        self._command: Array | None = None
        self.period_s = self.controller.period_s
        """Length of a step [s]."""
        start, heading = task.start()
        self.state = np.zeros(STATE_SIZE)
        """State (13,): position (world), quaternion (w, x, y, z), velocity and rates (body); SI."""
        self.state[:3], self.state[3:7] = start, quaternion_of_yaw(heading)
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
        """Whether the working fins can give what the controller commands, in small."""
        return self._complete().controllable

    @property
    def log(self) -> RunLog:
        """The record so far."""
        return log_of_ticks(
            self._ticks,
            layout=self.layout.name,
            fins=self.layout.names,
            method=self.allocator.name,
            controller=self.controller.name,
            task=self.task.name,
            plant=self.plant,
            seed=self.seed,
        )

    def fail(self, name: str) -> None:
        """A fin stops and hangs still; the allocator knows at once.

        Raises:
            LayoutError: there is no fin of that name, or it is the last that works.
        """
        self.layout.index(name)
        if name not in self.failed:
            self.layout.without([*self.failed, name])
            self.failed = (*self.failed, name)

    def mend(self, name: str) -> None:
        """A lost fin works again; a `LayoutError` where there is no fin of that name."""
        self.layout.index(name)
        self.failed = tuple(other for other in self.failed if other != name)

    def step(self) -> Tick:
        """Swims for one control period and returns what happened."""
        time = self.time
        while self._pending and self._pending[0][1] <= time + 1e-9:
            self.fail(self._pending.pop(0)[0])
        now = self._sensors.measure(time, self.state)
        asked = self._complete()(
            self.controller.wrench(now, self.task.setpoint(time + self.controller.lead_s))
        )
        previous = self._command if self.steady else None
        answer = self.allocator.allocate(
            self.layout, asked, failed=self.failed, previous=previous, seed=self.seed
        )
        tick = self._move(time, now, asked, answer.command, answer.solve_ms)
        self._command = answer.command
        self._ticks.append(tick)
        return tick

    def run(self) -> RunLog:
        """Swims to the end of the task."""
        while not self.done:
            self.step()
        return self.log

    def _complete(self) -> Completion:
        """What completes the controller's wrench for the fins that work now."""
        if self.failed not in self._completion:
            self._completion[self.failed] = Completion(self.layout, self.failed, self.controller.axes)
        return self._completion[self.failed]

    def _move(self, time: float, now: Measurement, asked: Array, command: Array, solve_ms: float) -> Tick:
        """Fins and body over one period with a constant command."""
        before, setpoint = self.state, self.task.setpoint(time)
        n_steps = max(1, math.ceil(self.period_s / self._fin_force.step_s - 1e-9))
        dt = self.period_s / n_steps
        alive = np.isfinite(command[:, 0])
        mean = np.zeros((self.layout.n_fins, 6))
        inertial, torque = np.zeros(self.layout.n_fins), np.zeros(self.layout.n_fins)
        for k in range(n_steps):
            self.fins.step(command, dt)
            force = self._fin_force.step(self.fins, dt, self.vehicle.velocity_in_water(self.state))
            wrenches = np.einsum("nk,nkw->nw", force, self._fin_force.columns)
            wrenches[~alive] = 0.0
            wrench = wrenches.sum(axis=0)
            self.state = self.vehicle.step(self.state, wrench.tolist(), dt)
            if k + 1 < n_steps:  # the sample at the end belongs to the next period
                self._sensors.measure(time + (k + 1) * dt, self.state)
            power = fin_power(self.fins, self._plant.blade)
            mean += wrenches / n_steps
            inertial += power.inertial / n_steps
            torque += power.torque / n_steps
        return Tick(
            time=time,
            position=before[:3].copy(),
            quaternion=before[3:7].copy(),
            motion=before[7:].copy(),
            measured=now.as_array(),
            reference=setpoint.position,
            reference_surge=setpoint.surge,
            asked=asked,
            allocated=self._plant.wrench(np.where(alive[:, None], command, 0.0)),
            delivered=mean.sum(axis=0),
            command=command,
            fin_motion=self.fins.command,
            fin_angle=self.fins.angle,
            fin_force=mean[:, :3],
            inertial_power=inertial,
            torque_power=torque,
            alive=alive,
            solve_ms=solve_ms,
        )
