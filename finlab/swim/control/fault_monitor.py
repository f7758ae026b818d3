"""Notices fins that are torn, lost or stuck, from how the robot moves, and takes repaired ones
back."""

import math
from typing import NamedTuple

import numpy as np

from finlab.allocation.rates import Rates
from finlab.arrays import Array
from finlab.axes import TURN
from finlab.layout import Layout
from finlab.layout.damage import Damage
from finlab.physics import plant_of
from finlab.swim.control.contract import Measurement
from finlab.swim.control.hypotheses import LEVELS, OPPOSED, Hypotheses, MonitorSettings
from finlab.swim.control.motion_model import MotionModel
from finlab.swim.control.probe import Probe

LOST_BELOW = 0.2
"""A strength below which a fin is given up as lost."""
OPPOSED_BELOW, OPPOSED_SURE = -0.3, 3.0
"""A strength below which an actuator pushes the other way than the layout says, and standard
deviations by which it lies below 0."""
WHOLE_ABOVE = 0.9
"""A strength from which a fin that was torn is whole again."""
HOLD_S = 0.2
"""A belief is acted on once it has been certain for so long [s]: a single odd sample decides
nothing."""
HOLD_EARLY_S = 0.5
"""The same before current and trim are learned, when only what pushes the other way is acted on
[s]."""
ASTRAY = 1e4
"""A misfit of the motion, a variance over that of the settings, from which on nothing can be told
of it."""
COARSE = 0.05
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
        self._beliefs = Hypotheses(layout.n, self._model.inertia, self.settings)
        self._probe = Probe(layout, self.settings, self.period_s)
        n = layout.n
        self._torn, self._lost, self._told, self._back, self._coming_back = np.zeros(
            (5, n), dtype=bool
        )
        self._rates = Rates(plant_of(layout), layout.rates * self.period_s)
        self._sent = np.full((n, 3), np.nan)
        self._suspect = 0
        self._sure = 0
        self._held = np.full(n, np.nan)
        self._since = self._model.motion.direction.copy()
        self._coarse = np.ones(n)
        self._tables = [fin for fin in layout.fins if fin.model.type == "table"]
        self._velocity: Array | None = None

    @property
    def opposed(self) -> tuple[str, ...]:
        """Names of those that push the other way than the layout says; the allocator does without
        them until the layout is put right."""
        return tuple(self.layout.names[k] for k in np.flatnonzero(self._back))

    @property
    def tells(self) -> bool:
        """Whether losses would show: not where the robot moves far otherwise than its model
        says."""
        return self._beliefs.misfit < ASTRAY

    def step(self, measurement: Measurement, command: Array | None) -> Diagnosis:
        """Takes what has been measured and says what is believed.

        Args:
            measurement: of now. A velocity counts as new where its array is another one than last
            time.
            command: (n, 3) [rad, Hz, rad] in force since the last call, NaN for fins at rest; None
                before the first.
        """
        beliefs = self._beliefs
        m = measurement
        seen = np.array([*m.velocity.tolist(), *m.rates.tolist(), m.roll, m.pitch])
        last = self._velocity
        self._velocity = m.velocity
        if last is None or command is None:
            beliefs.state[:8] = seen
            return self.verdict()
        other = self._other_direction(beliefs.feed(self.period_s))
        step = self._model.step(beliefs.state, m.yaw, command, self._held, other)
        beliefs.predict(step, self.period_s)
        beliefs.update(seen, m.velocity is last)
        self._judge(other)
        return self.verdict()

    def tell(self, name: str, strength: float = 1.0, stuck: float = math.nan) -> Diagnosis:
        """The state of a fin is known: its strength, and where it is stuck [rad] if it is.

        A fin that is said to be lost is left alone until another state is said: no probe moves it.
        Raises LayoutError: there is no fin of that name."""
        fin = self.layout.index(name)
        self._beliefs.believe(fin, strength)
        self._mark(fin, strength, stuck)
        self._told[fin] = self._lost[fin]
        return self.verdict()

    def adopt(self, layout: Layout) -> None:
        """Takes the robot for another one with the same body: what is not lost is as that layout
        says."""
        self.layout = layout
        self._model.adopt(layout)
        self._rates = Rates(plant_of(layout), layout.rates * self.period_s)
        self._torn[:] = False
        self._lost &= ~self._back
        self._back[:] = False
        for k in np.flatnonzero(~self._lost):
            self._beliefs.believe(int(k), 1.0)

    def probed(self, command: Array) -> Array:
        """The command (n, 3) with what keeps the fins known.

        Now and then a fin that the monitor has called lost beats for two seconds: if it gives
        nothing by it, it is lost, and of one that has been repaired the robot feels it, and takes
        it back. Fins that all but rest push a little, see `MonitorSettings.least_push`. Both change
        no faster than the rates of the drives allow from what was returned last, as does the way
        back to what is commanded.
        """
        lost = self._lost & ~self._told
        direction = self._model.motion.direction
        wanted = self._probe.added(command, lost, direction)
        own = (np.isfinite(wanted[:, :1]) & ~(wanted == command)).any(axis=1) | self._coming_back
        rests = np.isnan(self._sent[:, :1])
        box = self._rates.box(np.where(rests, self._model.motion.command, self._sent))
        result = np.where(own[:, None], box.clip(wanted), wanted)
        self._coming_back = (np.isfinite(result) & ~(result == command)).any(axis=1)
        self._sent = result
        return result

    def verdict(self) -> Diagnosis:
        """What is believed now."""
        beliefs = self._beliefs
        strength = beliefs.strength.copy()
        by_kind = beliefs.probability
        probability = beliefs.changed
        stuck = ~np.isnan(self._held)
        damage = Damage()
        broken = self._lost | self._torn | stuck
        if True in broken.tolist():
            # The last but one belief is a whole fin, the last one of a stuck fin that it turns
            # again.
            works = by_kind[:, -2] + np.where(stuck, by_kind[:, -1], 0.0)
            probability = np.where(broken, 1.0 - works, probability)
            damage = self._damage(strength)
        return Diagnosis(damage, probability, strength, beliefs.strength_std)

    def _damage(self, strength: Array) -> Damage:
        """What an allocator should know; a table's thrust cannot be scaled."""
        names = self.layout.names
        parts = self.layout.actuators
        far = np.abs(strength - self._coarse) > 0.75 * COARSE
        steps = np.clip(np.round(strength / COARSE), 1, round(1 / COARSE)) * COARSE
        self._coarse = np.where(far, steps, self._coarse)
        torn = [k for k in np.flatnonzero(self._torn) if parts[k] not in self._tables]
        stuck = np.flatnonzero(~np.isnan(self._held) & ~self._lost)
        return Damage.known(
            self.layout,
            [names[k] for k in np.flatnonzero(self._lost)],
            {names[k]: float(self._coarse[k]) for k in torn},
            {names[k]: float(self._held[k]) for k in stuck},
        )

    def _other_direction(self, fresh: Array) -> Array:
        """Where actuators (n,) are by the beliefs that they stick: where they were when it may have
        begun."""
        turn = self._model.motion.direction - self._since
        turn -= TURN * np.round(turn / TURN) * self._model.motion.angles
        self._since += fresh[:, -1] * turn
        return np.where(np.isnan(self._held), self._since, np.nan)

    def _judge(self, other: Array) -> None:
        """Acts on what has become all but certain."""
        beliefs = self._beliefs
        strength = beliefs.strength
        back = (
            (strength < OPPOSED_BELOW)
            & (strength < -OPPOSED_SURE * beliefs.strength_std)
            & ~self._back
        )
        if back.any() and (self._lost | back).sum() < self.layout.n:
            for each in np.flatnonzero(back):
                self._mark(int(each), -1.0, math.nan)
        if True in self._torn.tolist():
            strength = beliefs.strength
            gone = self._torn & (strength < LOST_BELOW)
            if gone.any() and (self._lost | gone).sum() < self.layout.n:
                self._lost |= gone
                self._torn &= ~gone
                for index in np.flatnonzero(gone):
                    beliefs.believe(int(index), 0.0)
            self._torn &= strength < WHOLE_ABOVE
        if beliefs.doubt < self.settings.threshold:
            self._sure = 0
            return
        by_kind = beliefs.probability
        total = beliefs.changed if beliefs.settled else by_kind[:, OPPOSED]
        fin = int(total.argmax())
        sure = float(total[fin]) >= self.settings.threshold
        self._sure = (self._sure + 1 if fin == self._suspect else 1) if sure else 0
        self._suspect = fin
        if self._sure * self.period_s < (HOLD_S if beliefs.settled else HOLD_EARLY_S) - 1e-9:
            return
        kind = int(by_kind[fin].argmax())
        both = np.where((beliefs.pairs == fin).any(axis=1), beliefs.both, 0.0)
        if self._lost.sum() + 2 < self.layout.n and both.max() > by_kind[fin, kind]:
            pair = int(both.argmax())
            beliefs.adopt_both(pair)
            for fin in beliefs.pairs[pair].tolist():
                self._told[fin] = False
                self._mark(fin, 0.0, math.nan)
            return
        turned = kind == len(LEVELS)
        level = float(beliefs.strength[fin]) if turned else LEVELS[kind]
        if level < LOST_BELOW and self._lost.sum() == self.layout.n - 1:
            return  # the last one that works
        beliefs.adopt(fin, kind)
        self._told[fin] = False
        self._mark(fin, level, float(other[fin]) if turned else float(self._held[fin]))

    def _mark(self, fin: int, strength: float, stuck: float) -> None:
        self._lost[fin] = strength < LOST_BELOW
        self._back[fin] = strength < OPPOSED_BELOW
        self._torn[fin] = LOST_BELOW <= strength < WHOLE_ABOVE
        self._held[fin] = stuck if strength >= LOST_BELOW else math.nan
