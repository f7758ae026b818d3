"""From swims to a robot: what is fitted in which order, what helps on parts not seen, what is
known.

First all that every robot has; then, of fins, another law of thrust, which is kept only where it
lessens the error on windows that its fit has not seen.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

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

SURE = 3.0
"""Standard errors by which what is kept must lessen the error on windows not seen."""
UNTOLD = 0.7
"""Share of what was doubtful before that must be left for the data to have determined nothing."""
SOUND = 0.5
"""Least share of the motion that simulated swims should explain."""
MOVES = 1.5
"""Times the believed noise of a sensor by which its channel varies where the robot moves at all."""
WEAKLY_KNOWN = 0.1
"""Standard error of an actuator's strength beside those of the others, as a share, that is worth a
doubt."""
DEVIATION_RANGE = (0.1, 30.0)
"""Deviations of sensors within these multiples of what is believed."""
FAINT, CLEAR = 0.2, 20.0
"""Strength below which an actuator is tried as one that pushes the other way, and by how much the
logarithm of the likelihood must grow by that."""
NO_DOUBTS: Mapping[str, float] = {}
ROUNDS = 2
"""Times that deviations are estimated and the base fitted again."""


@dataclass(frozen=True)
class RobotFit:
    """A robot as its swims show it."""

    model: RobotModel
    fitted: WindowsFit
    explained: float
    other_law: bool | None
    """Whether another law of thrust lessens the error on windows not seen, and is used; None where
    none was tried."""
    unlikely: float = 0.0
    """Negative logarithm of the likelihood of what was measured, but for a constant."""
    opposed: tuple[str, ...] = ()
    """Actuators that push the other way than drawn; the layout of the model has them turned
    about."""

    @property
    def covariance(self) -> Array:
        """Of the unknowns (size, size), in scales: by the curvature of the cost, or by how much the
        windows differ where that is more."""
        inverse = np.linalg.inv(self.fitted.information)
        scores = self.fitted.scores
        spread = inverse @ (scores.T @ scores) @ inverse
        widen = np.sqrt(np.maximum(np.diag(spread) / np.diag(inverse), 1.0))
        return np.asarray(inverse * np.outer(widen, widen))

    @property
    def error(self) -> Array:
        """Standard errors (size,), in scales: 1 is what was doubtful before."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def part(self, name: str) -> Array | None:
        """What was found of one block (k,), in its own units; None where it is not used."""
        return self.fitted.unknowns.part(name, self.fitted.vector)

    def found(self, name: str) -> Array:
        """What was found of a block (k,) that every fit has, in its own units."""
        return self.fitted.unknowns.of(name, self.fitted.vector)

    def found_error(self, name: str) -> Array:
        """Standard errors (k,) of `found`, in the same units."""
        return self.fitted.unknowns.of(name, self.error)

    def untold(self) -> tuple[str, ...]:
        """What the data cannot tell of the robot: nearly as doubtful as before."""
        unknowns = self.fitted.unknowns
        error = self.error
        error[unknowns.place("delay")] = 0.0  # of the sensors, and no part of a layout
        return tuple(
            label for label, own in zip(unknowns.labels, error, strict=True) if own > UNTOLD
        )

    def doubts(self) -> tuple[str, ...]:
        """Why the fit should not be trusted; empty where it may."""
        clauses = []
        if self.explained < SOUND:
            share = f"{self.explained:.0%} of the motion, expected at least {SOUND:.0%}"
            clauses.append(f"simulated swims explain {share}")
        names = self.model.layout.names
        place = self.fitted.unknowns.place("strength")
        n = len(names)
        centered = self.fitted.unknowns.scale[place] * (np.eye(n) - (1.0 / n if n > 1 else 0.0))
        covariance = centered @ self.covariance[place, place] @ centered.T
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

    The layout is what the robot is believed to be; what its body does not say is U-CAT's. With
    `other_law` robots of fins are tried with another law of thrust, too. `progress` is called
    before each step; `doubts` are factors of how far some blocks of unknowns may be off, by name.
    Raises DataError: there is no swim, or the fit goes astray."""
    if not swims:
        raise DataError("expected at least one swim, got none")
    smooth = np.concatenate([smoothed(swim.measured) for swim in swims])
    with threadpool_limits(limits=1, user_api="blas"):

        def fitted(opposed: tuple[str, ...]) -> RobotFit:
            model = RobotModel(opposed_in(layout, opposed), swims, doubts)
            fit = _fit(model, swims, smooth, other_law and layout.is_of_fins, progress)
            return replace(fit, opposed=opposed)

        best = fitted(pushing_back(RobotModel(layout, swims, doubts), swims, smooth))
        while (strength := best.found("strength")).min() < np.log(FAINT):
            weak = int(strength.argmin())
            turned = (
                name for k, name in enumerate(layout.names) if (name in best.opposed) != (k == weak)
            )
            try:
                fit = fitted(tuple(turned))
            except DataError:  # it goes astray
                break
            if fit.found("strength")[weak] < np.log(FAINT) or fit.unlikely > best.unlikely - CLEAR:
                break
            best = fit
        return best


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
    model.meet(smooth[:, 6:])
    unknowns = Unknowns(model.blocks, BASE)
    deviation = DEVIATION

    def fit(vector: Array, start: Array, what: str) -> WindowsFit:
        nonlocal deviation
        for _ in range(ROUNDS):
            tell(f"fitting {what}")
            fitted = fit_windows(model, unknowns, windows, deviation, vector, start)
            vector = fitted.vector
            start = fitted.start
            deviation = _deviation(fitted, deviation)
            _keep_delays(model, fitted)
        return fitted

    fitted = fit(np.zeros(unknowns.size), windows.start, "actuators and body")
    helps = None
    if other_law:
        tell("looking for another law of thrust")
        gain = unseen_gain(model, fitted, windows, deviation, SHAPE)
        helps = bool(gain.mean() > SURE * sem(gain))
    if helps:
        unknowns = Unknowns(model.blocks, (*BASE, SHAPE))
        vector = np.pad(fitted.vector, (0, unknowns.size - len(fitted.vector)))
        fitted = fit(vector, fitted.start, "another law of thrust")
    deviation = _deviation(fitted, deviation)
    _keep_delays(model, fitted)
    tell("fitting all together")
    fitted = fit_windows(model, fitted.unknowns, windows, deviation, fitted.vector, fitted.start)
    if not np.isfinite(fitted.vector).all():
        raise DataError(
            f"{swims[0].name}: the fit goes astray; is the layout that of the robot that swam?"
        )
    said = np.isfinite(fitted.residual).sum(axis=(0, 2))
    unlikely = float(fitted.cost[0] + said @ np.log(deviation))
    return RobotFit(model, fitted, _explained(fitted, windows), helps, unlikely)


def _deviation(fitted: WindowsFit, deviation: Array) -> Array:
    """Deviations (12,) of the channels by what is left over, outliers aside."""
    left = np.abs(fitted.residual)
    scale = DEVIATION.copy()
    for k in range(12):
        said = left[:, k][np.isfinite(left[:, k])]
        if len(said):
            usual = said[said <= 5.0 * 1.4826 * max(float(np.median(said)), 1e-6)]
            scale[k] = deviation[k] * float(np.sqrt(np.mean(usual**2)))
    return np.asarray(
        np.clip(scale, DEVIATION_RANGE[0] * DEVIATION, DEVIATION_RANGE[1] * DEVIATION)
    )


def _keep_delays(model: RobotModel, fitted: WindowsFit) -> None:
    model.late = [
        round(float(delay) / STEP_S) for delay in fitted.unknowns.of("delay", fitted.vector)
    ]


def _explained(fitted: WindowsFit, windows: Windows) -> float:
    """Share of the motion's variance within windows that the simulated swims explain, mean over
    channels of velocity and rates, or of pose where those are not measured, that change by more
    than noise."""
    known = np.asarray(np.isfinite(windows.measured).any(axis=(0, 2)))
    channels = (
        np.flatnonzero(known & (np.arange(12) >= 6)) if known[6:].any() else np.flatnonzero(known)
    )
    shares = []
    for k in channels:
        said = windows.measured[:, k]
        away = np.nanmean((said - fitted.state[:, k]) ** 2)
        variance = np.nanvar(said - np.nanmean(said, axis=0))
        if variance > (MOVES * DEVIATION[k]) ** 2:
            shares.append(max(0.0, 1.0 - float(away) / float(variance)))
    return float(np.mean(shares)) if shares else 0.0
