"""From swims to a robot: what is fitted in which order, what helps on parts not seen, what is
known.

First all that every robot has; then, of fins, another law of thrust, which is kept only where it
lessens the error on windows that its fit has not seen.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np
from scipy.stats import sem
from threadpoolctl import threadpool_limits

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.swim.identification.estimate import (
    DEVIATION,
    Windows,
    WindowsFit,
    cut,
    fit_windows,
    unseen_gain,
)
from finlab.swim.identification.robot_model import RobotModel, opposed_in, pushing_back
from finlab.swim.identification.swim import STEP_S, Swim, smoothed
from finlab.swim.identification.unknowns import BASE, SHAPE, Unknowns

UNSEEN_GAIN_ERRORS = 3.0
"""Standard errors by which what is kept must lessen the error on windows not seen."""
UNDETERMINED = 0.7
"""Share of what was doubtful before that must be left for the data to have determined nothing."""
EXPLAINED_MIN = 0.5
"""Least share of the motion that simulated swims should explain."""
MOVING_NOISE = 1.5
"""Times the believed noise of a sensor by which its channel varies where the robot moves at all."""
WEAKLY_KNOWN = 0.1
"""Standard error of an actuator's strength beside those of the others, as a share, that is worth a
doubt."""
MEDIAN_TO_DEVIATION = 1.4826
"""Standard deviation of normal noise, over the median of its size."""
OUTLIER_DEVIATIONS = 5.0
"""Deviations from which on a residual is an outlier."""
DEVIATION_RANGE = (0.1, 30.0)
"""Deviations of sensors within these multiples of what is believed."""
REVERSED_STRENGTH = 0.2
"""Strength below which an actuator is tried as one that pushes the other way."""
REVERSED_GAIN = 20.0
"""By how much the logarithm of the likelihood must grow by that."""
NO_DOUBTS: Mapping[str, float] = {}
"""Every block of unknowns is as doubtful as `blocks_of` says."""
DEVIATION_ROUNDS = 2
"""Times that deviations are estimated and the base fitted again."""


@dataclass(frozen=True)
class RobotFit:
    """A robot as its swims show it."""

    model: RobotModel
    """The robot, as `opposed` turned it, and its swims."""
    fitted: WindowsFit
    """Unknowns of the robot, and the normal equations there."""
    explained: float
    """Share of the motion that simulated swims explain."""
    other_law: bool | None
    """Whether another law of thrust lessens the error on windows not seen, and is used; None where
    none was tried."""
    negative_log_likelihood: float = 0.0
    """Negative logarithm of the likelihood of what was measured, but for a constant."""
    opposed: tuple[str, ...] = ()
    """Actuators that push the other way than drawn; the layout of the model has them turned
    about."""

    @property
    def covariance(self) -> Array:
        """Of the unknowns (size, size), in scales: by the curvature of the cost, or by how much the
        windows differ where that is more."""
        # The sandwich H^-1 (sum of g g^T) H^-1 over the windows' scores g, where it is larger.
        H_inverse = np.linalg.inv(self.fitted.information)
        scores = self.fitted.scores
        sandwich = H_inverse @ (scores.T @ scores) @ H_inverse
        factor = np.sqrt(np.maximum(np.diag(sandwich) / np.diag(H_inverse), 1.0))
        return np.asarray(H_inverse * np.outer(factor, factor))

    @property
    def standard_errors(self) -> Array:
        """Standard errors (size,), in scales: 1 is what was doubtful before."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def optional_estimate(self, name: str) -> Array | None:
        """As `estimate`; None where the block is not used."""
        return self.fitted.unknowns.optional_block(name, self.fitted.vector)

    def estimate(self, name: str) -> Array:
        """The unknowns of one block (k,), in its own units."""
        return self.fitted.unknowns.block(name, self.fitted.vector)

    def standard_error(self, name: str) -> Array:
        """Standard errors (k,) of `estimate`, in the same units."""
        return self.fitted.unknowns.block(name, self.standard_errors)

    def undetermined(self) -> tuple[str, ...]:
        """What the data cannot tell of the robot: nearly as doubtful as before."""
        unknowns = self.fitted.unknowns
        error = self.standard_errors.copy()
        error[unknowns.slice_of("delay")] = 0.0  # of the sensors, and no part of a layout
        is_undetermined = (error > UNDETERMINED).tolist()
        return tuple(compress(unknowns.labels, is_undetermined))

    def doubts(self) -> tuple[str, ...]:
        """Why the fit should not be trusted; empty where it may."""
        clauses = []
        if self.explained < EXPLAINED_MIN:
            share = f"{self.explained:.0%} of the motion, expected at least {EXPLAINED_MIN:.0%}"
            clauses.append(f"simulated swims explain {share}")
        names = self.model.layout.names
        strengths = self.fitted.unknowns.slice_of("strength")
        n = len(names)
        # Of each strength less the mean of all, which motion cannot tell.
        centering = np.eye(n) - (1.0 / n if n > 1 else 0.0)
        to_centered = self.fitted.unknowns.scale[strengths] * centering
        covariance = to_centered @ self.covariance[strengths, strengths] @ to_centered.T
        for name, error in zip(names, np.sqrt(np.diag(covariance)), strict=True):
            if error > WEAKLY_KNOWN:
                clauses.append(
                    f"the strength of {name} is known to {error:.0%} only; swim with it at work"
                )
        return tuple(clauses)


def fit_robot(
    layout: Layout,
    swims: Sequence[Swim],
    other_law: bool = True,
    progress: Callable[[str], None] = lambda words: None,
    doubts: Mapping[str, float] = NO_DOUBTS,
) -> RobotFit:
    """Learns a robot from swims. The linear algebra runs on one thread.

    Args:
        layout: what the robot is believed to be; what its body does not say is U-CAT's.
        swims: what its actuators did and its sensors said.
        other_law: whether robots of fins are tried with another law of thrust, too.
        progress: called before each step, with what is done in words.
        doubts: block of unknowns to the factor by which it may be farther off.

    Raises:
        DataError: there is no swim, or the fit diverges.
    """
    if not swims:
        raise DataError("expected at least one swim, got none")
    smooth = np.concatenate([smoothed(swim.measured) for swim in swims])
    with threadpool_limits(limits=1, user_api="blas"):

        def fitted(opposed: tuple[str, ...]) -> RobotFit:
            model = RobotModel(opposed_in(layout, opposed), swims, doubts)
            fit = _fit(model, swims, smooth, other_law and layout.is_of_fins, progress)
            return replace(fit, opposed=opposed)

        best = fitted(pushing_back(RobotModel(layout, swims, doubts), swims, smooth))
        while best.estimate("strength").min() < np.log(REVERSED_STRENGTH):
            weak = int(best.estimate("strength").argmin())
            try:
                fit = fitted(_toggled(layout.names, best.opposed, layout.names[weak]))
            except DataError:  # it diverges
                break
            if (
                fit.estimate("strength")[weak] < np.log(REVERSED_STRENGTH)
                or fit.negative_log_likelihood > best.negative_log_likelihood - REVERSED_GAIN
            ):
                break
            best = fit
        return best


def _toggled(names: Sequence[str], opposed: Sequence[str], name: str) -> tuple[str, ...]:
    """The opposed actuators with one more or one less, in the order of all names."""
    return tuple(each for each in names if (each in opposed) != (each == name))


def _fit(
    model: RobotModel,
    swims: Sequence[Swim],
    smooth: Array,
    other_law: bool,
    tell: Callable[[str], None],
) -> RobotFit:
    """Fits actuators and body to swims, of which smoothed measurements (M, 12) tell where to
    begin."""
    measured = np.concatenate([swim.measured for swim in swims])
    windows = cut([len(swim) for swim in swims], measured, smooth)
    model.set_flow(smooth[:, 6:])
    unknowns = Unknowns(model.blocks, BASE)
    deviation = DEVIATION

    def fit(vector: Array, start: Array, what: str) -> WindowsFit:
        nonlocal deviation
        for _ in range(DEVIATION_ROUNDS):
            tell(f"fitting {what}")
            fitted = fit_windows(model, unknowns, windows, deviation, vector, start)
            vector = fitted.vector
            start = fitted.start
            deviation = _deviation(fitted, deviation)
            _set_delay_steps(model, fitted)
        return fitted

    fitted = fit(np.zeros(unknowns.size), windows.start, "actuators and body")
    helps = None
    if other_law:
        tell("looking for another law of thrust")
        gain = unseen_gain(model, fitted, windows, deviation, SHAPE)
        helps = bool(gain.mean() > UNSEEN_GAIN_ERRORS * sem(gain))
    if helps:
        unknowns = Unknowns(model.blocks, (*BASE, SHAPE))
        vector = np.pad(fitted.vector, (0, unknowns.size - len(fitted.vector)))
        fitted = fit(vector, fitted.start, "another law of thrust")
    deviation = _deviation(fitted, deviation)
    _set_delay_steps(model, fitted)
    tell("fitting all together")
    fitted = fit_windows(model, fitted.unknowns, windows, deviation, fitted.vector, fitted.start)
    if not np.isfinite(fitted.vector).all():
        raise DataError(
            f"{swims[0].name}: the fit goes astray; is the layout that of the robot that swam?"
        )
    n_measured = np.isfinite(fitted.residual).sum(axis=(0, 2))  # of each channel (12,)
    return RobotFit(
        model=model,
        fitted=fitted,
        explained=_explained(fitted, windows),
        other_law=helps,
        negative_log_likelihood=float(fitted.cost[0] + n_measured @ np.log(deviation)),
    )


def _deviation(fitted: WindowsFit, deviation: Array) -> Array:
    """Deviations (12,) of the channels by their residuals, outliers aside.

    Args:
        fitted: with residuals in the deviations of before.
        deviation: those (12,).
    """
    result = DEVIATION.copy()
    for k in range(12):
        size = np.abs(fitted.residual[:, k])
        size = size[np.isfinite(size)]
        if not len(size):
            continue
        robust_deviation = MEDIAN_TO_DEVIATION * max(float(np.median(size)), 1e-6)
        inliers = size[size <= OUTLIER_DEVIATIONS * robust_deviation]
        result[k] = deviation[k] * float(np.sqrt(np.mean(inliers**2)))
    least, most = DEVIATION_RANGE
    return np.asarray(np.clip(result, least * DEVIATION, most * DEVIATION))


def _set_delay_steps(model: RobotModel, fitted: WindowsFit) -> None:
    """Has the model simulate late sensors about the delays that were found."""
    model.delay_steps = [
        round(float(delay) / STEP_S) for delay in fitted.unknowns.block("delay", fitted.vector)
    ]


def _explained(fitted: WindowsFit, windows: Windows) -> float:
    """Share of the motion's variance within windows that the simulated swims explain, mean over
    channels of velocity and rates, or of pose where those are not measured, that change by more
    than noise."""
    known = np.asarray(np.isfinite(windows.measured).any(axis=(0, 2)))
    if known[6:].any():
        known = known & (np.arange(12) >= 6)
    shares = []
    for k in np.flatnonzero(known):
        measured = windows.measured[:, k]
        squared_error = np.nanmean((measured - fitted.state[:, k]) ** 2)
        variance = np.nanvar(measured - np.nanmean(measured, axis=0))
        if variance > (MOVING_NOISE * DEVIATION[k]) ** 2:
            shares.append(max(0.0, 1.0 - float(squared_error) / float(variance)))
    return float(np.mean(shares)) if shares else 0.0
