"""Many beliefs about one robot side by side: what is now, and each thing that may have happened to
a fin.

An interacting-multiple-model filter (Blom and Bar-Shalom, IEEE Transactions on Automatic Control
33, 1988), made simple: every belief has a state of its own, all share one covariance, and only what
is believed now feeds the others.
"""

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from finlab.arrays import Array
from finlab.swim.control.motion_model import (
    CURRENT,
    FIRST_FIN,
    MOTION,
    RISING,
    STRENGTH,
    TILT,
    TORQUE,
    Step,
)

LEVELS = (0.0, -1.0, 0.35, 0.7, 1.0)
"""Strengths that a fin may suddenly have; a motor that is wired wrongly has -1."""
OPPOSED = 1
"""Place of that last one, of which there is evidence from the start."""
LOSSES = 0.6
"""Share of all events that are losses."""
TOGETHER = 0.1
"""How often two given fins are lost at one moment (a cable, a collision), as a share of how often
one is."""
APART = 0.2
"""A level this near to a fin's strength is no event."""
EXPECTED_SURPRISE, MOST_SURPRISE = 1.0, 4.0
"""Squared distance per measured number, in variances, from which the model is trusted less; and the
most."""
ADAPTING = 0.1
"""How fast, per tick."""
MOST_FREEDOM = 16.0
"""Most that the strengths, too, are given more freedom then (a variance)."""
MOST_MISFIT = 1e5
"""Most that the disturbance of the motion grows to (a variance)."""
ASTRAY, MOST_VARIANCE = 1e6, 100.0
"""Squared distance of a measurement, in variances, and variance of a velocity [m^2/s^2, rad^2/s^2],
beyond which the model says nothing of the motion, as of a robot that tumbles."""


@dataclass(frozen=True)
class MonitorSettings:
    """What a `FaultMonitor` takes for granted. Standard deviations, and rates per second."""

    rate_noise: float = 0.01
    """Of a measured angular rate [rad/s]."""
    velocity_noise: float = 0.01
    """Of a measured velocity [m/s]."""
    tilt_noise: float = 0.01
    """Of measured roll and pitch [rad]."""
    force_noise: float = 0.05
    """Of a force that the model does not know [N], per root of a second."""
    torque_noise: float = 0.005
    """Of such a torque [N m], per root of a second."""
    current: float = 0.05
    """Of the current that is expected [m/s]."""
    current_drift: float = 0.002
    """Of its change [m/s], per root of a second."""
    rising_current: float = 0.01
    """The same of a current that rises or sinks [m/s]; its drift is as much smaller."""
    torque: float = 0.1
    """Of a torque that stays [N m]; what a tilt sensor that sits askew makes of the hull's weight
    is one."""
    torque_drift: float = 0.003
    """Of its change [N m], per root of a second."""
    strength: float = 0.05
    """Of the strength of a whole or a lost fin, and the most that is ever unknown of one that
    rests."""
    new_strength: float = 0.25
    """The same of a fin that has just been torn."""
    strength_drift: float = 0.005
    """Of its change, per root of a second."""
    failures: float = 1e-5
    """Events per fin and second that are expected."""
    doubt_s: float = 20.0
    """Time after which a suspicion that nothing feeds is given up [s]."""
    settle_s: float = 6.0
    """Time at the start in which current and trim are learnt and nothing is suspected [s]."""
    probe_every_s: float = 20.0
    """Time after which a fin that is taken for lost is tried again [s]; 0 for never."""
    least_push: float = 0.5
    """Force [N] that every fin gives at least, up or down where it would rest, so that its loss
    shows; 0 for none. Costs power, where fins would rest."""
    threshold: float = 0.97
    """Probability of a fin's failure from which it is acted on, if it holds for two tenths of a
    second."""


class Hypotheses:
    """What is taken for true of n fins, and beside it m beliefs about each fin, that it has just
    changed, and one about each pair of fins, that both were lost at one moment.

    Those about a fin are that it has come to one of `LEVELS` of strength, and, the last one, to its
    other direction: a fin that turned sticks, a stuck one turns again.
    """

    def __init__(self, n_fins: int, inertia: Array, settings: MonitorSettings) -> None:
        """Starts at rest, whole; takes the body's mass and moments (6,) with those of the water."""
        self.n_fins = n_fins
        self.settings = settings
        s = settings
        size = FIRST_FIN + n_fins
        self.state = np.zeros(size)
        """State z (14 + n) that is taken for true."""
        self.state[STRENGTH] = 1.0
        m = len(LEVELS) + 1
        self.pairs = np.array([*combinations(range(n_fins), 2)], dtype=int).reshape(-1, 2)
        """Fins (p, 2) that may be lost at one moment."""
        self._rows: Array = np.zeros((1 + n_fins * m + len(self.pairs), size))
        self._off: Array = self._rows[1:]
        self.off: Array = self._of_fins(self._off)
        """How the states of the beliefs about one fin differ from it (n, m, 14 + n)."""
        self.both_off: Array = self._of_pairs(self._off)
        """The same of those about two (p, 14 + n)."""
        self._turned_off: Array = np.einsum("ii->i", self.off[:, -1, STRENGTH])
        variance = np.zeros(size)
        variance[MOTION] = variance[TILT] = 1e-4
        variance[CURRENT] = s.current**2
        variance[TORQUE] = s.torque**2
        variance[STRENGTH] = s.strength**2
        self._first = np.diag(variance)
        self.covariance = self._first.copy()
        """Covariance (14 + n, 14 + n) of each."""
        noise = np.zeros(size)
        noise[CURRENT] = s.current_drift**2
        noise[TORQUE] = s.torque_drift**2
        noise[RISING] *= (s.rising_current / s.current) ** 2
        noise[STRENGTH] = s.strength_drift**2
        motion = np.array([s.force_noise**2] * 3 + [s.torque_noise**2] * 3) / inertia**2
        self._noise = noise
        self._motion_noise = motion
        self._sensors = np.diag(
            [s.velocity_noise**2] * 3 + [s.rate_noise**2] * 3 + [s.tilt_noise**2] * 2
        )
        self._slow_sensors = self._sensors[3:, 3:].copy()
        self._most = np.full(n_fins, s.strength**2)
        self._probability: Array = np.zeros(len(self._off))
        self.doubt = 0.0
        """Their sum: how likely it is that what is taken for true is not."""
        self._age_s = 0.0
        self.misfit = 1.0
        """How many times as much (a variance) the motion is disturbed as the settings say, at least
        1."""
        self.distance = 0.0
        """Squared distance of the last measurement from what was expected, in variances."""
        self._settle()

    def _settle(self) -> None:
        """All beliefs begin, at their prior probabilities."""
        pairs = self.pairs
        m = len(LEVELS) + 1
        level = np.append(LEVELS, 0.0) - self.strength[:, None]
        level[:, -1] = 0.0
        possible = np.abs(level) > APART
        possible[:, -1] = True
        possible[self.strength < -APART, 0] = False  # one that pushes back is not lost by resting
        often = np.full(m, (1.0 - LOSSES) / (m - 1))
        often[0] = LOSSES
        single = np.where(possible, self.settings.failures * often, 0.0)
        both = np.where(
            possible[pairs, 0].all(axis=1), self.settings.failures * LOSSES * TOGETHER, 0.0
        )
        self._rate = np.append(single.ravel(), both)
        self._jump: Array = np.zeros((len(self._off), self.n_fins))
        """How the strengths (n,) of the beliefs begin to differ."""
        np.einsum("iki->ik", self._of_fins(self._jump))[:] = level
        np.put_along_axis(self._of_pairs(self._jump), pairs, level[pairs, 0], axis=1)
        self._any = float(self._rate.sum())
        self._off[:] = 0.0
        self._off[:, STRENGTH] = self._jump
        self._probability = self._rate * self.settings.doubt_s
        self.doubt = float(self._probability.sum())

    def _begin_anew(self, seen: Array) -> None:
        """Of the motion only what is measured (8,) is known; what has been learned of strengths
        stays."""
        self.state[:8] = seen
        self.state[CURRENT] = 0.0
        self.state[TORQUE] = 0.0
        self.covariance = self._first.copy()
        self._age_s = 0.0
        self.misfit = 1.0
        self.distance = 0.0
        self._settle()

    def _of_fins(self, values: Array) -> Array:
        """The part (n, m, ...) that is about single fins of what there is for each belief (n m + p,
        ...)."""
        return values[: len(values) - len(self.pairs)].reshape(self.n_fins, -1, *values.shape[1:])

    def _of_pairs(self, values: Array) -> Array:
        """The part (p, ...) that is about pairs."""
        return values[len(values) - len(self.pairs) :]

    @property
    def probability(self) -> Array:
        """Probability (n, m) of each belief about a fin."""
        return self._of_fins(self._probability)

    @property
    def both(self) -> Array:
        """Probability (p,) of each belief that two fins are lost."""
        return self._of_pairs(self._probability)

    @property
    def changed(self) -> Array:
        """Probability (n,) that something has happened to a fin, alone or with another."""
        total: Array = self.probability.sum(axis=1)
        np.add.at(total, self.pairs, self.both[:, None])
        return total

    def feed(self, dt: float) -> Array:
        """What is taken for true may have ended just now; returns how much (n, m) of each belief is
        new."""
        self._age_s += dt
        if not self.settled:
            opposed = self.off[:, OPPOSED].copy()
            likely = self.probability[:, OPPOSED].copy()
            self._settle()
            self.off[:, OPPOSED] = opposed
            self.probability[:, OPPOSED] = likely
            self.doubt = float(self._probability.sum())
            return np.ones_like(self.probability)
        fresh = dt * (1.0 - self.doubt)
        kept = 1.0 - dt / self.settings.doubt_s
        new = self._rate * fresh
        self._probability *= kept
        self._probability += new
        self.doubt = self.doubt * kept + self._any * fresh
        share: Array = new / np.maximum(self._probability, 1e-300)
        self._off *= (1.0 - share)[:, None]
        self._off[:, STRENGTH] += share[:, None] * self._jump
        return self._of_fins(share)

    def predict(self, step: Step, dt: float) -> None:
        """All beliefs over one period."""
        turned = self.strength + self._turned_off
        forward = step.transition.T
        self.state = step.state
        self._rows[:] = self._rows @ forward
        self.off[:, -1, MOTION] += turned[:, None] * step.turned
        self.covariance = step.transition @ self.covariance @ forward
        if step.noise is not None:
            self.covariance[MOTION, MOTION] += step.noise
        variance = self.covariance.ravel()[:: len(self.state) + 1]
        variance += self._noise * (dt * min(self.misfit, MOST_FREEDOM))
        variance[MOTION] += self._motion_noise * (self.misfit * dt)
        most = self._most * min(self.misfit, MOST_FREEDOM)
        if True in (variance[STRENGTH] > most).tolist():
            scale = np.sqrt(np.minimum(most / variance[STRENGTH], 1.0))
            self.covariance[:, STRENGTH] *= scale
            self.covariance[STRENGTH] *= scale[:, None]

    def update(self, seen: Array, slow: bool) -> None:
        """Takes velocity, rates, roll and pitch (8,); without the velocity where it is no new one.

        Where the model says nothing of the motion any more, or what it says is no number, all
        hypotheses are initialized again.
        """
        if not max(self.covariance.diagonal()[MOTION].tolist()) < MOST_VARIANCE:
            return self._begin_anew(seen)
        rows, sensors = (slice(3, 8), self._slow_sensors) if slow else (slice(0, 8), self._sensors)
        seen_by = self.covariance[rows]
        inverse = np.linalg.inv(seen_by[:, rows] + sensors)
        missed = (seen - self.state[:8])[rows] - self._rows[
            :, rows
        ]  # the first is of what is taken for true
        weighted = missed @ inverse
        distance = np.einsum("ij,ij->i", weighted, missed)
        # The built-in functions are quicker than numpy's for so few numbers.
        distances = distance.tolist()
        if not distances[0] < ASTRAY:
            return self._begin_anew(seen)
        self.distance = distances[0]
        least = min(distances)
        # Where fins are not what the model says, even the best belief is far off: trust it less.
        surprise = min(least / len(inverse), MOST_SURPRISE) - EXPECTED_SURPRISE
        self.misfit = min(max(self.misfit * math.exp(ADAPTING * surprise), 1.0), MOST_MISFIT)
        correction = weighted @ seen_by
        self.state = self.state + correction[0]
        correction -= correction[0]
        self._rows += correction
        left = self.covariance - seen_by.T @ (inverse @ seen_by)
        self.covariance = 0.5 * (left + left.T)  # what rounding makes uneven would grow
        better = 0.5 * (self.distance - distance[1:])
        best = max(0.0, *better.tolist())
        weight = self._probability * np.exp(better - best)
        total = sum(weight.tolist())
        every = total + (1.0 - self.doubt) * math.exp(-best)
        self._probability = weight / every
        self.doubt = total / every

    @property
    def settled(self) -> bool:
        """Whether there was time to learn current and trim, so that beliefs count."""
        return self._age_s >= self.settings.settle_s

    @property
    def strength(self) -> Array:
        """Strengths (n,) that are taken for true."""
        return self.state[STRENGTH]

    @property
    def strength_std(self) -> Array:
        """Their standard deviations (n,)."""
        return np.asarray(np.sqrt(self.covariance.ravel()[:: len(self.state) + 1][STRENGTH]))

    def adopt(self, fin: int, kind: int) -> None:
        """One hypothesis is now taken for true, and all are initialized again."""
        self.state = self.state + self.off[fin, kind]
        self._doubt(
            fin,
            self.settings.new_strength if 0 < kind < len(LEVELS) - 1 else self.settings.strength,
        )

    def adopt_both(self, pair: int) -> None:
        """Two fins are now taken for lost, and all hypotheses are initialized again."""
        self.state = self.state + self.both_off[pair]
        for fin in self.pairs[pair].tolist():
            self._doubt(fin, self.settings.strength)

    def believe(self, fin: int, strength: float) -> None:
        """The strength of a fin is known."""
        self.state[FIRST_FIN + fin] = strength
        self._doubt(fin, self.settings.strength)

    def _doubt(self, fin: int, std: float) -> None:
        """The strength of a fin is known no better than that."""
        row = FIRST_FIN + fin
        self.covariance[row] = 0.0
        self.covariance[:, row] = 0.0
        self.covariance[row, row] = self._most[fin] = std**2
        self._settle()
