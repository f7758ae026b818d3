"""Notices fins that are torn, lost or stuck, from how the robot moves, and takes repaired ones
back.

`Hypotheses` says how likely each fault is; here is decided which of them to act on, and what the
allocator is told.
"""

import math
from typing import NamedTuple

import numpy as np

from finlab.allocation.rates import Rates
from finlab.arrays import Array
from finlab.axes import TURN
from finlab.layout import Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from finlab.physics import plant_of
from finlab.swim.control.contract import Measurement
from finlab.swim.control.hypotheses import LEVELS, OPPOSED, Hypotheses, MonitorSettings
from finlab.swim.control.motion_model import MotionModel
from finlab.swim.control.probe import Probe

LOST_BELOW = 0.2
"""A strength below which a fin is given up as lost."""
OPPOSED_BELOW = -0.3
"""A strength below which an actuator pushes the other way than the layout says."""
OPPOSED_DEVIATIONS = 3.0
"""Standard deviations by which it then lies below 0, too."""
WHOLE_ABOVE = 0.9
"""A strength from which a fin that was torn is whole again."""
CONFIRM_S = 0.2
"""A belief is acted on once it has been certain for so long [s]: a single odd sample decides
nothing."""
CONFIRM_EARLY_S = 0.5
"""The same before current and trim are learned, when only what pushes the other way is acted on
[s]."""
MODEL_MISFIT_MAX = 1e4
"""A misfit of the motion, a variance over that of the settings, from which on nothing can be told
of it."""
STRENGTH_STEP = 0.05
"""The allocator is given strengths in steps of this size, so that its problem is the same for many
ticks."""


class Diagnosis(NamedTuple):
    """What a monitor believes of n fins."""

    damage: Damage
    """The actuators that are lost, torn or stuck, for an allocator: `allocate(...,
    damage=damage)`."""
    probability: Array
    """Of each fin not being whole (n,), 0 to 1."""
    strength: Array
    """Share of its law's thrust that each fin gives (n,)."""
    strength_std: Array
    """Standard deviation of that share (n,)."""


class FaultMonitor:
    """Watches one robot; to be called at a fixed rate, before the allocator.

        monitor = FaultMonitor(layout)
        while swimming:
            verdict = monitor.step(measurement, command)  # the command that was in force until now
            answer = allocator.allocate(wrench, damage=verdict.damage)
            command = monitor.probed(answer.command)

    A fin that rests cannot be distinguished from one that is lost: its probability stays where it
    was.
    """

    period_s = 0.1
    """Time between calls [s]."""

    def __init__(self, layout: Layout, settings: MonitorSettings | None = None) -> None:
        """Believes that all fins of a layout are whole, with a noise and expectations."""
        self.layout = layout
        self.settings = MonitorSettings() if settings is None else settings
        self._model = MotionModel(layout, self.period_s)
        self._hypotheses = Hypotheses(layout.n, self._model.inertia, self.settings)
        self._probe = Probe(layout, self.settings, self.period_s)
        n = layout.n
        self._is_torn = np.zeros(n, dtype=bool)
        self._is_lost = np.zeros(n, dtype=bool)
        self._is_announced = np.zeros(n, dtype=bool)  # lost by what was said, and left alone
        self._is_opposed = np.zeros(n, dtype=bool)
        self._is_returning = np.zeros(n, dtype=bool)  # from a probe to what is commanded
        self._rates = Rates(plant_of(layout), layout.rates * self.period_s)
        self._sent = np.full((n, 3), np.nan)
        self._suspect = 0
        """The fin that is likeliest to have changed, index."""
        self._n_certain = 0
        """Ticks for which that has been all but certain."""
        self._stuck_at = np.full(n, np.nan)
        self._direction_at_event = self._model.motion.direction.copy()
        self._reported_strength = np.ones(n)
        self._told_faults: tuple[list[str], dict[str, float], dict[str, float]] = ([], {}, {})
        self._told_damage = NO_DAMAGE
        self._tables = [fin for fin in layout.fins if fin.model.type == "table"]
        self._velocity: Array | None = None

    @property
    def opposed(self) -> tuple[str, ...]:
        """Names of those that push the other way than the layout says; the allocator does without
        them until the layout is put right."""
        return tuple(self.layout.names[k] for k in np.flatnonzero(self._is_opposed))

    @property
    def tells(self) -> bool:
        """Whether losses would show: not where the robot moves far otherwise than its model
        says."""
        return self._hypotheses.misfit < MODEL_MISFIT_MAX

    def step(self, measurement: Measurement, command: Array | None) -> Diagnosis:
        """Takes what has been measured and says what is believed.

        Args:
            measurement: of now. A velocity counts as new where its array is another one than last
            time.
            command: (n, 3) [rad, Hz, rad] in force since the last call, NaN for fins at rest; None
                before the first.
        """
        hypotheses = self._hypotheses
        m = measurement
        measured = np.array([*m.velocity.tolist(), *m.rates.tolist(), m.roll, m.pitch])
        velocity_before = self._velocity
        self._velocity = m.velocity
        if velocity_before is None or command is None:
            hypotheses.state[:8] = measured
            return self.verdict()
        other = self._other_direction(hypotheses.mix(self.period_s))
        step = self._model.step(hypotheses.state, m.yaw, command, self._stuck_at, other)
        hypotheses.predict(step, self.period_s)
        hypotheses.update(measured, m.velocity is velocity_before)
        self._decide(other)
        return self.verdict()

    def tell(self, name: str, strength: float = 1.0, stuck: float = math.nan) -> Diagnosis:
        """The state of a fin is known: its strength, and where it is stuck [rad] if it is.

        A fin that is said to be lost is left alone until another state is said: no probe moves it.
        Raises LayoutError: there is no fin of that name."""
        fin = self.layout.index(name)
        self._hypotheses.believe(fin, strength)
        self._mark(fin, strength, stuck)
        self._is_announced[fin] = self._is_lost[fin]
        return self.verdict()

    def adopt(self, layout: Layout) -> None:
        """Takes the robot for another one with the same body: what is not lost is as that layout
        says."""
        self.layout = layout
        self._model.adopt(layout)
        self._rates = Rates(plant_of(layout), layout.rates * self.period_s)
        self._is_torn[:] = False
        self._is_lost &= ~self._is_opposed
        self._is_opposed[:] = False
        for k in np.flatnonzero(~self._is_lost):
            self._hypotheses.believe(int(k), 1.0)

    def probed(self, command: Array) -> Array:
        """The command (n, 3) with what keeps the fins known.

        Now and then a fin that the monitor has called lost beats for two seconds: if it gives
        nothing by it, it is lost, and of one that has been repaired the robot feels it, and takes
        it back. Fins that all but rest push a little, see `MonitorSettings.least_push`. Both change
        no faster than the rates of the drives allow from what was returned last, as does the way
        back to what is commanded.
        """
        lost = self._is_lost & ~self._is_announced
        direction = self._model.motion.direction
        probed = self._probe.added(command, lost, direction)
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
        by_kind = hypotheses.probability
        probability = hypotheses.changed
        stuck = ~np.isnan(self._stuck_at)
        damage = NO_DAMAGE
        broken = self._is_lost | self._is_torn | stuck
        if True in broken.tolist():
            # The last but one hypothesis is a whole fin, the last one of a stuck fin that it turns
            # again.
            works = by_kind[:, -2] + np.where(stuck, by_kind[:, -1], 0.0)
            probability = np.where(broken, 1.0 - works, probability)
            damage = self._damage(strength)
        return Diagnosis(damage, probability, strength, hypotheses.strength_std)

    def _damage(self, strength: Array) -> Damage:
        """What an allocator should know; a table's thrust cannot be scaled."""
        names = self.layout.names
        parts = self.layout.actuators
        is_far = np.abs(strength - self._reported_strength) > 0.75 * STRENGTH_STEP
        rounded = (
            np.clip(np.round(strength / STRENGTH_STEP), 1, round(1 / STRENGTH_STEP)) * STRENGTH_STEP
        )
        self._reported_strength = np.where(is_far, rounded, self._reported_strength)
        torn = [k for k in np.flatnonzero(self._is_torn) if parts[k] not in self._tables]
        stuck = np.flatnonzero(~np.isnan(self._stuck_at) & ~self._is_lost)
        faults = (
            [names[k] for k in np.flatnonzero(self._is_lost)],
            {names[k]: float(self._reported_strength[k]) for k in torn},
            {names[k]: float(self._stuck_at[k]) for k in stuck},
        )
        # The same damage for as long as nothing changes: making one takes time.
        if faults != self._told_faults:
            self._told_faults = faults
            self._told_damage = Damage.representing(self.layout, *faults)
        return self._told_damage

    def _other_direction(self, new_share: Array) -> Array:
        """Where actuators (n,) are by the hypotheses that they stick: where they were when it may
        have begun.

        Args:
            new_share: how much of each hypothesis about a fin is new (n, m).
        """
        turn = self._model.motion.direction - self._direction_at_event
        turn -= TURN * np.round(turn / TURN) * self._model.motion.angles
        self._direction_at_event += new_share[:, -1] * turn
        return np.where(np.isnan(self._stuck_at), self._direction_at_event, np.nan)

    def _decide(self, other: Array) -> None:
        """Acts on what has become all but certain.

        Args:
            other: where actuators (n,) stick by the hypotheses that they do, see
                `_other_direction`.
        """
        hypotheses = self._hypotheses
        self._mark_opposed()
        self._follow_torn()
        if hypotheses.doubt < self.settings.threshold:
            self._n_certain = 0
            return
        by_kind = hypotheses.probability
        changed = hypotheses.changed if hypotheses.settled else by_kind[:, OPPOSED]
        fin = int(changed.argmax())
        if float(changed[fin]) < self.settings.threshold:
            self._n_certain = 0
        elif fin == self._suspect:
            self._n_certain += 1
        else:
            self._n_certain = 1
        self._suspect = fin
        confirm_s = CONFIRM_S if hypotheses.settled else CONFIRM_EARLY_S
        if self._n_certain * self.period_s < confirm_s - 1e-9:
            return
        kind = int(by_kind[fin].argmax())
        n_lost = self._is_lost.sum()
        with_fin = (hypotheses.pairs == fin).any(axis=1)
        both = np.where(with_fin, hypotheses.both, 0.0)
        if n_lost + 2 < self.layout.n and both.max() > by_kind[fin, kind]:
            pair = int(both.argmax())
            hypotheses.adopt_both(pair)
            for each in hypotheses.pairs[pair].tolist():
                self._is_announced[each] = False
                self._mark(each, 0.0, math.nan)
            return
        has_turned = kind == len(LEVELS)
        level = float(hypotheses.strength[fin]) if has_turned else LEVELS[kind]
        if level < LOST_BELOW and n_lost == self.layout.n - 1:
            return  # the last one that works
        hypotheses.adopt(fin, kind)
        self._is_announced[fin] = False
        self._mark(fin, level, float(other[fin]) if has_turned else float(self._stuck_at[fin]))

    def _mark_opposed(self) -> None:
        """Takes actuators with a negative strength for ones that push the other way."""
        strength = self._hypotheses.strength
        is_certain = strength < -OPPOSED_DEVIATIONS * self._hypotheses.strength_std
        opposed = (strength < OPPOSED_BELOW) & is_certain & ~self._is_opposed
        if opposed.any() and (self._is_lost | opposed).sum() < self.layout.n:
            for each in np.flatnonzero(opposed):
                self._mark(int(each), -1.0, math.nan)

    def _follow_torn(self) -> None:
        """Takes torn fins for lost or whole, as their strength goes."""
        if True not in self._is_torn.tolist():
            return
        strength = self._hypotheses.strength
        gone = self._is_torn & (strength < LOST_BELOW)
        if gone.any() and (self._is_lost | gone).sum() < self.layout.n:
            self._is_lost |= gone
            self._is_torn &= ~gone
            for index in np.flatnonzero(gone):
                self._hypotheses.believe(int(index), 0.0)
        self._is_torn &= strength < WHOLE_ABOVE

    def _mark(self, fin: int, strength: float, stuck: float) -> None:
        """Notes the state of a fin: its strength, and where it is stuck (NaN: it is not)."""
        self._is_lost[fin] = strength < LOST_BELOW
        self._is_opposed[fin] = strength < OPPOSED_BELOW
        self._is_torn[fin] = LOST_BELOW <= strength < WHOLE_ABOVE
        self._stuck_at[fin] = stuck if strength >= LOST_BELOW else math.nan
