"""Many beliefs about one robot side by side: what is now, and each thing that may have happened to a fin.

An interacting-multiple-model filter (Blom and Bar-Shalom, IEEE Transactions on Automatic Control 33, 1988),
made simple: every belief has a state of its own, all share one covariance, and only what is believed now
feeds the others.
"""

import math

import numpy as np

from finlab.arrays import Array
from finlab.control.monitor_settings import MonitorSettings
from finlab.control.motion_model import CURRENT, FIRST_FIN, MOTION, STRENGTH, TILT, TORQUE, Step

LEVELS = (0.0, 0.35, 0.7, 1.0)
"""Strengths that a fin may suddenly have."""
APART = 0.2
"""A level this near to a fin's strength is no event."""


EXPECTED_SURPRISE, MOST_SURPRISE = 1.3, 4.0
"""Squared distance per measured number, in variances, from which the model is trusted less; and the most."""
ADAPTING = 0.03
"""How fast, per tick."""
MOST_MISFIT = 1e5
"""Most that the disturbance of the motion grows to (a variance)."""


class Hypotheses:
    """States of all beliefs (m, 12 + n), their probabilities (m,), and the covariance that they share.

    The first belief is what is taken for true. Then come, for each fin, `LEVELS` of strength, and last the
    fin's other direction: of a fin that turns, that it sticks; of a stuck one, that it turns again.
    """

    def __init__(self, n_fins: int, inertia: Array, settings: MonitorSettings) -> None:
        """Starts at rest, whole; takes the body's mass and moments (6,) with those of the water."""
        self.n_fins, self.settings = n_fins, settings
        s, size = settings, FIRST_FIN + n_fins
        self._kinds = len(LEVELS) + 1
        self.state = np.zeros((1 + n_fins * self._kinds, size))
        """States of all beliefs (m, 12 + n)."""
        self.state[:, STRENGTH] = 1.0
        variance = np.zeros(size)
        variance[MOTION] = variance[TILT] = 1e-4
        variance[CURRENT], variance[TORQUE] = s.current**2, s.torque**2
        variance[STRENGTH] = s.strength**2
        self.covariance = np.diag(variance)
        """Covariance (14 + n, 12 + n) of each."""
        noise = np.zeros(size)
        noise[:3], noise[3:6] = s.force_noise**2, s.torque_noise**2
        self._motion_noise = noise[MOTION] / inertia**2
        noise[MOTION] = 0.0
        noise[CURRENT], noise[TORQUE] = s.current_drift**2, s.torque_drift**2
        noise[STRENGTH] = s.strength_drift**2
        self._noise = noise
        self._sensors = np.array([s.velocity_noise**2] * 3 + [s.rate_noise**2] * 3 + [s.tilt_noise**2] * 2)
        self._most = np.full(n_fins, s.strength**2)
        self._fin = np.repeat(np.arange(n_fins), self._kinds)
        self._rows = np.arange(1, len(self.state))
        self._turned_rows = np.arange(n_fins) * self._kinds + self._kinds
        self._turned_strength = FIRST_FIN + np.arange(n_fins)
        self._level = np.tile([*LEVELS, np.nan], n_fins)
        self.probability: Array = np.zeros(len(self.state))
        """Probabilities (m,), sum 1."""
        self._age_s = 0.0
        self.misfit = 1.0
        """How many times as much (a variance) the motion is disturbed as the settings say, at least 1."""
        self.distance = 0.0
        """Squared distance of the last measurement from what the first belief expected, in variances."""
        self._settle()

    def _settle(self) -> None:
        """All beliefs start from the first, at their prior probabilities."""
        strength = self.state[0, STRENGTH]
        level = np.where(np.isnan(self._level), strength[self._fin], self._level)
        possible = np.isnan(self._level) | (np.abs(level - strength[self._fin]) > APART)
        self.level = level
        """Strength (m - 1,) of its fin that each belief but the first begins with."""
        self._rate = np.where(possible, self.settings.failures / self._kinds, 0.0)
        self.state[1:] = self.state[0]
        self.state[self._rows, FIRST_FIN + self._fin] = level
        prior = self._rate * self.settings.doubt_s
        self.probability[1:], self.probability[0] = prior, 1.0 - prior.sum()

    def feed(self, dt: float) -> Array:
        """What is taken for true may have ended just now; returns how much (m - 1,) of each belief is new."""
        self._age_s += dt
        if self._age_s < self.settings.settle_s:
            self._settle()
            return np.ones(len(self._rows))
        p, begins = self.probability, self._rate * dt
        kept = p[1:] * (1.0 - dt / self.settings.doubt_s)
        new = p[0] * begins
        total = kept + new
        share: Array = new / np.maximum(total, 1e-300)
        others, strength = self.state[1:], self.state[0, STRENGTH][self._fin]
        others += share[:, None] * (self.state[0] - others)
        self.state[self._rows, FIRST_FIN + self._fin] += share * (self.level - strength)
        p[1:] = total
        p[0] = 1.0 - total.sum()
        return share

    def of_turned(self, values: Array) -> Array:
        """Of values (m - 1,) those (n,) of the fins' other directions."""
        return values[self._turned_rows - 1]

    def spread(self, by_fin: Array) -> Array:
        """Logarithms (m,) for whole robots, of those (n, 1 + kinds) for fins, their present state first."""
        as_is = by_fin[:, 0]
        return np.concatenate([[0.0], (by_fin[:, 1:] - as_is[:, None]).ravel()])

    def predict(self, step: Step, dt: float) -> None:
        """All beliefs over one period."""
        turned = self.state[self._turned_rows, self._turned_strength]
        self.state = (self.state - self.state[0]) @ step.transition.T + step.state
        self.state[self._turned_rows, MOTION] += turned[:, None] * step.turned
        self.covariance = step.transition @ self.covariance @ step.transition.T
        variance = self.covariance.ravel()[:: len(self._noise) + 1]
        variance += self._noise * dt
        variance[MOTION] += self._motion_noise * (self.misfit * dt)
        excess = variance[STRENGTH] / self._most
        if excess.max() > 1.0:
            scale = 1.0 / np.sqrt(np.maximum(excess, 1.0))
            self.covariance[:, STRENGTH] *= scale
            self.covariance[STRENGTH] *= scale[:, None]

    def update(self, seen: Array, slow: bool, besides: Array | None) -> None:
        """Takes velocity, rates, roll and pitch (8,); without the velocity where it is no new one.

        `besides` holds the logarithms (m,) of what else speaks for each belief.
        """
        rows = slice(3 if slow else 0, 8)
        covariance = self.covariance
        spread = covariance[rows, rows].copy()
        spread.ravel()[:: len(spread) + 1] += self._sensors[rows]
        inverse = np.linalg.inv(spread)
        gain = covariance[:, rows] @ inverse
        missed = seen[rows] - self.state[:, rows]
        distance = ((missed @ inverse) * missed).sum(axis=1)
        self.distance = float(distance[0])
        # Where fins are not what the model says, even the best belief is far off: trust it less.
        surprise = min(float(distance.min()) / len(spread), MOST_SURPRISE) - EXPECTED_SURPRISE
        self.misfit = min(max(self.misfit * math.exp(ADAPTING * surprise), 1.0), MOST_MISFIT)
        self.state += missed @ gain.T
        self.covariance = covariance - gain @ covariance[rows]
        likely = -0.5 * distance if besides is None else besides - 0.5 * distance
        self.probability *= np.exp(likely - likely.max())
        self.probability /= self.probability.sum()

    @property
    def of_fins(self) -> Array:
        """Probability (n, kinds) that something has happened to a fin, by what."""
        return self.probability[1:].reshape(self.n_fins, self._kinds)

    @property
    def strength(self) -> Array:
        """Strengths (n,) that are taken for true."""
        return self.state[0, STRENGTH]

    @property
    def strength_std(self) -> Array:
        """Their standard deviations (n,)."""
        return np.sqrt(self.covariance.ravel()[:: len(self._noise) + 1][STRENGTH])

    def adopt(self, fin: int, kind: int) -> None:
        """One belief is now taken for true, and all begin anew."""
        self.state[0] = self.state[1 + fin * self._kinds + kind]
        self._doubt(fin, self.settings.new_strength if 0 < kind < len(LEVELS) - 1 else self.settings.strength)

    def believe(self, fin: int, strength: float) -> None:
        """Somebody knows the strength of a fin."""
        self.state[0, FIRST_FIN + fin] = strength
        self._doubt(fin, self.settings.strength)

    def _doubt(self, fin: int, std: float) -> None:
        """The strength of a fin is known no better than that."""
        row = FIRST_FIN + fin
        self.covariance[row], self.covariance[:, row] = 0.0, 0.0
        self.covariance[row, row] = self._most[fin] = std**2
        self._settle()
