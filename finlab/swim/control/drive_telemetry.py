"""Telemetry of drives as a further evidence of the fault monitor: speeds and currents, as ESCs send
them.

A propeller whose force is F turns at a speed that goes with the root of |F|, and takes a current
that goes with the third power of the speed. How large both are is learned of each drive. Beside
that a drive is in one of a few modes: it runs, stands, turns freely, turns the other way, is slow,
or drags something. What the samples since a moment say of each mode, with how often each kind of
fault shows as which mode, gives a likelihood ratio of that kind to what is believed (mixture
densities: C. M. Bishop, Pattern Recognition and Machine Learning, 2006, section 2.3.9).

Telemetry may lie, and go on lying: samples are not independent of each other, and all of them
together count for at most `LOG_RATIO_MAX`. That alone names nothing.
"""

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.swim.control.contract import DriveTelemetry
from finlab.swim.control.jump_evidence import LOG_RATIO_MAX
from finlab.swim.control.motion_model import MotionModel


class Mode(NamedTuple):
    """How a drive may behave: its speed and its current, over those that it should have."""

    speed: float
    """Mean of the speed's share."""
    speed_std: float
    """Its standard deviation."""
    current: float
    """Mean of the share of the current that belongs to the speed."""
    current_std: float
    """Its standard deviation."""


MODES = (
    Mode(1.0, 0.12, 1.0, 0.3),  # runs
    Mode(0.0, 0.05, 1.0, 3.0),  # stands
    Mode(1.1, 0.2, 0.15, 0.15),  # turns freely: the propeller is gone
    Mode(-1.0, 0.15, 1.0, 0.3),  # turns the other way
    Mode(0.6, 0.2, 1.0, 0.3),  # slow, with the current of that speed
    Mode(0.65, 0.2, 2.5, 0.8),  # drags: slow, and with more current than that
    Mode(0.0, 1.5, 1.0, 3.0),  # anything
)
"""The modes of a drive."""
SPEED_MEAN, SPEED_STD, CURRENT_MEAN, CURRENT_STD = np.array(MODES).T
"""The numbers of all modes (7,), one by one."""
OTHER_WAY = 3
"""Index of the mode that only a signed speed shows."""
DRAGS = 5
"""Index of the mode of a fouled propeller."""
MODE_SHARES = np.array(
    [
        # runs, stands, free, other way, slow, drags, anything
        [0.2, 0.5, 0.2, 0.0, 0.0, 0.0, 0.1],  # lost
        [0.4, 0.0, 0.0, 0.5, 0.0, 0.0, 0.1],  # reversed
        [0.3, 0.0, 0.0, 0.0, 0.25, 0.3, 0.15],  # weak
        [0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.8],  # stuck
        [0.97, 0.0, 0.0, 0.0, 0.0, 0.0, 0.03],  # whole
    ]
)
"""How often each kind (5, in the order of `jump_evidence.KINDS`) shows as which mode."""
LOG_RATIO_MIN = -3.0
"""Least."""
NEVER = -1e9
"""Logarithm of the density of what cannot be."""
NO_FORCE = 1e-12
"""A number that is no divisor of any force [N]."""
SAME_S = 1e-6
"""Times as close as this are the same [s]."""
LEAST_ROOT = 0.1
"""Root of the share of the largest force from which on a speed is expected."""
LEAST_SPEED = 0.1
"""Share of the largest speed from which on a current is expected."""
SPEED_NOISE = 0.03
"""Standard deviation of a speed, over the largest."""
CURRENT_NOISE_A = 0.1
"""Standard deviation of a current [A]."""
SAMPLES_LAST_S = 0.3
"""Time in which what is off with a sample stays so, so that more samples say no more [s]."""
AGE_MAX_S = 1.0
"""A sample that is older says nothing [s]."""
LEARNED_SAMPLES = 20
"""So many samples make the scale of a drive known."""
ORDINARY_SHARE_MIN = 0.75
"""Samples whose share is within these two are learned from, as batteries sag."""
ORDINARY_SHARE_MAX = 1.33
LEARNING_SAMPLES = 300
"""How many samples the scale goes back on, once it is known."""
OWN_SCALE_MIN = 0.3
"""A drive whose scale is below this share of the others' median has that median: it never ran."""
RECENT_S = 3.0
"""Time by which what is said of a mode now goes back [s]."""
FOULED_LOG_ODDS = 3.0
"""Logarithm of the odds from which on a weak propeller is fouled."""


class DriveEvidence:
    """Weighs the telemetry of one robot's drives at moments that stand in slots."""

    def __init__(self, model: MotionModel, slots: int) -> None:
        """Has no samples.

        Args:
            model: of the robot.
            slots: how many moments are kept.
        """
        n = model.n
        self._model = model
        self._limits = model.force_limits
        self._sums = np.zeros((slots, n, len(MODES)))
        """Logarithms of likelihoods of the samples since each moment."""
        self._recent = np.zeros((n, len(MODES)))
        self._fouled = np.zeros(n, dtype=bool)
        self._taken_s = np.full(n, -1e9)
        self._forces: deque[tuple[float, Array]] = deque(maxlen=20)
        self._speed_fit = np.zeros((n, 2))  # sums of speed root, root^2
        self._current_fit = np.zeros((n, 2))  # sums of current v^3, v^6
        self._samples = np.zeros(n)
        self.has_samples = False
        """Whether there was any that counts."""

    def begin(self, slot: int) -> None:
        """A moment stands in a slot from now on."""
        self._sums[slot] = 0.0

    @property
    def fouled(self) -> NDArray[np.bool_]:
        """Which propellers (n,) are slow, and take more current than belongs to their speed."""
        return self._fouled

    def note_force(self, time_s: float) -> None:
        """Notes what the actuators should give now."""
        self._forces.append((time_s, self._model.motion.direction.copy()))

    def take(self, telemetry: DriveTelemetry, time_s: float) -> None:
        """Takes samples; each counts once.

        Args:
            telemetry: the newest samples.
            time_s: now, by the clock by which forces are noted [s].
        """
        taken_s = time_s - telemetry.ages
        is_new = np.isfinite(telemetry.speed) & (telemetry.ages <= AGE_MAX_S)
        is_new &= taken_s > self._taken_s + SAME_S
        force = self._forces_at(taken_s)
        largest = np.where(force > 0.0, self._limits[:, 1], -self._limits[:, 0])
        share_of_force = np.minimum(np.abs(force) / np.maximum(largest, NO_FORCE), 1.0)
        root = np.copysign(np.sqrt(share_of_force), force)
        is_new &= (np.abs(root) >= LEAST_ROOT) & (largest > 0.0)
        k = np.flatnonzero(is_new)
        if not len(k):
            return
        since_s = taken_s[k] - self._taken_s[k]
        self._taken_s[k] = taken_s[k]
        root = root[k]
        speed = telemetry.speed[k]
        if not telemetry.is_signed:
            root = np.abs(root)
            speed = np.abs(speed)
        current = telemetry.current[k]
        scale = self._scales()[k]
        is_known = scale > 0.0
        speed_share = np.where(is_known, speed / np.where(is_known, scale, 1.0), root)
        if is_known.any():
            self.has_samples = True
            weight = np.where(is_known, np.minimum(since_s / SAMPLES_LAST_S, 1.0), 0.0)
            densities = self._log_densities(k, speed_share, root, current)
            if not telemetry.is_signed:
                densities[:, OTHER_WAY] = NEVER
            self._weigh(k, weight[:, None] * densities, weight)
        ratio = speed_share / root
        is_ordinary = (ratio > ORDINARY_SHARE_MIN) & (ratio < ORDINARY_SHARE_MAX)
        self._learn(k[is_ordinary], speed[is_ordinary], root[is_ordinary], current[is_ordinary])

    def _forces_at(self, taken_s: Array) -> Array:
        """The forces of the actuators, each at its own time (n,), as far back as is known [N]."""
        result = self._forces[-1][1].copy()
        for noted_s, force in reversed(self._forces):
            is_earlier = noted_s >= taken_s - SAME_S
            if not is_earlier.any():
                break
            result = np.where(is_earlier, force, result)
        return result

    def _weigh(self, k: NDArray[np.intp], densities: Array, weight: Array) -> None:
        """Adds what samples of the drives k say of the modes, with their weights."""
        self._sums[:, k] += densities
        kept = np.exp(-weight * SAMPLES_LAST_S / RECENT_S)
        self._recent[k] = kept[:, None] * self._recent[k] + densities
        recent = self._recent[k]
        odds = recent[:, DRAGS] - np.delete(recent, DRAGS, axis=1).max(axis=1)
        is_sure = np.abs(odds) > FOULED_LOG_ODDS
        self._fouled[k] = np.where(is_sure, odds > 0.0, self._fouled[k])

    def _scales(self) -> Array:
        """The speeds (n,) of the drives at their largest forces; 0 where they are not known yet."""
        is_known = self._samples >= LEARNED_SAMPLES
        own = self._speed_fit[:, 0] / np.maximum(self._speed_fit[:, 1], 1e-12)
        if not is_known.any():
            return np.zeros_like(own)
        median = float(np.median(own[is_known]))
        scales = np.where(own < OWN_SCALE_MIN * median, median, own)
        return np.where(is_known, scales, 0.0)

    def _learn(self, k: NDArray[np.intp], speed: Array, root: Array, current: Array) -> None:
        """Learns the scales of the drives k from samples, by least squares."""
        kept = 1.0 - 1.0 / LEARNING_SAMPLES
        self._samples[k] += 1.0
        products = np.column_stack([np.abs(speed * root), root**2])
        self._speed_fit[k] = kept * self._speed_fit[k] + products
        has_current = np.isfinite(current)
        cube = np.abs(root[has_current]) ** 3
        products = np.column_stack([current[has_current] * cube, cube**2])
        with_current = k[has_current]
        self._current_fit[with_current] = kept * self._current_fit[with_current] + products

    def _log_densities(
        self, k: NDArray[np.intp], speed: Array, root: Array, current: Array
    ) -> Array:
        """Logarithms of the densities of samples in each mode (m, modes), but for a constant.

        Args:
            k: indices of the drives (m,).
            speed: over the largest (m,).
            root: what the speeds should be, over the largest (m,).
            current: (m,) [A]; NaN for none.
        """
        of_speed = _log_normal(speed[:, None], root[:, None], SPEED_MEAN, SPEED_STD, SPEED_NOISE)
        of_current, of_cube = self._current_fit[k].T
        counts = np.isfinite(current) & (np.abs(speed) > LEAST_SPEED) & (of_cube > 0.0)
        expected = of_current / np.maximum(of_cube, NO_FORCE) * np.abs(speed) ** 3
        by_current = _log_normal(
            current[:, None], expected[:, None], CURRENT_MEAN, CURRENT_STD, CURRENT_NOISE_A
        )
        return of_speed + np.where(counts[:, None], by_current, 0.0)

    def log_ratios(self, slots: NDArray[np.int32], believed: NDArray[np.int_]) -> Array:
        """Returns the logarithms of likelihood ratios of kinds to what is believed.

        Args:
            slots: of the moments (o,).
            believed: what each actuator is taken for (n,), index in `KINDS`.

        Returns:
            (o, n, 5), of all samples since each moment.
        """
        sums = self._sums[slots]
        top = sums.max(axis=-1, keepdims=True)
        likelihood = np.exp(sums - top) @ MODE_SHARES.T
        logarithm = np.log(np.maximum(likelihood, 1e-300))
        index = np.broadcast_to(believed[None, :, None], (*logarithm.shape[:2], 1))
        ratio = logarithm - np.take_along_axis(logarithm, index, axis=2)
        return np.asarray(np.clip(ratio, LOG_RATIO_MIN, LOG_RATIO_MAX))


def _log_normal(value: Array, expected: Array, mean: Array, std: Array, noise: float) -> Array:
    """Logarithms of normal densities of values about shares of what is expected, with a noise."""
    variance = (std * expected) ** 2 + noise**2
    return np.asarray(-0.5 * ((value - mean * expected) ** 2 / variance + np.log(variance)))
