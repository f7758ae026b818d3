"""Hypotheses about one robot, side by side: its present state, and each fault that may have come to
a fin.

An interacting-multiple-model filter (Blom and Bar-Shalom, IEEE Transactions on Automatic Control
33, 1988), made simple: every hypothesis has a state of its own, all share one covariance and the
gain of one Kalman filter, and only the present state, the null hypothesis, feeds the others.
`FaultMonitor` decides which of them to adopt.
"""

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from finlab.arrays import Array
from finlab.swim.control.motion_model import (
    CURRENT,
    CURRENT_UP,
    FIRST_FIN,
    MOTION,
    STRENGTH,
    TILT,
    TORQUE,
    ModelStep,
)

LEVELS = (0.0, -1.0, 0.35, 0.7, 1.0)
"""Strengths that a fin may suddenly have; a motor that is wired wrongly has -1."""
OPPOSED = 1
"""Index of the strength -1 in `LEVELS`, of which there is evidence from the start."""
LOSS_SHARE = 0.6
"""Share of all events that are losses."""
PAIR_SHARE = 0.1
"""How often two given fins are lost at one moment (a cable, a collision), as a share of how often
one is."""
LEVEL_DISTANCE_MIN = 0.2
"""A level this near to a fin's strength is no event."""
EXPECTED_NIS = 1.0
"""Squared innovation per measured number, in variances (normalized innovation squared), from which
on the model is trusted less."""
NIS_MAX = 4.0
"""Largest that counts: one odd measurement must not rule."""
ADAPTATION = 0.1
"""How fast the trust changes, per tick."""
STRENGTH_MISFIT_MAX = 16.0
"""Most by which the noise of the strengths grows with the misfit (a factor of the variance)."""
MISFIT_MAX = 1e5
"""Most by which the noise of the motion grows (a factor of the variance)."""
DIVERGED_DISTANCE = 1e6
"""Squared innovation, in variances, beyond which the model says nothing of the motion, as of a
robot that tumbles."""
DIVERGED_VARIANCE = 100.0
"""Variance of a velocity beyond which it says nothing [m^2/s^2, rad^2/s^2]."""


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
    """The null hypothesis, what is taken for true of n fins, and beside it the alternatives.

    There are m about each fin, that it has just changed, and one about each pair, that both were
    just lost.

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
        # Differences of the states from the null hypothesis: row 0 is its own, zeros.
        self._offsets: Array = np.zeros((1 + n_fins * m + len(self.pairs), size))
        self._alternatives: Array = self._offsets[1:]
        self.fin_offsets: Array = self._of_fins(self._alternatives)
        """How the states of the hypotheses about one fin differ from it (n, m, 14 + n); a view."""
        self.pair_offsets: Array = self._of_pairs(self._alternatives)
        """The same of those about two (p, 14 + n); a view."""
        self._turned_strength: Array = np.einsum("ii->i", self.fin_offsets[:, -1, STRENGTH])
        variance = np.zeros(size)
        variance[MOTION] = variance[TILT] = 1e-4
        variance[CURRENT] = s.current**2
        variance[TORQUE] = s.torque**2
        variance[STRENGTH] = s.strength**2
        self._covariance_at_start = np.diag(variance)
        self.covariance = self._covariance_at_start.copy()
        """P (14 + n, 14 + n), of every hypothesis."""
        noise = np.zeros(size)
        noise[CURRENT] = s.current_drift**2
        noise[TORQUE] = s.torque_drift**2
        noise[CURRENT_UP] *= (s.rising_current / s.current) ** 2
        noise[STRENGTH] = s.strength_drift**2
        wrench_variance = np.array([s.force_noise**2] * 3 + [s.torque_noise**2] * 3)
        self._noise = noise
        self._motion_noise = wrench_variance / inertia**2
        # R of velocity, rates and tilt, and of rates and tilt alone.
        self._sensor_covariance = np.diag(
            [s.velocity_noise**2] * 3 + [s.rate_noise**2] * 3 + [s.tilt_noise**2] * 2
        )
        self._covariance_without_velocity = self._sensor_covariance[3:, 3:].copy()
        self._max_variance = np.full(n_fins, s.strength**2)
        self._probability: Array = np.zeros(len(self._alternatives))
        self.doubt = 0.0
        """Sum of the alternatives' probabilities: how likely what is taken for true is not."""
        self._age_s = 0.0
        self.misfit = 1.0
        """How many times as much (a variance) the motion is disturbed as the settings say, at least
        1."""
        self.distance = 0.0
        """Squared innovation of the last measurement under the null hypothesis, in variances."""
        self._reset_alternatives()

    def _reset_alternatives(self) -> None:
        """All alternatives begin anew, at their prior probabilities."""
        pairs = self.pairs
        m = len(LEVELS) + 1  # each level, and the other direction
        level = np.append(LEVELS, 0.0) - self.strength[:, None]
        level[:, -1] = 0.0
        possible = np.abs(level) > LEVEL_DISTANCE_MIN
        possible[:, -1] = True
        possible[self.strength < -LEVEL_DISTANCE_MIN, 0] = (
            False  # one that pushes back is not lost by resting
        )
        kind_share = np.full(m, (1.0 - LOSS_SHARE) / (m - 1))
        kind_share[0] = LOSS_SHARE
        single = np.where(possible, self.settings.failures * kind_share, 0.0)
        pair_rate = self.settings.failures * LOSS_SHARE * PAIR_SHARE
        both = np.where(possible[pairs, 0].all(axis=1), pair_rate, 0.0)
        self._event_rate = np.append(single.ravel(), both)
        """Of each alternative [1/s]."""
        self._jump: Array = np.zeros((len(self._alternatives), self.n_fins))
        """How the strengths (n,) of the alternatives begin to differ."""
        np.einsum("iki->ik", self._of_fins(self._jump))[:] = level
        np.put_along_axis(self._of_pairs(self._jump), pairs, level[pairs, 0], axis=1)
        self._total_rate = float(self._event_rate.sum())
        self._alternatives[:] = 0.0
        self._alternatives[:, STRENGTH] = self._jump
        self._probability = self._event_rate * self.settings.doubt_s
        self.doubt = float(self._probability.sum())

    def _restart(self, measured: Array) -> None:
        """Of the motion only what is measured (8,) is known; what has been learned of strengths
        stays."""
        self.state[:8] = measured
        self.state[CURRENT] = 0.0
        self.state[TORQUE] = 0.0
        self.covariance = self._covariance_at_start.copy()
        self._age_s = 0.0
        self.misfit = 1.0
        self.distance = 0.0
        self._reset_alternatives()

    def _of_fins(self, values: Array) -> Array:
        """The part (n, m, ...) about single fins, of values of all alternatives (n m + p, ...)."""
        return values[: len(values) - len(self.pairs)].reshape(self.n_fins, -1, *values.shape[1:])

    def _of_pairs(self, values: Array) -> Array:
        """The part (p, ...) about pairs, of values of all alternatives (n m + p, ...)."""
        return values[len(values) - len(self.pairs) :]

    @property
    def probability(self) -> Array:
        """Probability (n, m) of each hypothesis about a fin."""
        return self._of_fins(self._probability)

    @property
    def both(self) -> Array:
        """Probability (p,) of each hypothesis that two fins are lost."""
        return self._of_pairs(self._probability)

    @property
    def changed(self) -> Array:
        """Probability (n,) that something has happened to a fin, alone or with another."""
        total: Array = self.probability.sum(axis=1)
        np.add.at(total, self.pairs, self.both[:, None])
        return total

    def mix(self, dt: float) -> Array:
        """The null hypothesis feeds the alternatives: an event may just have happened.

        Args:
            dt: length of the period [s].

        Returns:
            How much (n, m) of each hypothesis about a fin is new.
        """
        self._age_s += dt
        if not self.settled:
            opposed_offsets = self.fin_offsets[:, OPPOSED].copy()
            opposed_probability = self.probability[:, OPPOSED].copy()
            self._reset_alternatives()
            self.fin_offsets[:, OPPOSED] = opposed_offsets
            self.probability[:, OPPOSED] = opposed_probability
            self.doubt = float(self._probability.sum())
            return np.ones_like(self.probability)
        exposure = dt * (1.0 - self.doubt)
        forgetting = 1.0 - dt / self.settings.doubt_s
        inflow = self._event_rate * exposure
        self._probability *= forgetting
        self._probability += inflow
        self.doubt = self.doubt * forgetting + self._total_rate * exposure
        # A state is the mean of what flows in and of what was there, by their probabilities.
        new_share: Array = inflow / np.maximum(self._probability, 1e-300)
        self._alternatives *= (1.0 - new_share)[:, None]
        self._alternatives[:, STRENGTH] += new_share[:, None] * self._jump
        return self._of_fins(new_share)

    def predict(self, step: ModelStep, dt: float) -> None:
        """Carries all hypotheses on: z <- f(z), offsets <- F offsets, P <- F P F^T + Q.

        Args:
            step: f and F of the model.
            dt: length of the period [s].
        """
        strength_if_turned = self.strength + self._turned_strength
        F = step.transition
        self.state = step.state
        self._offsets[:] = self._offsets @ F.T
        self.fin_offsets[:, -1, MOTION] += strength_if_turned[:, None] * step.gain_if_turned
        self.covariance = F @ self.covariance @ F.T
        if step.turn_about_covariance is not None:
            self.covariance[MOTION, MOTION] += step.turn_about_covariance
        variance = self.covariance.ravel()[:: len(self.state) + 1]
        variance += self._noise * (dt * min(self.misfit, STRENGTH_MISFIT_MAX))
        variance[MOTION] += self._motion_noise * (self.misfit * dt)
        limit = self._max_variance * min(self.misfit, STRENGTH_MISFIT_MAX)
        if True in (variance[STRENGTH] > limit).tolist():
            scale = np.sqrt(np.minimum(limit / variance[STRENGTH], 1.0))
            self.covariance[:, STRENGTH] *= scale
            self.covariance[STRENGTH] *= scale[:, None]

    def update(self, measured: Array, is_velocity_old: bool) -> None:
        """Corrects all hypotheses by a measurement, and weighs them by how well they expected it.

        Kalman's filter with the innovation nu_j of each hypothesis j and one gain K for all:

            S = H P H^T + R,  K = P H^T S^-1,  z_j <- z_j + K nu_j,  P <- P - K H P,
            p_j <- p_j exp(-nu_j^T S^-1 nu_j / 2) / sum

        Where the model says nothing of the motion any more, or what it says is no number, all
        hypotheses are initialized again.

        Args:
            measured: velocity, rates, roll and pitch (8,).
            is_velocity_old: whether the velocity is the one of the last call, which tells nothing.
        """
        if not max(self.covariance.diagonal()[MOTION].tolist()) < DIVERGED_VARIANCE:
            return self._restart(measured)
        rows = slice(3, 8) if is_velocity_old else slice(0, 8)
        R = self._covariance_without_velocity if is_velocity_old else self._sensor_covariance
        HP = self.covariance[rows]
        S_inverse = np.linalg.inv(HP[:, rows] + R)
        # Rows of hypotheses, the null hypothesis first.
        innovation = (measured - self.state[:8])[rows] - self._offsets[:, rows]
        weighted = innovation @ S_inverse
        distance = np.einsum("ij,ij->i", weighted, innovation)
        # The built-in functions are quicker than numpy's for so few numbers.
        distances = distance.tolist()
        if not distances[0] < DIVERGED_DISTANCE:
            return self._restart(measured)
        self.distance = distances[0]
        # Where fins are not what the model says, even the best hypothesis is far off: trust it
        # less.
        excess = min(min(distances) / len(S_inverse), NIS_MAX) - EXPECTED_NIS
        self.misfit = min(max(self.misfit * math.exp(ADAPTATION * excess), 1.0), MISFIT_MAX)
        correction = weighted @ HP
        self.state = self.state + correction[0]
        correction -= correction[0]
        self._offsets += correction
        P = self.covariance - HP.T @ (S_inverse @ HP)
        self.covariance = 0.5 * (P + P.T)  # what rounding makes uneven would grow
        # Logarithms of likelihoods over that of the null hypothesis, shifted against overflow.
        log_ratio = 0.5 * (self.distance - distance[1:])
        shift = max(0.0, *log_ratio.tolist())
        weight = self._probability * np.exp(log_ratio - shift)
        alternatives = sum(weight.tolist())
        total = alternatives + (1.0 - self.doubt) * math.exp(-shift)
        self._probability = weight / total
        self.doubt = alternatives / total

    @property
    def settled(self) -> bool:
        """Whether there was time to learn current and trim, so that alternatives count."""
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
        """One hypothesis is now taken for true, and all are initialized again.

        Args:
            fin: index of the fin.
            kind: index of the hypothesis about it, in `LEVELS` or after its end.
        """
        self.state = self.state + self.fin_offsets[fin, kind]
        is_torn = 0 < kind < len(LEVELS) - 1
        std = self.settings.new_strength if is_torn else self.settings.strength
        self._set_strength_std(fin, std)

    def adopt_both(self, pair: int) -> None:
        """Two fins are now taken for lost, and all hypotheses are initialized again."""
        self.state = self.state + self.pair_offsets[pair]
        for fin in self.pairs[pair].tolist():
            self._set_strength_std(fin, self.settings.strength)

    def believe(self, fin: int, strength: float) -> None:
        """The strength of a fin is known."""
        self.state[FIRST_FIN + fin] = strength
        self._set_strength_std(fin, self.settings.strength)

    def _set_strength_std(self, fin: int, std: float) -> None:
        """The strength of a fin is known to a standard deviation, apart from all else."""
        row = FIRST_FIN + fin
        self.covariance[row] = 0.0
        self.covariance[:, row] = 0.0
        self.covariance[row, row] = self._max_variance[fin] = std**2
        self._reset_alternatives()
