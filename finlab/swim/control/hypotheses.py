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

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core import library
from finlab.core.shared_array import SharedArray
from finlab.swim.control.drive_telemetry import DriveEvidence
from finlab.swim.control.jump_evidence import (
    LOST,
    ONSET_EVERY_S,
    ONSETS,
    REVERSED,
    STUCK,
    WEAK,
    WHOLE,
    Evidence,
    GatheredJumps,
    JumpEvidence,
)
from finlab.swim.control.monitor_settings import MonitorSettings
from finlab.swim.control.motion_model import (
    BIAS,
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

LOST_BELOW = 0.15
"""A strength below which an actuator is given up as lost."""
REVERSED_BELOW = -0.3
"""A strength below which it pushes the other way than the layout says."""
WEAK_BELOW = 0.9
"""A strength below which an actuator is weak; one that was weak is whole again from there on."""
NIS_MAX = 4.0
"""Largest squared innovation per measured number, in variances, that counts for the misfit."""
MISFIT_ACCELERATION = 0.01
"""An acceleration [m/s^2], per root of a second, by whose square the noise of the motion grows with
the misfit."""
ADAPTATION = 0.03
"""How fast the misfit changes, per tick."""
ADAPTATION_EARLY = 0.1
"""The same before all has settled."""
MISFIT_MAX = 1e5
"""Greatest misfit."""
ORDINARY_TILT = 0.5
"""Roll or pitch [rad] at which the terms of the equation are off by twice as much as at rest."""
ORDINARY_RATE = 0.8
"""Angular rate [rad/s] of which the same holds."""
TERMS_LAST_S = 1.0
"""How long the terms of the equation stay off by the same [s]."""
PRODUCTS_LAST_S = 0.2
"""The same of what is not linear in the errors of the state, of which each correction takes
some."""
DIVERGED_SPEED = 30.0
"""Velocity [m/s] or rate [rad/s] at which nothing swims."""
DIVERGED_VARIANCE = 100.0
"""Variance of a velocity beyond which the model says nothing of it [m^2/s^2, rad^2/s^2]."""
DIVERGED_DISTANCE = 1e6
"""Squared innovation, in variances, beyond which the model says nothing of the motion, as of a
robot that tumbles."""


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
        variance = _variance_at_start(model, settings, self._by_acceleration)
        self._variance_at_start = variance
        self.shared_covariance = SharedArray(np.diag(variance))
        self._limit = SharedArray(np.full(d, np.inf))
        learned = slice(CURRENT.start, model.place.stop)
        self._limit.array[learned] = variance[learned]
        self._noise = _noise(model, settings, self._by_acceleration)
        self._misfit_noise = np.square(MISFIT_ACCELERATION * self._by_acceleration / inertia)
        scale = np.where(model.sticks_at_angle, 1.0, model.force_max)
        self.held_scale: Array = scale[model.held_owner]
        """Sizes (h,) of what stuck ones may give: largest forces [N], 1 of cosines and sines."""
        self.misfit = 1.0
        """How many times as much (a variance) the motion is disturbed as the settings say, at least
        1."""
        self.distance = 0.0
        """Squared innovation of the last measurement, in variances."""
        self.age_s = 0.0
        """Time since the beginning [s]."""
        self.acceleration_variance = np.zeros(6)
        """Of mean accelerations over the last period, beside those of the state (6,)."""
        self._columns = _columns_of_jumps(model)
        c = len(self._columns)
        self._n_columns = c
        self._column_indices = np.arange(c)
        self._jolt_columns = np.arange(c - 6, c)
        self._own_columns = [np.array([k, *(n + model.held_of[k])]) for k in range(n)]
        """Columns of each actuator: its strength, and what it gives where it sticks."""
        # Moments at which a jump may have happened stand in slots, those of the oldest first in
        # `_slots`: how the state has changed by a jump of 1 of each column at each, and its age.
        self._sensitivity = SharedArray(np.zeros((d, ONSETS, c)))
        self._age = np.zeros(ONSETS)
        self._jumps = GatheredJumps(
            information=SharedArray(np.zeros((ONSETS, c, c))),
            score=SharedArray(np.zeros((ONSETS, c))),
            strength=SharedArray(np.zeros((ONSETS, n))),
            held=SharedArray(np.zeros((ONSETS, model.n_held))),
            motion=SharedArray(np.zeros((ONSETS, model.n_held))),
        )
        self._jolt_variance = np.square(s.jolt * self._by_acceleration)
        self._evidence = JumpEvidence(model, s, self._jumps, self._jolt_variance)
        self.drives = DriveEvidence(model, ONSETS)
        """What drives say of themselves."""
        self.forget_jumps()

    @property
    def covariance(self) -> Array:
        """P (d, d), to be changed in place."""
        return self.shared_covariance.array

    @property
    def onset_age(self) -> Array:
        """Ages (o,) of the moments at which a jump may have happened, the oldest first [s]."""
        return self._age[self._slots]

    def forget_jumps(self) -> None:
        """All jumps begin anew, now."""
        self._slots = np.zeros(0, dtype=np.int32)
        self._n_used = 0
        self._best_onsets: list[int] = []
        """Slots of the moments at which a jump explains most."""
        self._since_onset = math.inf
        # What has never been stuck is known exactly, and costs nothing.
        held = self.covariance.diagonal()[self.model.held]
        self._active = self.model.size if held.any() else self.model.held.start

    def restart(self, measured: Array) -> None:
        """Of the motion only what is measured (9,) is known; what has been learned of the body and
        of strengths stays."""
        self.state[:N_MOVING] = measured
        self.state[CURRENT] = 0.0
        self.state[UNKNOWN] = 0.0
        variance = self.covariance.diagonal().copy()
        variance[:18] = self._variance_at_start[:18]
        self.covariance[:] = np.diag(variance)
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
        self._age += dt
        self.state = step.state
        share = s.term_share * self._excursion()
        # What is off for a while counts as white noise of that while.
        of_terms = share**2 * TERMS_LAST_S * dt
        of_products = PRODUCTS_LAST_S * dt
        weights = np.array([of_terms, of_products, s.lag_s**2, dt**2])
        noise = self._noise * dt
        noise[MOTION] += weights @ step.noise + self._misfit_noise * ((self.misfit - 1.0) * dt)
        self.acceleration_variance = noise[MOTION] / dt**2
        library().fl_jumps_predict(
            step.transition.ctypes.data,
            noise.ctypes.data,
            self._limit.address,
            self._columns.ctypes.data,
            ONSETS,
            self._n_used,
            self.model.size,
            self._active,
            self._n_columns,
            self.shared_covariance.address,
            self._sensitivity.address,
        )

    def _excursion(self) -> float:
        """How much more the terms are off than in ordinary motion, as the robot heels and turns: 1
        at rest."""
        p, q, r, roll, pitch = self.state[RATES.start : TILT.stop].tolist()
        heel = max(abs(roll), abs(pitch)) / ORDINARY_TILT
        turn = max(abs(p), abs(q), abs(r)) / ORDINARY_RATE
        return float(1.0 + heel**2 + turn**2)

    def _begin_onset(self) -> None:
        """A jump may happen from now on."""
        slot = self._free_slot()
        self._slots = np.append(self._slots, np.int32(slot))
        self._n_used = max(self._n_used, slot + 1)
        self._sensitivity.array[:, slot] = 0.0
        self._sensitivity.array[self._columns, slot, self._column_indices] = 1.0
        jumps = self._jumps
        jumps.information.array[slot] = 0.0
        jumps.score.array[slot] = 0.0
        jumps.strength.array[slot] = self.strength
        jumps.held.array[slot] = self.held
        jumps.motion.array[slot] = self.model.held_now()
        self.drives.begin(slot)
        self._age[slot] = 0.0
        self._best_onsets = []
        self._since_onset = 0.0

    def _free_slot(self) -> int:
        """A slot for another moment; one of the older ones goes where all are taken."""
        slots = self._slots.tolist()
        ages = self._age[self._slots].tolist()
        kept = [slot for slot, age in zip(slots, ages, strict=True) if age <= OLDEST_S]
        if len(kept) >= ONSETS:
            kept.remove(self._closest_onset(kept))
        if len(kept) < len(slots):
            self._slots = np.array(kept, dtype=np.int32)
        taken = set(kept)
        return next(slot for slot in range(ONSETS) if slot not in taken)

    def _closest_onset(self, slots: list[int]) -> int:
        """Of the older moments the one that lies closest between its neighbours, by its age, but
        for those that explain most."""
        ages = self._age.tolist()
        least = math.inf
        closest = slots[1]
        for i in range(1, len(slots) - RECENT_ONSETS):
            gap = (ages[slots[i - 1]] - ages[slots[i + 1]]) / ages[slots[i]]
            if gap < least and slots[i] not in self._best_onsets:
                least = gap
                closest = slots[i]
        return closest

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
        m = len(rows)
        distance: float = library().fl_jumps_update(
            rows.ctypes.data,
            innovation.ctypes.data,
            variance.ctypes.data,
            m,
            DIVERGED_DISTANCE,
            self._columns.ctypes.data,
            ONSETS,
            self._n_used,
            self.model.size,
            self._active,
            self._n_columns,
            self.state.ctypes.data,
            self.shared_covariance.address,
            self._sensitivity.address,
            self._jumps.information.address,
            self._jumps.score.address,
        )
        if distance < 0.0:
            return False
        self.distance = distance
        excess = min(distance / m, NIS_MAX) - 1.0
        rate = ADAPTATION if self.settled else ADAPTATION_EARLY
        self.misfit = min(max(self.misfit * math.exp(rate * excess), 1.0), MISFIT_MAX)
        return True

    @property
    def has_diverged(self) -> bool:
        """Whether the filter says nothing of the motion any more."""
        variance = self.covariance.ravel()[:: self.model.size + 1]
        swims = all(abs(speed) < DIVERGED_SPEED for speed in self.state[MOTION].tolist())
        is_known = all(each < DIVERGED_VARIANCE for each in variance[MOTION].tolist())
        return not (swims and is_known)  # NaN is neither

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

    def evidence(self) -> Evidence:
        """How likely each jump is, compared with none."""
        of_drives = None
        if self.drives.has_samples:
            of_drives = self.drives.log_ratios(self._slots, self._believed_kinds())
        evidence = self._evidence.now(
            self._slots, self.onset_age, self.strength, self.held, self.misfit, of_drives
        )
        # Of each actuator and of the pairs.
        span = evidence.span
        o = len(span)
        single = evidence.log_odds.reshape(o, -1).max(axis=1) - span
        pair = evidence.both.reshape(o, -1).max(axis=1) - span
        self._best_onsets = [int(self._slots[single.argmax()]), int(self._slots[pair.argmax()])]
        return evidence

    def _believed_kinds(self) -> NDArray[np.int_]:
        """What each actuator is taken for (n,), index in `KINDS`, by its strength and what it gives
        where it sticks."""
        strength = self.strength
        kinds = np.where(strength < WEAK_BELOW, WEAK, WHOLE)
        kinds[strength < LOST_BELOW] = LOST
        kinds[strength < REVERSED_BELOW] = REVERSED
        kinds[self.model.held_owner[self.held != 0.0]] = STUCK
        return np.asarray(kinds)

    def _take_over(
        self, onset: int, columns: NDArray[np.int_], mean: Array, variance: Array
    ) -> None:
        """A jump is taken for true: state and covariance become what they would be had it been
        known.

        Args:
            onset: index of its moment.
            columns: that jump (k,).
            mean: of its prior (k,).
            variance: of its prior (k,).
        """
        slot = int(self._slots[onset])
        Lambda = self._jumps.information.array[slot][np.ix_(columns, columns)]
        eta = self._jumps.score.array[slot][columns]
        C = np.diag(variance)
        gain = np.linalg.solve(np.eye(len(columns)) + C @ Lambda, C)
        delta = mean + gain @ (eta - Lambda @ mean)
        S = self._sensitivity.array[:, slot][:, columns]
        self.state = self.state + S @ delta
        self.covariance[:] += S @ (0.5 * (gain + gain.T)) @ S.T

    def adopt(self, onset: int, actuator: int, mean: Array, variance: Array) -> None:
        """A jump of an actuator is taken for true, and all jumps begin anew.

        Args:
            onset: index of its moment.
            actuator: index.
            mean: of its prior (3,).
            variance: of its prior (3,).
        """
        own = self._own_columns[actuator]
        k = len(own)
        self._take_over(onset, own, mean[:k], variance[:k])
        self._note_variance(actuator)
        self.forget_jumps()

    def _note_variance(self, actuator: int) -> None:
        """How well the strength of an actuator is known, at least, from now on."""
        row = self.model.strength.start + actuator
        variance = max(float(self.covariance[row, row]), self.settings.strength**2)
        self._limit.array[row] = variance

    def adopt_loss(self, onset: int, actuators: list[int]) -> None:
        """Several are taken for lost at one moment."""
        slot = int(self._slots[onset])
        delta = -self._jumps.strength.array[slot, actuators]
        self.state = self.state + self._sensitivity.array[:, slot][:, actuators] @ delta
        for k in actuators:
            self.believe(k, 0.0)

    def adopt_jolt(self, onset: int) -> None:
        """A wrench that no fault explains is taken for true."""
        self._take_over(onset, self._jolt_columns, np.zeros(6), self._jolt_variance)
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


def _variance_at_start(model: MotionModel, s: MonitorSettings, by_acceleration: Array) -> Array:
    """Variances (d,) of a state of which nothing has been measured yet; by_acceleration (6,) has
    the wrenches of an acceleration of 1 [N s^2/m, N m s^2/m]."""
    variance = np.zeros(model.size)
    variance[MOTION] = 0.02**2
    variance[TILT] = 0.02**2
    variance[DEPTH] = 0.05**2
    variance[CURRENT] = np.square(s.current * np.array([1.0, 1.0, 0.2]))
    variance[UNKNOWN] = np.square(s.unknown * by_acceleration)
    variance[INERTIA] = s.inertia**2
    variance[COUPLING] = s.coupling**2
    variance[DAMPING] = s.damping**2
    variance[RIGHTING] = s.damping**2
    variance[BIAS] = s.acceleration_bias**2
    variance[model.strength] = s.strength**2
    variance[model.place] = s.place**2
    return variance


def _noise(model: MotionModel, s: MonitorSettings, by_acceleration: Array) -> Array:
    """Growth of the variances (d,) in a second, from what drifts; by_acceleration as above."""
    noise = np.zeros(model.size)
    noise[MOTION] = np.square(s.disturbance * by_acceleration / model.inertia)
    noise[CURRENT] = np.square(s.current_drift * np.array([1.0, 1.0, 0.2]))
    noise[UNKNOWN] = np.square(s.unknown_drift * by_acceleration)
    noise[INERTIA] = noise[DAMPING] = noise[RIGHTING] = s.body_drift**2
    noise[COUPLING] = (s.body_drift * s.coupling / s.inertia) ** 2
    noise[BIAS] = s.acceleration_bias_drift**2
    noise[model.strength] = s.strength_drift**2
    return noise


def _columns_of_jumps(model: MotionModel) -> NDArray[np.int32]:
    """Numbers (c,) of the state that may jump: strengths, what stuck ones give, an unknown
    wrench."""
    columns = np.concatenate(
        [
            np.arange(model.strength.start, model.strength.stop),
            np.arange(model.held.start, model.held.stop),
            np.arange(UNKNOWN.start, UNKNOWN.stop),
        ]
    )
    return columns.astype(np.int32)
