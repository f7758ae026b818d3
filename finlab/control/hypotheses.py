"""Many beliefs about one robot side by side: what is now, and each thing that may have happened to a fin.

An interacting-multiple-model filter (Blom and Bar-Shalom, IEEE Transactions on Automatic Control 33, 1988),
made simple: every belief has a state of its own, all share one covariance, and only what is believed now
feeds the others.
"""

import math

import numpy as np

from finlab.arrays import Array
from finlab.control.monitor_settings import MonitorSettings
from finlab.control.motion_model import CURRENT, FIRST_FIN, MOTION, RISING, STRENGTH, TILT, TORQUE, Step

LEVELS = (0.0, 0.35, 0.7, 1.0)
"""Strengths that a fin may suddenly have."""
LOSSES = 0.6
"""Share of all events that are losses."""
APART = 0.2
"""A level this near to a fin's strength is no event."""


EXPECTED_SURPRISE, MOST_SURPRISE = 1.0, 4.0
"""Squared distance per measured number, in variances, from which the model is trusted less; and the most."""
ADAPTING = 0.1
"""How fast, per tick."""
MOST_FREEDOM = 16.0
"""Most that the strengths, too, are given more freedom then (a variance)."""
MOST_MISFIT = 1e5
"""Most that the disturbance of the motion grows to (a variance)."""


class Hypotheses:
    """What is taken for true of n fins, and beside it m beliefs about each fin, that it has just changed.

    They are that it has come to one of `LEVELS` of strength, and, the last one, to its other direction: a fin
    that turned sticks, a stuck one turns again.
    """

    def __init__(self, n_fins: int, inertia: Array, settings: MonitorSettings) -> None:
        """Starts at rest, whole; takes the body's mass and moments (6,) with those of the water."""
        self.n_fins, self.settings = n_fins, settings
        s, size = settings, FIRST_FIN + n_fins
        self.state = np.zeros(size)
        """State z (14 + n) that is taken for true."""
        self.state[STRENGTH] = 1.0
        m = len(LEVELS) + 1
        self._rows: Array = np.zeros((1 + n_fins * m, size))
        self.off: Array = self._rows[1:].reshape(n_fins, m, size)
        """How the states of the beliefs differ from it (n, m, 14 + n)."""
        self._strengths_off: Array = np.einsum("iki->ik", self.off[:, :, STRENGTH])
        variance = np.zeros(size)
        variance[MOTION] = variance[TILT] = 1e-4
        variance[CURRENT], variance[TORQUE] = s.current**2, s.torque**2
        variance[STRENGTH] = s.strength**2
        self.covariance = np.diag(variance)
        """Covariance (14 + n, 14 + n) of each."""
        variance[RISING] = s.rising_current**2
        noise = np.zeros(size)
        noise[CURRENT], noise[TORQUE] = s.current_drift**2, s.torque_drift**2
        noise[RISING] *= (s.rising_current / s.current) ** 2
        noise[STRENGTH] = s.strength_drift**2
        motion = np.array([s.force_noise**2] * 3 + [s.torque_noise**2] * 3) / inertia**2
        self._noise, self._motion_noise = noise, motion
        self._sensors = np.diag([s.velocity_noise**2] * 3 + [s.rate_noise**2] * 3 + [s.tilt_noise**2] * 2)
        self._slow_sensors = self._sensors[3:, 3:].copy()
        self._most = np.full(n_fins, s.strength**2)
        self.probability: Array = np.zeros((n_fins, m))
        """Probability (n, m) of each belief."""
        self.doubt = 0.0
        """Their sum: how likely it is that what is taken for true is not."""
        self._age_s = 0.0
        self.misfit = 1.0
        """How many times as much (a variance) the motion is disturbed as the settings say, at least 1."""
        self.distance = 0.0
        """Squared distance of the last measurement from what was expected, in variances."""
        self._settle()

    def _settle(self) -> None:
        """All beliefs begin, at their prior probabilities."""
        jump = np.append(LEVELS, 0.0) - self.strength[:, None]
        jump[:, -1] = 0.0
        possible = np.abs(jump) > APART
        possible[:, -1] = True
        self._jump = jump
        often = np.full(jump.shape[1], (1.0 - LOSSES) / (jump.shape[1] - 1))
        often[0] = LOSSES
        self._rate = np.where(possible, self.settings.failures * often, 0.0)
        self._any = float(self._rate.sum())
        self.off[:] = 0.0
        self._strengths_off[:] = jump
        self.probability = self._rate * self.settings.doubt_s
        self.doubt = float(self.probability.sum())

    def feed(self, dt: float) -> Array:
        """What is taken for true may have ended just now; returns how much (n, m) of each belief is new."""
        self._age_s += dt
        if not self.settled:
            self._settle()
            return np.ones_like(self.probability)
        fresh, kept = dt * (1.0 - self.doubt), 1.0 - dt / self.settings.doubt_s
        new = self._rate * fresh
        self.probability *= kept
        self.probability += new
        self.doubt = self.doubt * kept + self._any * fresh
        share: Array = new / np.maximum(self.probability, 1e-300)
        self.off *= (1.0 - share)[:, :, None]
        self._strengths_off += share * self._jump
        return share

    def predict(self, step: Step, dt: float) -> None:
        """All beliefs over one period."""
        turned = self.strength + self._strengths_off[:, -1]
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

    def update(self, seen: Array, slow: bool, besides: Array | None) -> None:
        """Takes velocity, rates, roll and pitch (8,); without the velocity where it is no new one.

        `besides` holds the logarithms (n, m) of what else speaks for each belief.
        """
        rows, sensors = (slice(3, 8), self._slow_sensors) if slow else (slice(0, 8), self._sensors)
        seen_by = self.covariance[rows]
        inverse = np.linalg.inv(seen_by[:, rows] + sensors)
        missed = (seen - self.state[:8])[rows] - self._rows[:, rows]  # the first is of what is taken for true
        weighted = missed @ inverse
        distance = np.einsum("ij,ij->i", weighted, missed)
        # The built-in functions are quicker than numpy's for so few numbers.
        distances = distance.tolist()
        self.distance, least = distances[0], min(distances)
        # Where fins are not what the model says, even the best belief is far off: trust it less.
        surprise = min(least / len(inverse), MOST_SURPRISE) - EXPECTED_SURPRISE
        self.misfit = min(max(self.misfit * math.exp(ADAPTING * surprise), 1.0), MOST_MISFIT)
        correction = weighted @ seen_by
        self.state = self.state + correction[0]
        correction -= correction[0]
        self._rows += correction
        left = self.covariance - seen_by.T @ (inverse @ seen_by)
        self.covariance = 0.5 * (left + left.T)  # what rounding makes uneven would grow
        better = (0.5 * (self.distance - distance[1:])).reshape(self.probability.shape)
        if besides is not None:
            better += besides
        best = max(0.0, *better.ravel().tolist())
        weight = self.probability * np.exp(better - best)
        total = sum(weight.ravel().tolist())
        whole = total + (1.0 - self.doubt) * math.exp(-best)
        self.probability, self.doubt = weight / whole, total / whole

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
        std: Array = np.sqrt(self.covariance.ravel()[:: len(self.state) + 1][STRENGTH])
        return std

    def adopt(self, fin: int, kind: int) -> None:
        """One belief is now taken for true, and all begin anew."""
        self.state = self.state + self.off[fin, kind]
        self._doubt(fin, self.settings.new_strength if 0 < kind < len(LEVELS) - 1 else self.settings.strength)

    def believe(self, fin: int, strength: float) -> None:
        """Somebody knows the strength of a fin."""
        self.state[FIRST_FIN + fin] = strength
        self._doubt(fin, self.settings.strength)

    def _doubt(self, fin: int, std: float) -> None:
        """The strength of a fin is known no better than that."""
        row = FIRST_FIN + fin
        self.covariance[row], self.covariance[:, row] = 0.0, 0.0
        self.covariance[row, row] = self._most[fin] = std**2
        self._settle()
