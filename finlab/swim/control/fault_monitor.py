"""Notices actuators that are lost, weak, wired the wrong way or stuck, from how the robot moves,
and takes repaired ones back.

`Hypotheses` says how likely each fault is; here is decided which of them to act on, what the
allocator is told, and what is sent to the drives.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from finlab.allocation.rates import Rates
from finlab.arrays import Array
from finlab.axes import AXES, wrapped_angle
from finlab.layout import Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from finlab.physics import plant_of
from finlab.swim.control.accelerometer import specific_force
from finlab.swim.control.contract import Measurement, asked_of_weak
from finlab.swim.control.hypotheses import LOST_BELOW, REVERSED_BELOW, WEAK_BELOW, Hypotheses
from finlab.swim.control.jump_evidence import (
    KINDS,
    LOST,
    OF_KIND,
    REVERSED,
    STUCK,
    WEAK,
    WHOLE,
    Evidence,
)
from finlab.swim.control.monitor_settings import MonitorSettings
from finlab.swim.control.motion_model import DEPTH, N_MOVING, VELOCITY, ModelStep, MotionModel
from finlab.swim.control.null_space_motion import NullSpaceMotion
from finlab.swim.control.probe import Probe

GONE_BELOW = 0.2
"""A strength below which it lies within a standard deviation, too."""
TORN_BELOW = 0.7
"""Share of its force below which one that is stuck at an angle is torn, too."""
CONFIRM_S = 0.2
"""A fault is acted on once it has been certain for so long [s]: a single odd sample decides
nothing."""
KIND_ODDS = 10.0
"""Odds of the likeliest kind of fault against the others from which on it is named at once."""
KIND_WAIT_S = 2.0
"""Time in which these odds go down to 1: one whose kind is in doubt is then taken for the likeliest
[s]."""
LOST_LOG_ODDS = math.log(KIND_ODDS)
"""Logarithm of the odds of lost against weak below which one is called weak: it is used on, asked
for more, and soon shows which of both it is; one that is called lost rests, and shows nothing."""
PAIR_LOG_ODDS = math.log(100.0)
"""Logarithm of the odds of two losses at once against all else from which on both are named: a
second actuator explains much that a body beside its drawing does."""
DOUBTED_FROM = 0.1
"""Probability of a fault from which on an actuator is in doubt."""
CAUTION_S = 15.0
"""Time after a fault was named in which another actuator is named more cautiously: the robot moves
as it never did before [s]."""
CAUTIOUS_CONFIRM_S = 1.0
"""How long another fault must then be certain [s]."""
CAUTIOUS_LOG_ODDS = 30.0
"""Logarithm of its odds that it then takes."""
UNKNOWN_WAIT_S = 1.0
"""Time after which a motion that nothing explains is said to be so [s]."""
JOLT_WAIT_S = 3.0
"""Time after which a wrench that no fault explains is taken for one that stays [s]."""
MODEL_MISFIT_MAX = 1e3
"""A misfit of the motion, a variance over that of the settings, from which on nothing can be told
of it."""
STRENGTH_STEP = 0.05
"""The allocator is given strengths in steps of this size, so that its problem is the same for many
ticks."""
NEGLIGIBLE = 0.004
"""Share of its largest force below which a stuck thruster is a lost one."""
SAME_DIRECTION = 0.9
"""Cosine from which one that pushes again, while it is tried, pushes where it is asked to."""
STUCK_STEP = 0.005
"""The same of the force of a stuck one, as a share of its largest, and of an angle [rad]."""
PERIOD_MAX_S = 0.25
"""Longest step of the model [s]; a longer period is cut."""
GAP_MAX_S = 2.0
"""A pause between samples after which the motion is unknown [s]."""
MEASURED_MAX = 12
"""Most numbers of one measurement: rates, tilt, velocity, depth, specific force."""
STEEP_COSINE = 0.3
"""Cosine of the pitch below which roll and heading say too little of the attitude to tell
anything."""


FOULED = "fouled"
"""What a weak actuator is called whose drive drags something."""


class Finding(NamedTuple):
    """One actuator that is not whole."""

    name: str
    """Of the actuator."""
    kind: str
    """`lost`, `weak`, `fouled`, `reversed` or `stuck`; a fouled one is a weak one whose drive says
    that it turns slowly and takes more current than belongs to that."""
    since_s: float
    """When it happened, as far as is known, by the clock of the measurements [s]."""
    probability: float
    """Of that kind of fault, when it was named; 1 where it was told."""
    value: float
    """Share of the force that a weak one gives; the force of a stuck thruster [N], or the angle at
    which another one is stuck [rad]; 0 of a lost one, -1 of a reversed one."""


class Diagnosis(NamedTuple):
    """What a monitor believes of n actuators."""

    damage: Damage
    """The actuators that are lost, weak, torn or stuck, for an allocator: `allocate(...,
    damage=damage)`. A reversed one counts as lost until the layout is put right."""
    probability: Array
    """Of each actuator not being whole (n,), 0 to 1."""
    strength: Array
    """Share of its law's thrust that each actuator gives (n,)."""
    strength_std: Array
    """Standard deviation of that share (n,)."""
    findings: tuple[Finding, ...] = ()
    """What is wrong with which actuator."""
    unknown: bool = False
    """Whether the robot moves as no named fault explains: something is wrong, and it cannot be
    said what."""


class FaultMonitor:
    """Watches one robot; to be called in each period, before the allocator.

        monitor = FaultMonitor(layout)
        while swimming:
            verdict = monitor.step(measurement, command)  # the command that was in force until now
            answer = allocator.allocate(wrench, damage=verdict.damage)
            command = monitor.sent(answer.command)

    An actuator that rests cannot be distinguished from one that is lost: its probability stays
    where it was.
    """

    period_s = 0.1
    """Time between calls [s], where the measurements' times do not say it."""

    def __init__(
        self, layout: Layout, settings: MonitorSettings | None = None, period_s: float | None = None
    ) -> None:
        """Believes that all actuators of a layout are whole.

        Args:
            layout: the robot.
            settings: what is expected of its sensors and faults.
            period_s: time between calls of `sent` [s]; that of the class when None.
        """
        self.layout = layout
        if period_s is not None:
            self.period_s = period_s
        self.settings = MonitorSettings() if settings is None else settings
        self._model = MotionModel(layout)
        self._hypotheses = Hypotheses(self._model, self.settings)
        self._probe = Probe(layout, self.settings, self.period_s)
        self._test_motion = NullSpaceMotion(layout)
        self._doubted = -1
        """A whole actuator that may be broken; -1 for none."""
        # Rows of what is measured by the state, those of rates and tilt first, and variances.
        self._rows = np.zeros((MEASURED_MAX, self._model.size))
        self._rows[range(5), range(3, 8)] = 1.0
        s = self.settings
        self._variance = np.zeros(MEASURED_MAX)
        self._variance[:5] = np.square([s.rate_noise] * 3 + [s.tilt_noise] * 2)
        n = layout.n
        self._kind = np.full(n, WHOLE)
        """What each actuator is taken for, index in `KINDS`."""
        self._since = np.zeros(n)
        self._certainty = np.zeros(n)
        self._is_announced = np.zeros(n, dtype=bool)  # lost or stuck by what was said, left alone
        self._is_returning = np.zeros(n, dtype=bool)  # from a probe to what is commanded
        self._rates = Rates(plant_of(layout), layout.rates * self.period_s)
        self._sent = np.full((n, 3), np.nan)
        self._no_direction = np.zeros(n)  # of actuators that are not tried
        self._never_stuck = np.full(n, np.nan)
        self._suspect = (-1, -1)
        """Actuator and kind that are likeliest to be a new fault."""
        self._last_named_s = -math.inf
        self._certain_s = 0.0
        """Time for which that has been all but certain [s]."""
        self._doubtful_s = 0.0
        """Time for which a fault has been certain and its kind has not [s]."""
        self._unexplained_s = 0.0
        self._is_unknown = False
        self._probability = np.zeros(n)
        self._reported_strength = np.ones(n)
        self._reported_held = np.zeros(self._model.n_held)
        self._told_faults: tuple[list[str], dict[str, float], dict[str, float]] = ([], {}, {})
        self._told_damage = NO_DAMAGE
        self._tables = [fin for fin in layout.fins if fin.model.type == "table"]
        self._time = math.nan
        self._clock_s = 0.0  # time that has been watched, from 0
        self._velocity: tuple[float, ...] | None = None
        self._velocity_time = -math.inf
        self._depth = math.nan
        self.accelerometer_place: Array = np.zeros(3)
        """Where the accelerometer sits, from the centre of gravity (3,), body frame [m]."""
        self.evidence: Evidence | None = None
        """How likely each jump was at the last call; None before there is any."""

    @property
    def opposed(self) -> tuple[str, ...]:
        """Names of those that push the other way than the layout says; the allocator does without
        them until the layout is put right."""
        return tuple(self.layout.names[k] for k in np.flatnonzero(self._kind == REVERSED))

    @property
    def tells(self) -> bool:
        """Whether losses would show: not where the robot moves far otherwise than its model
        says."""
        return self._hypotheses.misfit < MODEL_MISFIT_MAX

    @property
    def _is_lost(self) -> Array:
        return np.asarray((self._kind == LOST) | (self._kind == REVERSED))

    def step(self, measurement: Measurement, command: Array | None) -> Diagnosis:
        """Takes what has been measured and says what is believed.

        Args:
            measurement: of now. Samples of velocity and depth count as new where their numbers
                have changed, those of drives where they were taken later than the ones before, and
                all as old as their ages say; NaN is no sample.
            command: (n, 3) [rad, Hz, rad] in force since the last call, as it was sent to the
                drives, NaN for actuators at rest; None before the first.
        """
        hypotheses = self._hypotheses
        m = measurement
        duration = m.time - self._time if m.time > self._time else self.period_s
        is_first = math.isnan(self._time)
        self._time = m.time
        if is_first or command is None or duration > GAP_MAX_S:
            hypotheses.state[:N_MOVING] = self._moving(m)
            self._is_new_velocity(m)
            self._depth = m.depth
            return self.verdict()
        self._clock_s += duration
        parts = math.ceil(duration / PERIOD_MAX_S - 1e-9)
        for _ in range(parts):
            step = self._model.step(
                hypotheses.state, m.yaw, command, duration / parts, hypotheses.shared_covariance
            )
            hypotheses.predict(step, duration / parts)
        if not self._follow(m, step):
            hypotheses.restart(self._moving(m))
            return self.verdict()
        drives = hypotheses.drives
        drives.note_force(m.time)
        if m.drives is not None:
            drives.take(m.drives, m.time)
        self._decide(duration)
        return self.verdict()

    def _follow(self, m: Measurement, step: ModelStep) -> bool:
        """Corrects the filter by a measurement; returns whether it can follow the motion."""
        hypotheses = self._hypotheses
        if abs(math.cos(m.pitch)) < STEEP_COSINE or hypotheses.has_diverged:
            return False
        return self._correct(m, step) and not hypotheses.has_diverged

    def _moving(self, m: Measurement) -> Array:
        """The moving part of the state (9,), as measured."""
        velocity = np.where(np.isfinite(m.velocity), m.velocity, 0.0)
        depth = m.depth if math.isfinite(m.depth) else 0.0
        return np.array([*velocity.tolist(), *m.rates.tolist(), m.roll, m.pitch, depth])

    def _is_new_velocity(self, m: Measurement) -> bool:
        """Whether there is a sample of the velocity that has not been seen."""
        velocity = tuple(m.velocity.tolist())
        is_other = velocity != self._velocity
        self._velocity = velocity
        return is_other and all(map(math.isfinite, velocity))

    def _correct(self, m: Measurement, step: ModelStep) -> bool:
        """Corrects the filter by the samples of a measurement; returns whether the model says
        anything of the motion."""
        state = self._hypotheses.state
        rows = self._rows
        innovation = np.zeros(MEASURED_MAX)
        innovation[:5] = (*m.rates.tolist(), m.roll, m.pitch)
        innovation[:5] -= state[3:8]
        innovation[3] = wrapped_angle(innovation[3])
        variance = self._variance
        count = 5
        if self._is_new_velocity(m):
            age = m.ages[2]
            # v(t - age) = v - age v'
            innovation[5:8] = m.velocity - (state[VELOCITY] - age * step.acceleration[VELOCITY])
            rows[5:8] = -age * step.acceleration_slope[VELOCITY]
            rows[(5, 6, 7), (0, 1, 2)] += 1.0
            variance[5:8] = self.settings.velocity_noise**2
            count = 8
        if math.isfinite(m.depth) and m.depth != self._depth:
            age = m.ages[1]
            innovation[count] = m.depth - (state[DEPTH] - age * step.acceleration[DEPTH])
            rows[count] = -age * step.acceleration_slope[DEPTH]
            rows[count, DEPTH] += 1.0
            variance[count] = self.settings.depth_noise**2
            count += 1
        self._depth = m.depth
        if np.isfinite(m.acceleration).all():
            seen = slice(count, count + 3)
            expected, rows[seen] = specific_force(state, step, self.accelerometer_place)
            innovation[seen] = m.acceleration - expected
            of_motion = self._hypotheses.acceleration_variance[VELOCITY]
            variance[seen] = self.settings.acceleration_noise**2 + of_motion
            count += 3
        return self._hypotheses.update(rows[:count], innovation[:count], variance[:count])

    def tell(self, name: str, strength: float = 1.0, stuck: float = math.nan) -> Diagnosis:
        """The state of an actuator is known: its strength, and where it is stuck [rad, N] if it is.

        One that is said to be lost or stuck is left alone until another state is said: nothing
        tries it.
        Raises LayoutError: there is no actuator of that name."""
        k = self.layout.index(name)
        model = self._model
        held = None
        kind = WHOLE
        if not math.isnan(stuck) and model.sticks[k] and strength >= LOST_BELOW:
            kind = STUCK
            numbers = [math.cos(stuck), math.sin(stuck)] if model.sticks_at_angle[k] else [stuck]
            held = strength * np.array(numbers)
            self._hypotheses.believe(k, 0.0, held)
        else:
            self._hypotheses.believe(k, strength)
            if strength < REVERSED_BELOW:
                kind = REVERSED
            elif strength < LOST_BELOW or not math.isnan(stuck):
                kind = LOST
            elif strength < WEAK_BELOW:
                kind = WEAK
        self._mark(k, kind, self._clock_s, 1.0)
        self._is_announced[k] = kind in (LOST, REVERSED, STUCK)
        return self.verdict()

    def adopt(self, layout: Layout) -> None:
        """Takes the robot for another one with the same body: what is not lost is as that layout
        says."""
        self.layout = layout
        self._model.adopt(layout)
        self._rates = Rates(plant_of(layout), layout.rates * self.period_s)
        self._test_motion = NullSpaceMotion(layout)
        for k in np.flatnonzero(self._kind != LOST):
            self._hypotheses.believe(int(k), 1.0)
            self._kind[k] = WHOLE

    def tested(
        self, command: Array, axes: Sequence[str] = AXES, most_n: float | None = None
    ) -> Array:
        """The command (n, 3) with a short test motion where a thruster is in doubt: forces go up
        and down for a second and a half in a way that leaves the wrench as it is, and what the
        suspect does not give of it shows. To be called before `sent`, where the task can bear it:
        if the suspect is lost, the robot feels the force that it was told more.

        It keeps to limits and rates. Thrusters with a fixed axis take part; without redundancy
        there is no such motion, and the command stays as it is.

        Args:
            command: of the allocator.
            axes: names of the axes along which the wrench has to stay; along the others it changes
                as little as can be.
            most_n: largest force that the suspect may be told more or less [N]; None for a tenth of
                its largest.
        """
        motion = self._test_motion
        works = self._kind == WHOLE
        if not motion.is_under_way and self._doubted >= 0:
            motion.begin(command, self._doubted, works, axes, most_n)
        if not motion.is_under_way:
            return command
        box = self._rates.box(self._sent)
        return motion.added(command, box.lower[:, 0], box.upper[:, 0], works, self.period_s)

    def sent(self, command: Array) -> Array:
        """The command (n, 3) for the drives, of what the allocator answers: a weak thruster is
        asked for more than it is to give, and `probed` keeps resting ones known."""
        damage = self._told_damage if (self._kind != WHOLE).any() else NO_DAMAGE
        return self.probed(asked_of_weak(self.layout, damage, command))

    def probed(self, command: Array) -> Array:
        """The command (n, 3) with what keeps the actuators known.

        Now and then one that the monitor has called lost is tried for two seconds: if it gives
        nothing by it, it is lost, and of one that has been repaired the robot feels it, and takes
        it back. A thruster that it has called stuck is tried by another force than the one at which
        it is stuck, as the allocator asks it for that one. Fins that all but rest push a little,
        see `MonitorSettings.least_push`. Both change no faster than the rates of the drives allow
        from what was returned last, as does the way back to what is commanded.
        """
        gives_stuck_force = (self._kind == STUCK) & ~self._model.sticks_at_angle
        tried = (self._is_lost | gives_stuck_force) & ~self._is_announced
        direction = self._no_direction
        stuck_at = self._never_stuck
        if tried.any():
            direction = self._model.motion.direction
            stuck_at = stuck_at.copy()
            for k in np.flatnonzero(gives_stuck_force).tolist():
                stuck_at[k] = self._stuck_value(k)
        probed = self._probe.added(command, tried, direction, stuck_at)
        if probed is command and not self._is_returning.any():
            self._sent = command
            return command
        is_probed = (np.isfinite(probed[:, :1]) & ~(probed == command)).any(axis=1)
        is_limited = is_probed | self._is_returning
        result = probed
        if is_limited.any():
            is_idle = np.isnan(self._sent[:, :1])
            box = self._rates.box(np.where(is_idle, self._model.motion.command, self._sent))
            result = np.where(is_limited[:, None], box.clip(probed), probed)
        self._is_returning = (np.isfinite(result) & ~(result == command)).any(axis=1)
        self._sent = result
        return result

    def verdict(self) -> Diagnosis:
        """What is believed now."""
        hypotheses = self._hypotheses
        strength = hypotheses.strength.copy()
        is_stuck = self._kind == STUCK
        strength[is_stuck] = 1.0  # it pushes, and does not obey
        is_broken = self._kind != WHOLE
        damage = NO_DAMAGE
        findings: tuple[Finding, ...] = ()
        if True in is_broken.tolist():
            damage = self._damage(hypotheses.strength)
            findings = tuple(self._finding(int(k)) for k in np.flatnonzero(is_broken))
        return Diagnosis(
            damage, self._probability, strength, hypotheses.strength_std, findings, self._is_unknown
        )

    def _stuck_value(self, k: int) -> float:
        """The force [N] or the angle [rad] at which an actuator is stuck."""
        held = self._reported_held[self._model.held_of[k]]
        return float(held[0]) if len(held) == 1 else math.atan2(held[1], held[0])

    def _finding(self, k: int) -> Finding:
        hypotheses = self._hypotheses
        kind = int(self._kind[k])
        value = {LOST: 0.0, REVERSED: -1.0}.get(kind, float(self._reported_strength[k]))
        if kind == STUCK:
            value = self._stuck_value(k)
        # From the time that has been watched to the clock of the measurements.
        since_s = float(self._since[k])
        if not math.isnan(self._time):
            since_s += self._time - self._clock_s
        name = KINDS[kind]
        if kind == WEAK and hypotheses.drives.fouled[k]:
            name = FOULED
        return Finding(self.layout.names[k], name, since_s, float(self._certainty[k]), value)

    def _damage(self, strength: Array) -> Damage:
        """What an allocator should know; a table's thrust cannot be scaled."""
        names = self.layout.names
        parts = self.layout.actuators
        is_far = np.abs(strength - self._reported_strength) > 0.75 * STRENGTH_STEP
        rounded = (
            np.clip(np.round(strength / STRENGTH_STEP), 1, round(1 / STRENGTH_STEP)) * STRENGTH_STEP
        )
        self._reported_strength = np.where(is_far, rounded, self._reported_strength)
        held = self._hypotheses.held
        scale = STUCK_STEP * self._hypotheses.held_scale
        is_far = np.abs(held - self._reported_held) > 0.75 * scale
        self._reported_held = np.where(is_far, held, self._reported_held)
        weak = [k for k in np.flatnonzero(self._kind == WEAK) if parts[k] not in self._tables]
        stuck = np.flatnonzero(self._kind == STUCK)
        faults = (
            [names[k] for k in np.flatnonzero(self._is_lost)],
            {names[k]: float(self._reported_strength[k]) for k in weak} | self._torn_and_stuck(),
            {names[k]: self._within(k, self._stuck_value(k)) for k in stuck.tolist()},
        )
        # The same damage for as long as nothing changes: making one takes time.
        if faults != self._told_faults:
            self._told_faults = faults
            self._told_damage = Damage.representing(self.layout, *faults)
        return self._told_damage

    def _torn_and_stuck(self) -> dict[str, float]:
        """Shares of the force of those that are stuck at an angle and give far less than they
        should."""
        shares = {}
        for k in np.flatnonzero((self._kind == STUCK) & self._model.sticks_at_angle).tolist():
            share = math.hypot(*self._reported_held[self._model.held_of[k]].tolist())
            if share < TORN_BELOW and self.layout.actuators[k] not in self._tables:
                shares[self.layout.names[k]] = max(round(share / STRENGTH_STEP), 1) * STRENGTH_STEP
        return shares

    def _within(self, k: int, value: float) -> float:
        """A force within what the thruster can give; angles as they are."""
        part = self.layout.actuators[k]
        if part.KIND.sticks_at_angle:
            return value
        return min(max(value, part.lower[0]), part.upper[0])

    def _decide(self, duration: float) -> None:
        """Acts on what has become all but certain.

        Args:
            duration: time since the last call [s].
        """
        hypotheses = self._hypotheses
        self._follow_strength()
        if not len(hypotheses.onset_age):
            return
        evidence = hypotheses.evidence()
        self.evidence = evidence
        odds = _Odds(evidence, hypotheses.settled)
        self._note_probability(odds)
        if self._decide_on_pair(evidence, odds, duration):
            return
        k = odds.actuator
        share = math.exp(float(odds.with_pairs[k]) - odds.everything)
        is_doubted = share > DOUBTED_FROM and self._kind[k] == WHOLE and hypotheses.settled
        self._doubted = k if is_doubted else -1
        if share < self.settings.threshold:
            self._certain_s = 0.0
            self._doubtful_s = 0.0
            self._watch_unexplained(evidence, odds.everything, duration)
            return
        self._hold((k, -1), duration)
        self._doubtful_s += duration
        if not self._is_confirmed(odds):
            return
        if odds.of_single < 0.5 and self._doubtful_s < KIND_WAIT_S:
            return  # a pair that is not clear yet
        kind = odds.kind
        if kind == LOST and float(odds.by_kind[k, LOST] - odds.by_kind[k, WEAK]) < LOST_LOG_ODDS:
            kind = WEAK
        loses = kind in (LOST, REVERSED) and self._kind[k] not in (LOST, REVERSED)
        if loses and self._is_lost.sum() >= self.layout.n - 1:
            return  # the last one that works
        self._adopt(evidence, k, kind, share * odds.of_kind)

    def _note_probability(self, odds: "_Odds") -> None:
        """The probabilities of actuators not being whole."""
        is_whole = self._kind == WHOLE
        logarithm = np.where(is_whole, odds.with_pairs, odds.by_kind[:, WHOLE])
        share = np.exp(logarithm - odds.everything)
        self._probability = np.where(is_whole, share, 1.0 - share)

    def _decide_on_pair(self, evidence: Evidence, odds: "_Odds", duration: float) -> bool:
        """Acts on two losses at one moment; returns whether they are all but certain."""
        is_calm = self._clock_s - self._last_named_s >= CAUTION_S
        if not is_calm or odds.pair - odds.without_pairs <= PAIR_LOG_ODDS:
            return False
        pair = int(odds.pairs.argmax())
        self._hold((-2, pair), duration)
        if self._certain_s >= CONFIRM_S - 1e-9:
            self._adopt_pair(evidence, pair)
        return True

    def _is_confirmed(self, odds: "_Odds") -> bool:
        """Whether the likeliest fault has been certain for long enough, and its kind is clear."""
        k = odds.actuator
        waited = min(self._doubtful_s / KIND_WAIT_S, 1.0)
        odds_needed = KIND_ODDS + (1.0 - KIND_ODDS) * waited
        # What the likeliest explanation has of all those of this actuator; one that is lost with
        # another is no less lost.
        of_alone = odds.of_kind * odds.of_single
        in_pairs = 1.0 - odds.of_single
        of_best = of_alone + in_pairs if odds.kind == LOST else max(of_alone, in_pairs)
        is_clear = of_best > (1.0 - of_best) * odds_needed or waited == 1.0
        confirm_s = CONFIRM_S
        if self._clock_s - self._last_named_s < CAUTION_S and self._kind[k] == WHOLE:
            confirm_s = CAUTIOUS_CONFIRM_S
            is_clear = is_clear and float(odds.with_pairs[k]) > CAUTIOUS_LOG_ODDS
        return is_clear and self._certain_s >= confirm_s - 1e-9

    def _hold(self, suspect: tuple[int, int], duration: float) -> None:
        """Counts for how long one suspicion has been certain."""
        self._certain_s = self._certain_s + duration if suspect == self._suspect else duration
        self._suspect = suspect

    def _adopt(self, evidence: Evidence, k: int, kind: int, certainty: float) -> None:
        """Takes a fault for true."""
        odds = evidence.log_odds[:, k, OF_KIND[kind]]
        onset, place = np.unravel_index(int(odds.argmax()), odds.shape)
        target = int(OF_KIND[kind][place])
        hypotheses = self._hypotheses
        since = self._clock_s - float(hypotheses.onset_age[onset])
        mean = evidence.mean[onset, k, target]
        variance = evidence.variance[onset, k, target]
        hypotheses.adopt(int(onset), k, mean, variance)
        if kind == STUCK and self._obeys_its_trial(k):
            kind = WHOLE
            hypotheses.believe(k, 1.0)
        if kind == STUCK and self._is_negligible(k) and self._is_lost.sum() < self.layout.n - 1:
            kind = LOST
            hypotheses.believe(k, 0.0)
        self._mark(k, kind, since, certainty)

    def _obeys_its_trial(self, k: int) -> bool:
        """Whether one that was lost pushes where its trial asks it to: a trial asks for one
        direction alone, in which one that is stuck cannot be told from one that was repaired. If it
        is stuck after all, that shows as soon as it is asked for another."""
        if not self._is_lost[k] or not self._model.sticks_at_angle[k]:
            return False
        held = self._hypotheses.held[self._model.held_of[k]]
        commanded_angle = float(self._model.motion.direction[k])
        along = held[0] * math.cos(commanded_angle) + held[1] * math.sin(commanded_angle)
        return bool(along >= SAME_DIRECTION * math.hypot(held[0], held[1]))

    def _is_negligible(self, k: int) -> bool:
        """Whether what a stuck actuator gives is too little to count."""
        if self._model.sticks_at_angle[k]:
            return False
        hypotheses = self._hypotheses
        numbers = self._model.held_of[k]
        return bool(
            (np.abs(hypotheses.held[numbers]) < NEGLIGIBLE * hypotheses.held_scale[numbers]).all()
        )

    def _adopt_pair(self, evidence: Evidence, pair: int) -> None:
        """Takes two for lost."""
        first, second = divmod(pair, self.layout.n)
        if self._is_lost.sum() + 2 >= self.layout.n:
            return
        onset = int(evidence.both[:, first, second].argmax())
        since = self._clock_s - float(self._hypotheses.onset_age[onset])
        self._hypotheses.adopt_loss(onset, [first, second])
        for k in (first, second):
            self._mark(k, LOST, since, self.settings.threshold)

    def _watch_unexplained(self, evidence: Evidence, everything: float, duration: float) -> None:
        """Says so where the motion is surely not as believed, and no fault explains it."""
        is_refuted = everything > -math.log(1.0 - self.settings.threshold)
        self._unexplained_s = self._unexplained_s + duration if is_refuted else 0.0
        self._is_unknown = self._unexplained_s > UNKNOWN_WAIT_S
        onset = int(evidence.jolt.argmax())
        is_jolt = float(evidence.jolt[onset]) > everything - math.log(2.0)
        if is_jolt and self._unexplained_s > JOLT_WAIT_S:
            self._hypotheses.adopt_jolt(onset)

    def _follow_strength(self) -> None:
        """Takes weak ones for lost or whole, as their strength goes."""
        if not (self._kind == WEAK).any():
            return
        strength = self._hypotheses.strength
        gone = (strength < LOST_BELOW) & (strength + self._hypotheses.strength_std < GONE_BELOW)
        for k in np.flatnonzero((self._kind == WEAK) & gone).tolist():
            if self._is_lost.sum() < self.layout.n - 1:
                self._hypotheses.believe(k, 0.0)
                self._kind[k] = LOST
        self._kind[(self._kind == WEAK) & (strength > WEAK_BELOW)] = WHOLE

    def _mark(self, k: int, kind: int, since: float, certainty: float) -> None:
        """Notes what an actuator is taken for."""
        self._kind[k] = kind
        self._since[k] = since
        self._certainty[k] = certainty if kind != WHOLE else 0.0
        self._is_announced[k] = False
        if kind != WHOLE:
            self._last_named_s = self._clock_s
        self._certain_s = 0.0
        self._doubtful_s = 0.0
        self._probability = self._probability.copy()
        self._probability[k] = 0.0 if kind == WHOLE else 1.0


class _Odds:
    """Logarithms of odds against none, summed over all moments."""

    def __init__(self, evidence: Evidence, is_settled: bool) -> None:
        """Takes what is known of the jumps; before all has settled only one that pushes the other
        way counts."""
        self.by_kind = evidence.by_kind
        """Of each kind of each actuator (n, 5)."""
        self.pairs = evidence.of_pairs
        """Of two losses at one moment (n, n)."""
        if not is_settled:
            self.by_kind = evidence.by_kind.copy()
            self.by_kind[:, [LOST, WEAK, STUCK, WHOLE]] = -np.inf
            self.pairs = np.full_like(self.pairs, -np.inf)
        by_actuator = np.logaddexp.reduce(self.by_kind, axis=1)
        of_partners = np.logaddexp.reduce(self.pairs, axis=0)  # of each as the second of a pair
        in_pairs = np.logaddexp(of_partners, np.logaddexp.reduce(self.pairs, axis=1))
        self.with_pairs = np.logaddexp(by_actuator, in_pairs)
        """Of each actuator (n,): one that is lost with another is no less lost."""
        self.pair = float(np.logaddexp.reduce(of_partners))
        """Of any two."""
        jolt = float(np.logaddexp.reduce(evidence.jolt))
        single = float(np.logaddexp.reduce(by_actuator))
        self.without_pairs = float(np.logaddexp.reduce([0.0, single, jolt]))
        """Of anything but two at once, or nothing."""
        self.everything = float(np.logaddexp(self.without_pairs, self.pair))
        """Of anything, or nothing."""
        self.actuator = int(by_actuator.argmax())
        """The likeliest."""
        self.kind = int(self.by_kind[self.actuator].argmax())
        """What it has become, index in `KINDS`."""
        of_actuator = float(by_actuator[self.actuator])
        self.of_kind = math.exp(float(self.by_kind[self.actuator, self.kind]) - of_actuator)
        """Share of that kind in the odds of that actuator alone."""
        self.of_single = math.exp(of_actuator - float(self.with_pairs[self.actuator]))
        """Share of it alone in all its odds."""
