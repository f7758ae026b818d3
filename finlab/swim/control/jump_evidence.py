"""Likelihood of jumps of a robot's state: that an actuator has come to be lost, weak or stuck at
some moment, that two were lost at once, or that a wrench pulls that no fault explains.

What the filter of `hypotheses.py` has gathered about each jump is its information Lambda and its
score eta. A jump delta with the prior N(m, C) then has the log likelihood ratio

    eta^T m - m^T Lambda m / 2 + r^T (1 + C Lambda)^-1 C r / 2 - log det(1 + C Lambda) / 2

with r = eta - Lambda m, compared with none. The core computes it (finlab/core/src/jump_evidence.c).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core import library
from finlab.core.shared_array import SharedArray
from finlab.swim.control.monitor_settings import MonitorSettings
from finlab.swim.control.motion_model import MotionModel

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
NEAR_TARGET = next(j for j, target in enumerate(TARGETS) if target.held == "near")
"""Index of the target that sticks as it was."""
REVERSED_TARGET = next(j for j, target in enumerate(TARGETS) if target.kind == REVERSED)
"""Index of the target that pushes the other way."""
REVERSED_AT_ANGLE = 0.05
"""How often fins and pods, which turn, come to push the other way, as a share of how often others
do."""
OF_KIND = [np.flatnonzero([target.kind == kind for target in TARGETS]) for kind in range(5)]
"""Targets of each kind."""
STICKING = {"": 0.0, "near": 1.0, "any": 2.0}
"""How a target sticks, as a number in the core."""
PAIR_SHARE = 0.1
"""How often two given actuators are lost at one moment (a cable, a collision), as a share of how
often one is."""
LOG_RATIO_MAX = 5.5
"""Most that what drives say of a fault counts for: it alone names nothing."""
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
TEMPER = 0.5
"""By what logarithms of likelihoods are divided as the misfit grows: 1 and so much per its
logarithm."""
ONSET_EVERY_S = 0.1
"""Least time between the moments at which a jump may have happened [s]."""
ONSETS = 13
"""How many of them are kept."""


_Gathered = tuple[int, int, int, int]
"""Addresses of the information, of the scores and of the slots of gathered jumps, and how many
slots there are: the first arguments of the core's functions."""


class GatheredJumps(NamedTuple):
    """What is known of the jumps at each moment; the moments stand in slots."""

    information: SharedArray
    """Lambda (slots, c, c)."""
    score: SharedArray
    """eta (slots, c)."""
    strength: SharedArray
    """What was taken for the strengths then (slots, n)."""
    held: SharedArray
    """The same of what stuck ones give (slots, h)."""
    motion: SharedArray
    """What each actuator would have given on had it stuck then (slots, h)."""


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
    span: Array
    """Logarithms of the times that the onsets stand for (o,)."""
    by_kind: Array
    """Of each kind of fault of each actuator, over all onsets (n, 5)."""
    of_pairs: Array
    """Of two losses at one moment, over all onsets (n, n)."""


class LogSums:
    """Logarithms of sums of exponentials over the rows of a table and over groups of columns."""

    def __init__(self, groups: NDArray[np.int32]) -> None:
        """Takes the group of each column (width,), numbered from 0."""
        self._groups = groups
        self._groups_address = groups.ctypes.data
        count = int(groups.max()) + 1
        self._tops = SharedArray(np.zeros(count))
        self._sums = SharedArray(np.zeros(count))

    def of(self, values: SharedArray, rows: int) -> Array:
        """Returns the logarithms (groups,) of the first rows of a table (..., width)."""
        library().fl_log_sums(
            values.address,
            rows,
            len(self._groups),
            self._groups_address,
            len(self._sums.array),
            self._tops.address,
            self._sums.address,
        )
        return self._sums.array.copy()


class JumpEvidence:
    """Weighs the jumps of one robot. Their columns are strengths, what stuck ones give, and a
    wrench."""

    def __init__(
        self,
        model: MotionModel,
        settings: MonitorSettings,
        jumps: GatheredJumps,
        jolt_variance: Array,
    ) -> None:
        """Prepares for a robot.

        Args:
            model: of it.
            settings: how often faults are expected.
            jumps: what the filter writes.
            jolt_variance: of a wrench that no fault explains (6,) [N^2, N^2 m^2].
        """
        self._model = model
        self._settings = settings
        self._jumps = jumps
        n = model.n
        t = len(TARGETS)
        self._n_columns = n + model.n_held + 6
        share = np.tile([target.share for target in TARGETS], (n, 1))
        share[model.sticks_at_angle, REVERSED_TARGET] *= REVERSED_AT_ANGLE
        self._log_rate = np.log(share * settings.failures)
        self._log_rate_of_pairs = math.log(settings.failures * TARGETS[0].share * PAIR_SHARE)
        self._target_strength = np.array([target.strength for target in TARGETS])
        self._is_stuck = np.flatnonzero([bool(target.held) for target in TARGETS])
        self._sticks = model.sticks[:, None]
        # In the orders of `actuator_numbers`, `target_numbers`, `spread_numbers` in the core's
        # jump_evidence.c.
        actuators = np.zeros((n, 4))
        for k in range(n):
            own = model.held_of[k]
            actuators[k, 0] = 1 + len(own)
            actuators[k, 1] = own[0] if len(own) else 0
        actuators[:, 2] = model.sticks_at_angle
        actuators[:, 3] = model.force_max
        self._actuators = SharedArray(actuators)
        self._targets = SharedArray(
            [[each.strength, each.strength_std**2, STICKING[each.held]] for each in TARGETS]
        )
        self._spread = SharedArray(
            [NEAR_SHARE, NEAR_FLOOR, NEAR_ANGLE, FAR_SHARE, FAR_ANGLE, NOTHING_SHARE]
        )
        self._jolt_variance = SharedArray(jolt_variance)
        # Where the core reads the arguments of one call and writes what it returns.
        self._prior = SharedArray(np.zeros((n, t)))
        self._span = SharedArray(np.zeros(ONSETS))
        self._works = np.zeros(n, dtype=np.int32)
        self._log_odds = SharedArray(np.zeros((ONSETS, n, t)))
        self._mean = SharedArray(np.zeros((ONSETS, n, t, 3)))
        self._variance = SharedArray(np.zeros((ONSETS, n, t, 3)))
        self._both = SharedArray(np.zeros((ONSETS, n, n)))
        self._jolt = SharedArray(np.zeros(ONSETS))
        self._kinds = np.array([target.kind for target in TARGETS])
        groups = len(KINDS) * np.arange(n)[:, None] + self._kinds
        self._sum_kinds = LogSums(groups.ravel().astype(np.int32))
        self._sum_pairs = LogSums(np.arange(n * n, dtype=np.int32))

    def now(
        self,
        slots: NDArray[np.int32],
        age: Array,
        strength: Array,
        held: Array,
        misfit: float,
        of_drives: Array | None = None,
    ) -> Evidence:
        """Weighs all jumps.

        Args:
            slots: of the onsets, the oldest first (o,).
            age: of them (o,) [s].
            strength: what is taken for the strengths now (n,).
            held: the same of what stuck ones give (h,).
            misfit: how many times as much (a variance) the motion is disturbed as expected.
            of_drives: logarithms of likelihood ratios of what drives say of each kind (o, n, 5), to
                what is believed; None where they say nothing.
        """
        n = self._model.n
        o = len(slots)
        # Each onset stands for the time since the one before it.
        gaps = age - np.append(age[1:], 0.0)
        self._span.array[:o] = np.log(np.maximum(gaps, 0.5 * ONSET_EVERY_S))
        # Where the noise is not as assumed, it is not white either, and counts for less.
        temper = 1.0 + TEMPER * math.log(misfit)
        self._prior.array[:] = np.where(self._possible(strength, held), self._log_rate, -np.inf)
        self._works[:] = strength > 0.5
        jumps = self._jumps
        gathered: _Gathered = (jumps.information.address, jumps.score.address, slots.ctypes.data, o)
        self._weigh_actuators(gathered, temper)
        self._weigh_pairs(gathered, temper)
        self._weigh_wrench(gathered, temper)
        if of_drives is not None:
            self._add(of_drives)
        return Evidence(
            log_odds=self._log_odds.array[:o].copy(),
            jolt=self._jolt.array[:o].copy(),
            both=self._both.array[:o].copy(),
            mean=self._mean.array[:o],
            variance=self._variance.array[:o],
            span=self._span.array[:o].copy(),
            by_kind=self._sum_kinds.of(self._log_odds, o).reshape(n, len(KINDS)),
            of_pairs=self._sum_pairs.of(self._both, o).reshape(n, n),
        )

    def _weigh_actuators(self, gathered: _Gathered, temper: float) -> None:
        """Weighs jumps of one actuator each."""
        jumps = self._jumps
        library().fl_jumps_of_actuators(
            *gathered,
            self._n_columns,
            self._actuators.address,
            self._model.n,
            self._model.n_held,
            self._targets.address,
            len(TARGETS),
            self._spread.address,
            jumps.strength.address,
            jumps.held.address,
            jumps.motion.address,
            self._prior.address,
            self._span.address,
            temper,
            self._log_odds.address,
            self._mean.address,
            self._variance.address,
        )

    def _weigh_pairs(self, gathered: _Gathered, temper: float) -> None:
        """Weighs the loss of two actuators at once."""
        library().fl_jumps_of_pairs(
            *gathered,
            self._n_columns,
            self._model.n,
            self._jumps.strength.address,
            self._works.ctypes.data,
            self._span.address,
            self._log_rate_of_pairs,
            temper,
            self._both.address,
        )

    def _weigh_wrench(self, gathered: _Gathered, temper: float) -> None:
        """Weighs an unknown wrench that begins at once."""
        library().fl_jumps_of_wrench(
            *gathered,
            self._n_columns,
            self._jolt_variance.address,
            self._span.address,
            math.log(self._settings.jolts),
            temper,
            self._jolt.address,
        )

    def _add(self, of_drives: Array) -> None:
        """Adds logarithms of likelihood ratios (o, n, 5) that do not come from the motion."""
        o = len(of_drives)
        self._log_odds.array[:o] += of_drives[:, :, self._kinds]
        lost = of_drives[:, :, LOST]
        # One bus may lie for both.
        of_both = np.minimum(lost[:, :, None] + lost[:, None, :], LOG_RATIO_MAX)
        self._both.array[:o] += of_both

    def _possible(self, strength: Array, held: Array) -> NDArray[np.bool_]:
        """Which targets (n, t) an actuator may come to."""
        model = self._model
        result = np.abs(self._target_strength - strength[:, None]) > DISTANCE_MIN
        if held.any():
            is_held = np.zeros(model.n, dtype=bool)
            is_held[model.held_owner[held != 0.0]] = True
            result[is_held] = True
            result[:, self._is_stuck] = (model.sticks & ~is_held)[:, None]
        else:
            result[:, self._is_stuck] = self._sticks
        return result
