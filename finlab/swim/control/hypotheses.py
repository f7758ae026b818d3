"""Hypotheses about one robot, side by side: all is as believed, or something has jumped.

One extended Kalman filter holds the motion and all that is unknown of a robot (`motion_model.py`).
A fault is a jump of a few numbers of its state at some time in the past: of the strength of an
actuator, and of what it gives where it is stuck. What such a jump has made of every innovation
since is linear in its size, so its likelihood ratio has a closed form, in which the body, the
current and all strengths have been integrated out (A. S. Willsky and H. L. Jones, A generalized
likelihood ratio approach to the detection and estimation of jumps in linear systems, IEEE
Transactions on Automatic Control 21, 1976). `FaultMonitor` decides what to adopt.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.swim.control.motion_model import (
    COUPLING,
    CURRENT,
    DAMPING,
    DEPTH,
    INERTIA,
    MOTION,
    N_MOVING,
    RATES,
    RIGHTING,
    TILT,
    UNKNOWN,
    ModelStep,
    MotionModel,
    gyration_radius,
)

LOST = 0
REVERSED = 1
WEAK = 2
STUCK = 3
WHOLE = 4
KINDS = ("lost", "reversed", "weak", "stuck", "whole")
"""What an actuator may have become."""


class Target(NamedTuple):
    """What a hypothesis says of an actuator: its strength, and where it is stuck."""

    kind: int
    """Index in `KINDS`."""
    strength: float
    """Mean of its strength."""
    strength_std: float
    """Standard deviation."""
    held: str = ""
    """Empty where it is not stuck, `near` where it sticks as it was at the time, `any` where it may
    be stuck at anything."""
    share: float = 1.0
    """Share of all events of an actuator."""


TARGETS = (
    Target(LOST, 0.0, 0.06, share=0.35),
    Target(REVERSED, -1.0, 0.12, share=0.1),
    Target(WEAK, 0.35, 0.12, share=0.15),
    Target(WEAK, 0.65, 0.12, share=0.1),
    Target(STUCK, 0.0, 0.0, "near", share=0.2),
    Target(STUCK, 0.0, 0.0, "any", share=0.05),
    Target(WHOLE, 1.0, 0.05, share=0.05),
)
"""The hypotheses about each actuator."""
IS_STUCK = np.array([bool(target.held) for target in TARGETS])
FIRST_STUCK = int(IS_STUCK.argmax())
"""Index of the first target that is stuck."""
FIRST_WHOLE = len(TARGETS) - 1
"""Index of the target behind the last that is stuck."""
REVERSED_TARGET = next(j for j, target in enumerate(TARGETS) if target.kind == REVERSED)
"""Index of the target that pushes the other way."""
REVERSED_AT_ANGLE = 0.05
"""How often fins and pods, which turn, come to push the other way, as a share of how often others
do."""
OF_KIND = [np.flatnonzero([target.kind == kind for target in TARGETS]) for kind in range(5)]
"""Targets of each kind."""
IS_OF_KIND = np.array([[float(target.kind == kind) for kind in range(5)] for target in TARGETS])
"""The same as a matrix (t, 5)."""
PAIR_SHARE = 0.1
"""How often two given actuators are lost at one moment (a cable, a collision), as a share of how
often one is."""
NEAR_SHARE = 0.15
"""A thruster sticks within so much of its force of then, as a share of it."""
NEAR_FLOOR = 0.002
"""The same as a share of its largest force."""
NOTHING_SHARE = 0.006
"""Share of its largest force below which a thruster that sticks is a lost one."""
NEAR_ANGLE = 0.15
"""Cosine and sine of an angle at which one sticks are within so much of those of then."""
FAR_SHARE = 0.4
"""Standard deviation of the force at which a thruster may be stuck, over its largest."""
FAR_ANGLE = 0.7
"""The same of cosine and sine of any angle."""
DISTANCE_MIN = 0.2
"""A target this near to the strength that is believed is no event."""
NIS_MAX = 4.0
"""Largest squared innovation per measured number, in variances, that counts for the misfit."""
MISFIT_ACCELERATION = 0.01
"""An acceleration [m/s^2], per root of a second, by whose square the noise of the motion grows with
the misfit."""
ADAPTATION = 0.03
"""How fast the misfit changes, per tick."""
ADAPTATION_EARLY = 0.1
"""The same before all has settled."""
TEMPER = 0.5
"""By what logarithms of likelihoods are divided as the misfit grows: 1 and so much per its
logarithm."""
MISFIT_MAX = 1e5
"""Greatest misfit."""
ORDINARY_TILT = 0.5
"""Roll or pitch [rad] at which the terms of the equation are off by twice as much as at rest."""
ORDINARY_RATE = 0.8
"""Angular rate [rad/s] of which the same holds."""
DIVERGED_SPEED = 30.0
"""Velocity [m/s] or rate [rad/s] at which nothing swims."""
DIVERGED_VARIANCE = 100.0
"""Variance of a velocity beyond which the model says nothing of it [m^2/s^2, rad^2/s^2]."""
DIVERGED_DISTANCE = 1e6
"""Squared innovation, in variances, beyond which the model says nothing of the motion, as of a
robot that tumbles."""


@dataclass(frozen=True)
class MonitorSettings:
    """What a `FaultMonitor` takes for granted. Standard deviations, and rates per second."""

    rate_noise: float = 0.01
    """Of a measured angular rate [rad/s]."""
    velocity_noise: float = 0.012
    """Of a measured velocity [m/s]."""
    tilt_noise: float = 0.012
    """Of measured roll and pitch [rad]."""
    depth_noise: float = 0.01
    """Of a measured depth [m]."""
    acceleration_noise: float = 0.1
    """Of a measured specific force [m/s^2]."""
    term_share: float = 0.01
    """Share by which each term of the equation of motion is off, for about a second."""
    lag_s: float = 0.02
    """Of an actuator's time constant [s]."""
    disturbance: float = 0.001
    """Of an acceleration that nothing explains [m/s^2], per root of a second."""
    unknown: float = 0.05
    """Of an acceleration that stays, as by buoyancy and trim [m/s^2]."""
    unknown_drift: float = 0.001
    """Of its change [m/s^2], per root of a second."""
    current: float = 0.1
    """Of the current that is expected [m/s]; a fifth of it vertically."""
    current_drift: float = 0.003
    """Of its change [m/s], per root of a second."""
    inertia: float = 0.13
    """Of mass and moments, with those of the water, as a share of the layout's."""
    coupling: float = 0.04
    """Of the entries of the inertia matrix beside its diagonal, over the geometric mean of the two
    diagonal ones."""
    damping: float = 0.15
    """Of damping and righting moment, as a share."""
    body_drift: float = 0.005
    """Of the change of these shares, per root of a second."""
    strength: float = 0.04
    """Of the strength of a whole actuator."""
    strength_drift: float = 0.002
    """Of its change, per root of a second."""
    failures: float = 5e-4
    """Events per actuator and second that are expected."""
    jolt: float = 0.2
    """Of an acceleration that begins at some moment and that no fault explains, such as the pull
    of a tether [m/s^2]."""
    jolts: float = 2e-5
    """How many are expected per second."""
    settle_s: float = 6.0
    """Time at the start in which current and trim are learnt and little is suspected [s]."""
    probe_every_s: float = 20.0
    """Time after which an actuator that is taken for lost is tried again [s]; 0 for never."""
    least_push: float = 0.5
    """Force [N] that every fin gives at least, up or down where it would rest, so that its loss
    shows; 0 for none. Costs power, where fins would rest."""
    threshold: float = 0.93
    """Probability of a fault from which it is acted on, if it holds for a while."""


ONSET_EVERY_S = 0.1
"""Least time between the moments at which a jump may have happened [s]."""
ONSETS = 13
"""How many of them are kept."""
RECENT_ONSETS = 5
"""How many of the last ones stay as close together; older ones are thinned out."""
OLDEST_S = 15.0
"""Age at which a moment is given up [s]."""


class Hypotheses:
    """What is taken for true of a robot, and the jumps that may have happened beside it."""

    def __init__(self, model: MotionModel, settings: MonitorSettings) -> None:
        """Starts at rest, with all actuators whole."""
        self.model = model
        self.settings = s = settings
        d = model.size
        n = model.n
        self.n = n
        self.state = np.zeros(d)
        """State z (d,) that is taken for true."""
        self.state[model.strength] = 1.0
        inertia = model.inertia
        # Accelerations of the settings as wrenches of this robot.
        radius = gyration_radius(inertia)
        self._by_acceleration = inertia * np.concatenate([np.ones(3), 1.0 / radius])
        variance = np.zeros(d)
        variance[MOTION] = 0.02**2
        variance[TILT] = 0.02**2
        variance[DEPTH] = 0.05**2
        variance[CURRENT] = np.square(s.current * np.array([1.0, 1.0, 0.2]))
        variance[UNKNOWN] = np.square(s.unknown * self._by_acceleration)
        variance[INERTIA] = s.inertia**2
        variance[COUPLING] = s.coupling**2
        variance[DAMPING] = s.damping**2
        variance[RIGHTING] = s.damping**2
        variance[model.strength] = s.strength**2
        self._variance_at_start = variance
        self._variance_limit = variance[CURRENT.start : model.strength.stop].copy()
        self.covariance = np.diag(variance)
        """P (d, d)."""
        noise = np.zeros(d)
        noise[MOTION] = np.square(s.disturbance * self._by_acceleration / inertia)
        noise[CURRENT] = np.square(s.current_drift * np.array([1.0, 1.0, 0.2]))
        noise[UNKNOWN] = np.square(s.unknown_drift * self._by_acceleration)
        noise[INERTIA] = noise[DAMPING] = noise[RIGHTING] = s.body_drift**2
        noise[COUPLING] = (s.body_drift * s.coupling / s.inertia) ** 2
        noise[model.strength] = s.strength_drift**2
        self._noise = noise
        self._misfit_noise = np.square(MISFIT_ACCELERATION * self._by_acceleration / inertia)
        self._force_max = _largest_forces(model)
        scale = np.where(model.sticks_at_angle, 1.0, self._force_max)
        self.held_scale: Array = scale[model.held_owner]
        """Sizes (h,) of what stuck ones may give: largest forces [N], 1 of cosines and sines."""
        self.misfit = 1.0
        """How many times as much (a variance) the motion is disturbed as the settings say, at least
        1."""
        self.distance = 0.0
        """Squared innovation of the last measurement, in variances."""
        self.age_s = 0.0
        """Time since the beginning [s]."""
        # Columns of a jump: strengths, what stuck ones give, an unknown wrench.
        self._columns = np.concatenate(
            [
                np.arange(model.strength.start, model.strength.stop),
                np.arange(model.held.start, model.held.stop),
                np.arange(UNKNOWN.start, UNKNOWN.stop),
            ]
        )
        c = len(self._columns)
        self._n_columns = c
        self._is_pair = np.triu(np.ones((n, n), dtype=bool), 1)
        self._jolt_columns = np.arange(c - 6, c)
        # Of each actuator: its columns, three of them, the last ones empty where it has fewer.
        self._own_columns = np.full((n, 3), c)
        for k in range(n):
            held = n + model.held_of[k]
            self._own_columns[k, : 1 + len(held)] = [k, *held]
        self.forget_jumps()

    def forget_jumps(self) -> None:
        """All jumps begin anew, now."""
        c = self._n_columns
        d = self.model.size
        self._sensitivity = np.zeros((d, 0))
        """How the state has changed (d, o c) by a jump of 1 of each column at each onset."""
        self._information = np.zeros((0, c, c))
        """Lambda of the jumps at each onset (o, c, c)."""
        self._score = np.zeros((0, c))
        """eta of them (o, c)."""
        self.onset_age = np.zeros(0)
        """[s]."""
        self._onset_motion = np.zeros((0, self.model.n_held))
        """What each actuator would have given on had it stuck at each onset (o, h)."""
        self._onset_strength = np.zeros((0, self.n))
        """What was taken for the strengths then (o, n), and for what stuck ones give (o, h)."""
        self._onset_held = np.zeros((0, self.model.n_held))
        self._best_onsets = np.zeros(0, dtype=int)
        """Indices of the onsets at which a jump explains most."""
        self._since_onset = math.inf

    def restart(self, measured: Array) -> None:
        """Of the motion only what is measured (9,) is known; what has been learned of the body and
        of strengths stays."""
        self.state[:N_MOVING] = measured
        self.state[CURRENT] = 0.0
        self.state[UNKNOWN] = 0.0
        variance = self.covariance.diagonal().copy()
        variance[:18] = self._variance_at_start[:18]
        self.covariance = np.diag(variance)
        self.misfit = 1.0
        self.distance = 0.0
        self.age_s = 0.0
        self.forget_jumps()

    def predict(self, step: ModelStep, dt: float) -> None:
        """Carries all on over a period: z <- f(z), P <- F P F^T + Q, and the jumps' effects.

        Args:
            step: f and F of the model.
            dt: length of the period [s].
        """
        self.age_s += dt
        s = self.settings
        if self._since_onset >= ONSET_EVERY_S - 1e-9:
            self._begin_onset()
        self._since_onset += dt
        self.onset_age += dt
        F = step.transition
        self.state = step.state
        P = self.covariance
        rows = F @ P
        P[:N_MOVING] = rows
        P[:, :N_MOVING] = rows.T
        P[:N_MOVING, :N_MOVING] = rows @ F.T
        variance = P.ravel()[:: len(P) + 1]
        variance += self._noise * dt
        of_terms, of_changes, of_turning = step.noise
        share = s.term_share * self._excursion()
        variance[MOTION] += of_terms * (share**2 * dt) + of_changes * s.lag_s**2
        variance[MOTION] += of_turning * dt**2
        variance[MOTION] += self._misfit_noise * ((self.misfit - 1.0) * dt)
        self._limit_variance(variance)
        self._sensitivity[:N_MOVING] = F @ self._sensitivity

    def _excursion(self) -> float:
        """How much more the terms are off than in ordinary motion, as the robot heels and turns: 1
        at rest."""
        heel = float(np.abs(self.state[TILT]).max()) / ORDINARY_TILT
        turn = float(np.abs(self.state[RATES]).max()) / ORDINARY_RATE
        return 1.0 + heel**2 + turn**2

    def _limit_variance(self, variance: Array) -> None:
        """What drifts without being seen is never less known than at the start, or than when it was
        found."""
        rest = slice(CURRENT.start, self.model.strength.stop)
        limit = self._variance_limit
        if True in (variance[rest] > limit).tolist():
            scale = np.ones(len(variance))
            scale[rest] = np.sqrt(np.minimum(limit / np.maximum(variance[rest], 1e-300), 1.0))
            self.covariance *= scale
            self.covariance *= scale[:, None]

    def _begin_onset(self) -> None:
        """A jump may happen from now on."""
        d = self.model.size
        c = self._n_columns
        new = np.zeros((d, c))
        new[self._columns, np.arange(c)] = 1.0
        ages = self.onset_age
        keep = np.ones(len(ages), dtype=bool)
        keep[ages > OLDEST_S] = False
        if keep.sum() >= ONSETS:
            # Of the older ones that goes which lies closest between its neighbours, by its age, but
            # for those that explain most.
            older = np.flatnonzero(keep)[: -RECENT_ONSETS + 1]
            gaps = (ages[older[:-2]] - ages[older[2:]]) / ages[older[1:-1]]
            gaps[np.isin(older[1:-1], self._best_onsets)] = np.inf
            keep[older[1 + int(gaps.argmin())]] = False
        S = self._sensitivity.reshape(d, len(ages), c)[:, keep]
        S = np.concatenate([S, new[:, None]], axis=1)
        self._sensitivity = S.reshape(d, -1)
        self._information = np.concatenate([self._information[keep], np.zeros((1, c, c))])
        self._score = np.concatenate([self._score[keep], np.zeros((1, c))])
        self.onset_age = np.append(ages[keep], 0.0)
        motion = self.model.held_now()[None]
        self._onset_motion = np.concatenate([self._onset_motion[keep], motion])
        self._onset_strength = np.concatenate([self._onset_strength[keep], self.strength[None]])
        self._onset_held = np.concatenate([self._onset_held[keep], self.held[None]])
        self._best_onsets = np.zeros(0, dtype=int)
        self._since_onset = 0.0

    def update(self, rows: Array, innovation: Array, variance: Array) -> bool:
        """Corrects the filter by a measurement, and weighs the jumps by it.

        With the innovation nu, its covariance S and the effects V = H Sigma of the jumps on it:

            S = H P H^T + R,  K = P H^T S^-1,  z <- z + K nu,  P <- P - K H P
            Lambda <- Lambda + V^T S^-1 V,  eta <- eta + V^T S^-1 nu,  Sigma <- Sigma - K V

        Args:
            rows: H (m, d).
            innovation: what was measured less what was expected (m,).
            variance: of the measurement's noise (m,).

        Returns:
            Whether the model still says something of the motion; nothing is changed otherwise.
        """
        HP = rows @ self.covariance
        S = HP @ rows.T
        S.ravel()[:: len(S) + 1] += variance
        try:
            L_inverse = np.linalg.inv(np.linalg.cholesky(S))
        except np.linalg.LinAlgError:
            return False
        whitened = L_inverse @ innovation
        distance = float(whitened @ whitened)
        if not distance < DIVERGED_DISTANCE:
            return False
        self.distance = distance
        V = L_inverse @ (rows @ self._sensitivity)
        gain = L_inverse @ HP  # K = gain^T L^-1
        self.state = self.state + whitened @ gain
        P = self.covariance - gain.T @ gain
        self.covariance = 0.5 * (P + P.T)  # what rounding makes uneven would grow
        m = len(rows)
        o = len(self.onset_age)
        if o:
            by_onset = V.reshape(m, o, -1).transpose(1, 0, 2)
            self._information += by_onset.transpose(0, 2, 1) @ by_onset
            self._score += whitened @ by_onset
            self._sensitivity -= gain.T @ V
        excess = min(self.distance / m, NIS_MAX) - 1.0
        rate = ADAPTATION if self.settled else ADAPTATION_EARLY
        self.misfit = min(max(self.misfit * math.exp(rate * excess), 1.0), MISFIT_MAX)
        return True

    @property
    def has_diverged(self) -> bool:
        """Whether the filter says nothing of the motion any more."""
        motion = np.abs(self.state[MOTION])
        variance = self.covariance.diagonal()[MOTION]
        return not (motion.max() < DIVERGED_SPEED and variance.max() < DIVERGED_VARIANCE)

    @property
    def strength(self) -> Array:
        """Strengths (n,) that are taken for true."""
        return self.state[self.model.strength]

    @property
    def strength_std(self) -> Array:
        """Their standard deviations (n,)."""
        variance = self.covariance.diagonal()[self.model.strength]
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))

    @property
    def held(self) -> Array:
        """What stuck ones give (h,)."""
        return self.state[self.model.held]

    def evidence(self) -> "Evidence":
        """How likely each jump is, compared with none.

        A jump delta with prior N(m, C) at an onset with Lambda and eta has the log likelihood ratio

            eta^T m - m^T Lambda m / 2 + r^T (1 + C Lambda)^-1 C r / 2 - log det(1 + C Lambda) / 2

        with r = eta - Lambda m.
        """
        s = self.settings
        o = len(self.onset_age)
        n = self.n
        c = self._n_columns
        padded = np.zeros((o, c + 1, c + 1))
        padded[:, :c, :c] = self._information
        eta_padded = np.zeros((o, c + 1))
        eta_padded[:, :c] = self._score
        own = self._own_columns
        Lambda = padded[:, own[:, :, None], own[:, None, :]][:, :, None]  # (o, n, 1, 3, 3)
        eta = eta_padded[:, own][:, :, None]  # (o, n, 1, 3)
        mean, variance = self._priors()
        log_ratio = np.empty(mean.shape[:-1])
        stuck = slice(FIRST_STUCK, FIRST_WHOLE)
        log_ratio[:, :, stuck] = log_likelihood_ratio(
            Lambda, eta, mean[:, :, stuck], variance[:, :, stuck]
        )
        # Of the others only the strength is in doubt.
        Lm = (Lambda @ mean[..., None])[..., 0]
        linear = ((eta - 0.5 * Lm) * mean).sum(axis=-1)
        r = eta[..., 0] - Lm[..., 0]
        C = variance[..., 0]
        by_C = 1.0 + C * Lambda[..., 0, 0]
        of_strength = linear + 0.5 * (C * np.square(r) / by_C - np.log(by_C))
        is_other = np.flatnonzero(~IS_STUCK)
        log_ratio[:, :, is_other] = of_strength[:, :, is_other]
        share = np.tile([target.share for target in TARGETS], (n, 1))
        share[self.model.sticks_at_angle, REVERSED_TARGET] *= REVERSED_AT_ANGLE
        prior = np.log(share * s.failures)
        # Each onset stands for the time since the one before it.
        span = np.log(-np.diff(np.append(self.onset_age, 0.0)).clip(max=-0.5 * ONSET_EVERY_S))
        # Where the noise is not as assumed, it is not white either, and counts for less.
        temper = 1.0 + TEMPER * math.log(self.misfit)
        log_ratio /= temper
        log_odds = log_ratio + np.where(self._possible(), prior, -np.inf) + span[:, None, None]
        log_odds[self._stuck_at_nothing(), FIRST_STUCK] = -np.inf
        jolt = self._jolt_ratio() / temper + math.log(s.jolts) + span
        both = self._pair_ratio(Lambda[..., 0, 0, 0], eta[..., 0, 0], temper, span)
        # Of each actuator and of the pairs.
        single = log_odds.max(axis=2) - span[:, None]
        pair = both.reshape(o, -1).max(axis=1) - span
        best = [int(single.max(axis=1).argmax()), int(pair.argmax())]
        self._best_onsets = np.unique(best)
        return Evidence(log_odds, jolt, both, mean, variance)

    def _possible(self) -> NDArray[np.bool_]:
        """Which targets (n, t) an actuator may come to."""
        model = self.model
        strength = self.strength
        result = np.empty((self.n, len(TARGETS)), dtype=bool)
        held = np.zeros(self.n)
        np.add.at(held, model.held_owner, np.abs(self.held))
        is_held = held > 0.0
        for j, target in enumerate(TARGETS):
            if target.held:
                result[:, j] = model.sticks & ~is_held
            else:
                result[:, j] = is_held | (np.abs(target.strength - strength) > DISTANCE_MIN)
        return result

    def _stuck_at_nothing(self) -> NDArray[np.bool_]:
        """At which onsets thrusters (o, n) gave so little that one that stuck is a lost one."""
        result = np.zeros((len(self.onset_age), self.n), dtype=bool)
        small = np.abs(self._onset_motion) < NOTHING_SHARE * self.held_scale
        keeps_force = ~self.model.sticks_at_angle[self.model.held_owner]
        result[:, self.model.held_owner[keeps_force]] = small[:, keeps_force]
        return result

    def _priors(self) -> tuple[Array, Array]:
        """Means and variances (o, n, t, 3) of the jumps by the targets."""
        o = len(self.onset_age)
        t = len(TARGETS)
        model = self.model
        mean = np.zeros((o, self.n, t, 3))
        variance = np.zeros((o, self.n, t, 3))
        h = model.n_held
        index = self._own_columns[:, 1:] - self.n
        index = np.where(index >= h, h, index)
        empty = np.zeros((o, 1))
        held = np.concatenate([self._onset_held, empty], axis=1)[:, index]
        sticks = np.concatenate([self._onset_motion, empty], axis=1)[:, index]
        is_angle = model.sticks_at_angle[:, None]
        sizes = NEAR_SHARE * np.abs(sticks) + NEAR_FLOOR * self._force_max[:, None]
        near = np.where(is_angle, NEAR_ANGLE, sizes) ** 2
        far = np.where(is_angle, FAR_ANGLE, FAR_SHARE * self._force_max[:, None]) ** 2
        exists = index < h
        for j, target in enumerate(TARGETS):
            mean[:, :, j, 0] = target.strength - self._onset_strength
            variance[:, :, j, 0] = target.strength_std**2
            mean[:, :, j, 1:] = -held
            if target.held == "near":
                mean[:, :, j, 1:] += sticks
                variance[:, :, j, 1:] = np.where(exists, near, 0.0)
            elif target.held == "any":
                variance[:, :, j, 1:] = np.where(exists, far, 0.0)
        return mean, variance

    def _jolt_ratio(self) -> Array:
        """Log likelihood ratio (o,) of a wrench that no fault explains."""
        columns = self._jolt_columns
        Lambda = self._information[:, columns[:, None], columns]
        eta = self._score[:, columns]
        variance = np.square(self.settings.jolt * self._by_acceleration)
        return log_likelihood_ratio(Lambda, eta, np.zeros(6), variance)

    def _pair_ratio(self, Lambda_own: Array, eta: Array, temper: float, span: Array) -> Array:
        """Log odds (o, n, n) that two were lost at one moment; below the diagonal -inf."""
        n = self.n
        strength = self.strength
        m = -self._onset_strength
        Lambda = self._information[:, :n, :n]
        alone = eta * m - 0.5 * m**2 * Lambda_own
        both = alone[:, :, None] + alone[:, None, :] - m[:, :, None] * m[:, None, :] * Lambda
        rate = self.settings.failures * TARGETS[0].share * PAIR_SHARE
        works = strength > 0.5
        possible = self._is_pair & works & works[:, None]
        return np.where(possible, both / temper + math.log(rate) + span[:, None, None], -np.inf)

    def adopt(self, onset: int, actuator: int, mean: Array, variance: Array) -> None:
        """A jump is taken for true: state and covariance become what they would be had it been
        known, and all jumps begin anew.

        Args:
            onset: index of its moment.
            actuator: index.
            mean: of its prior (3,).
            variance: of its prior (3,).
        """
        own = self._own_columns[actuator]
        own = own[own < self._n_columns]
        k = len(own)
        Lambda = self._information[onset][np.ix_(own, own)]
        eta = self._score[onset][own]
        C = np.diag(variance[:k])
        m = mean[:k]
        gain = np.linalg.solve(np.eye(k) + C @ Lambda, C)
        delta = m + gain @ (eta - Lambda @ m)
        S = self._sensitivity.reshape(self.model.size, -1, self._n_columns)[:, onset][:, own]
        self.state = self.state + S @ delta
        self.covariance = self.covariance + S @ (0.5 * (gain + gain.T)) @ S.T
        self._note_variance(actuator)
        self.forget_jumps()

    def _note_variance(self, actuator: int) -> None:
        """How well the strength of an actuator is known, at least, from now on."""
        row = self.model.strength.start + actuator
        variance = max(float(self.covariance[row, row]), self.settings.strength**2)
        self._variance_limit[row - CURRENT.start] = variance

    def adopt_loss(self, onset: int, actuators: list[int]) -> None:
        """Several are taken for lost at one moment."""
        S = self._sensitivity.reshape(self.model.size, -1, self._n_columns)[:, onset]
        delta = -self._onset_strength[onset, actuators]
        self.state = self.state + S[:, actuators] @ delta
        for k in actuators:
            self.believe(k, 0.0)

    def adopt_jolt(self, onset: int) -> None:
        """A wrench that no fault explains is taken for true."""
        own = self._jolt_columns
        Lambda = self._information[onset][np.ix_(own, own)]
        eta = self._score[onset][own]
        C = np.diag(np.square(self.settings.jolt * self._by_acceleration))
        gain = np.linalg.solve(np.eye(6) + C @ Lambda, C)
        S = self._sensitivity.reshape(self.model.size, -1, self._n_columns)[:, onset][:, own]
        self.state = self.state + S @ (gain @ eta)
        self.covariance = self.covariance + S @ (0.5 * (gain + gain.T)) @ S.T
        self.forget_jumps()

    def believe(self, actuator: int, strength: float, held: Array | None = None) -> None:
        """The strength of an actuator is known, and what it gives where it is stuck (1,) or
        (2,)."""
        row = self.model.strength.start + actuator
        rows = self.model.held.start + self.model.held_of[actuator]
        self.state[row] = strength
        self.state[rows] = 0.0 if held is None else held
        for each in (row, *rows):
            self.covariance[each] = 0.0
            self.covariance[:, each] = 0.0
        self.covariance[row, row] = self.settings.strength**2
        self._note_variance(actuator)
        self.forget_jumps()

    @property
    def settled(self) -> bool:
        """Whether there was time to learn current and trim."""
        return self.age_s >= self.settings.settle_s


class Evidence(NamedTuple):
    """How likely the jumps are, as logarithms of odds against none."""

    log_odds: Array
    """Of each onset, actuator and target (o, n, t)."""
    jolt: Array
    """Of a wrench that no fault explains, at each onset (o,)."""
    both: Array
    """Of two losses at one moment (o, n, n)."""
    mean: Array
    """Of the jumps' priors (o, n, t, 3)."""
    variance: Array
    """Of them (o, n, t, 3)."""


def log_likelihood_ratio(Lambda: Array, eta: Array, mean: Array, variance: Array) -> Array:
    """Log likelihood ratio of jumps, see `Hypotheses.evidence`, with a diagonal C (..., k)."""
    k = eta.shape[-1]
    Lm = (Lambda @ mean[..., None])[..., 0]
    r = eta - Lm
    linear = ((eta - 0.5 * Lm) * mean).sum(axis=-1)
    # With C = D D: D (1 + D Lambda D)^-1 D, of a symmetric matrix.
    D = np.sqrt(variance)
    inner = D[..., :, None] * Lambda * D[..., None, :]
    inner = inner + np.eye(k)
    L = np.linalg.cholesky(inner)
    y = np.linalg.solve(L, (D * r)[..., None])[..., 0]
    log_det = 2.0 * np.log(np.diagonal(L, axis1=-2, axis2=-1)).sum(axis=-1)
    return np.asarray(linear + 0.5 * (np.square(y).sum(axis=-1) - log_det))


def _largest_forces(model: MotionModel) -> Array:
    """The largest force (n,) of each actuator whose command is a force; 1 for others."""
    layout = model._plant.layout
    result = np.ones(layout.n)
    for k, part in enumerate(layout.actuators):
        if not part.KIND.sticks_at_angle:
            result[k] = max(abs(part.lower[0]), abs(part.upper[0]), 1e-9)
    return result
