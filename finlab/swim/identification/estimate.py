"""Output error over short windows: unknowns with which simulated swims come nearest to the measured
ones.

A swim is cut into windows of some seconds, and each begins in a state of its own, which is looked
for, too: noise of sensors then biases nothing, and no error grows for longer than a window
(multiple shooting, see L. Ljung, System Identification, 2nd ed., and H. G. Bock 1983). Gauss-Newton
steps with Levenberg's damping; derivatives by differences, all swims integrated side by side; the
windows' states are eliminated from the normal equations. Each unknown is believed to lie within its
scale of what the layout says.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.least_squares import Damping, levenberg_marquardt
from finlab.swim.identification.robot_model import RobotModel
from finlab.swim.identification.swim import ANGLES, STEP_S
from finlab.swim.identification.unknowns import BASE, Unknowns
from finlab.swim.vehicle.fossen import Dynamics
from finlab.swim.vehicle.many_bodies import integrate

WINDOW = 80
"""Steps of a window."""
DEVIATION = np.array([0.02, 0.02, 0.01, 0.01, 0.01, 0.02, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01])
"""What is believed of the sensors' noise [m, rad, m/s, rad/s] before their residuals tell."""
START_DEVIATION = np.array([0.1] * 3 + [0.1] * 3 + [0.1] * 3 + [0.2] * 3)
"""How far a window may begin from the smoothed measurements."""
DIFFERENCE = 1e-3
MOST_STEPS = 16
DAMPING = Damping(first=1e-3, better=0.1, worse=(10.0, 0.0), least=1e-6, most=1e6)
SETTLED = 1e-4
"""Relative gain below which they end."""
FOLDS = 6
"""Parts into which windows are dealt for cross-validation."""
CLIP = 4.0
"""Residuals beyond this many deviations count like this many: a rare outlier must not rule."""


class Windows(NamedTuple):
    """W windows of L steps: which of all swims each step is (W, L), measurements (L, 12, W), NaN
    where a swim does not fill them, and the smoothed state at the beginning (12, W)."""

    step: NDArray[np.intp]
    measured: Array
    start: Array


@dataclass(frozen=True)
class Fitted:
    """Unknowns, a vector (size,) in scales, and the problem near them, the windows' beginnings
    eliminated."""

    unknowns: Unknowns
    vector: Array
    start: Array
    """States in which the windows begin (12, W)."""
    cost: Array
    """Half the sum of squares (1,), whose gradient (size,), downwards, and second derivatives by
    the unknowns (size, size), with what was believed before, are next."""
    gradient: Array
    information: Array
    own_information: Array
    """What each window brings to the second derivatives (W, size, size), and to the gradient (W,
    size)."""
    scores: Array
    residual: Array
    """Measured less simulated, in deviations (L, 12, W), NaN where nothing was measured; simulated
    states."""
    state: Array
    inner: Array
    """Inverse second derivatives by the beginnings (W, 12, 12), those by beginnings and unknowns
    (W, 12, size), and the gradient by the beginnings (W, 12), downwards."""
    mixed: Array
    pull: Array

    def step(self, damping: float) -> tuple[Array, Array]:
        """Changes of the unknowns (size,) and of the beginnings (12, W)."""
        damped = self.information + damping * np.diag(np.diag(self.information))
        change = np.asarray(np.linalg.solve(damped, self.gradient), np.float64)
        pull = self.pull - self.mixed @ change
        return change, (self.inner @ pull[..., None])[..., 0].T * START_DEVIATION[:, None]


def cut(n_steps: list[int], measured: Array, smooth: Array) -> Windows:
    """Windows of swims of so many steps each; measurements (M, 12) and smoothed ones (M, 12)."""
    steps = []
    begin = 0
    for count in n_steps:
        n = max(1, round(count / WINDOW))
        steps += [begin + count // n * k + np.arange(count // n) for k in range(n)]
        begin += count
    own = np.array([len(one) for one in steps])
    longest = own.max()
    padded = np.array([np.pad(one, (0, longest - len(one)), "edge") for one in steps])
    values = np.where((np.arange(longest) < own[:, None])[..., None], measured[padded], np.nan)
    return Windows(padded, np.moveaxis(values, 0, -1), smooth[padded[:, 0]].T.copy())


def fit_windows(
    model: RobotModel,
    unknowns: Unknowns,
    windows: Windows,
    deviation: Array,
    vector: Array,
    start: Array,
) -> Fitted:
    """Unknowns from windows, by the standard deviation of each channel (12,), from a vector (size,)
    on and from the beginnings of the windows `start` (12, W)."""
    problem = _Problem(model, unknowns, windows, deviation)

    def moved(at: Fitted, damping: Array, last: bool) -> Fitted:
        change, shift = at.step(float(damping[0]))
        with np.errstate(all="ignore"):  # a step too far may make a robot take off
            return problem.at(at.vector + change, at.start + shift)

    return levenberg_marquardt(problem.at(vector, start), moved, MOST_STEPS, DAMPING, SETTLED)


def unseen_gain(
    model: RobotModel, fitted: Fitted, windows: Windows, deviation: Array, name: str
) -> Array:
    """By how much a block beside `BASE` would lessen half the squared residuals of windows not seen
    (W,).

    Cross-validation to second order about the fit: the windows are dealt to some folds, and the
    normal equations of all windows but those of a fold tell the change of the unknowns, with the
    block and without.
    """
    more = Unknowns(model.blocks, (*BASE, name))
    vector = np.pad(fitted.vector, (0, more.size - len(fitted.vector)))
    at = _Problem(model, more, windows, deviation).at(vector, fitted.start)
    believed = more.believed
    fold = np.arange(windows.start.shape[1]) % FOLDS
    known = np.ones(more.size, bool)
    known[more.place(name)] = False

    def gain(chosen: NDArray[np.bool_]) -> Array:
        """What windows gain by changes of the chosen unknowns that the others ask for (W,)."""
        gains = np.empty(len(fold))
        here = np.flatnonzero(chosen)
        for k in range(FOLDS):
            seen = fold != k
            unseen = np.flatnonzero(fold == k)
            information = at.own_information[seen].sum(axis=0) + believed
            pull = at.scores[seen].sum(axis=0) - believed @ vector
            change = np.linalg.solve(information[np.ix_(here, here)], pull[here])
            own = at.own_information[np.ix_(unseen, here, here)]
            gains[unseen] = at.scores[np.ix_(unseen, here)] @ change - 0.5 * (own @ change) @ change
        return gains

    return gain(np.ones_like(known)) - gain(known)


@dataclass(frozen=True)
class _Problem:
    """What is looked for, and what it is held against."""

    model: RobotModel
    unknowns: Unknowns
    windows: Windows
    deviation: Array

    def at(self, vector: Array, start: Array) -> Fitted:
        """The problem at unknowns (size,) and beginnings (12, W), derivatives by differences."""
        n = self.unknowns.size
        windows = self.windows
        unknowns = self.unknowns
        vectors = np.concatenate([vector[None], vector + DIFFERENCE * np.eye(n)])
        n_all = 1 + n + 12
        w = start.shape[1]
        wrench = self._wrenches(vectors)
        wrench = np.concatenate([wrench, np.repeat(wrench[:, :, :1], 12, axis=2)], axis=2)
        vectors = np.concatenate([vectors, np.repeat(vector[None], 12, axis=0)])
        begin = np.repeat(start[:, None], n_all, axis=1)
        for k in range(12):
            begin[k, 1 + n + k] += DIFFERENCE * START_DEVIATION[k]
        bodies = Dynamics(*(part[..., None] for part in self.model.bodies(unknowns, vectors)))
        state = integrate(
            begin, wrench, bodies, unknowns.of("current", vectors).T[..., None], STEP_S
        )
        sensed = self.model.sensed(unknowns, vectors, state)
        away = windows.measured - sensed[:, :, 0]
        away[:, ANGLES] = wrapped(away[:, ANGLES])
        residual = np.asarray(away / self.deviation[:, None])
        left, weight = _huber(residual)
        slopes = (sensed[:, :, 1:] - sensed[:, :, :1]) / DIFFERENCE
        slopes *= (weight / self.deviation[:, None])[:, :, None]
        by = (
            np.moveaxis(slopes, (2, 3), (0, 1)).reshape(n + 12, w, -1).swapaxes(0, 1)
        )  # (W, n + 12, L 12)
        r = np.moveaxis(left, 2, 0).reshape(w, -1)
        scaled = by[:, n:]
        begun = (start - windows.start).T / START_DEVIATION
        pull = np.einsum("wkm,wm->wk", scaled, r) - begun
        inner = np.asarray(np.linalg.inv(scaled @ scaled.swapaxes(1, 2) + np.eye(12)), np.float64)
        mixed = scaled @ by[:, :n].swapaxes(1, 2)
        own = by[:, :n] @ by[:, :n].swapaxes(1, 2)
        own -= mixed.swapaxes(1, 2) @ inner @ mixed
        scores = np.einsum("wkm,wm->wk", by[:, :n], r) - np.einsum(
            "wkn,wkl,wl->wn", mixed, inner, pull
        )
        believed = unknowns.believed
        cost = 0.5 * float((left**2).sum() + (begun**2).sum() + vector @ believed @ vector)
        cost_of_all = np.array([cost if np.isfinite(sensed).all() else np.inf])
        slopes_of_all = scores.sum(axis=0) - believed @ vector
        information = own.sum(axis=0) + believed
        solved = (cost_of_all, slopes_of_all, information, own, scores)
        return Fitted(
            unknowns, vector, start, *solved, residual, state[:, :, 0], inner, mixed, pull
        )

    def _wrenches(self, vectors: Array) -> Array:
        """Wrenches (L, 6, B, W) of B vectors (B, size) that differ from the first in one entry
        each."""
        first = self.model.wrench(self.unknowns, vectors[0])[self.windows.step]
        wrench = np.empty((*first.shape, len(vectors)))
        wrench[:] = first[..., None]
        for k, vector in enumerate(vectors[1:], start=1):
            if self.unknowns.force[np.argmax(vector != vectors[0])]:
                wrench[..., k] = self.model.wrench(self.unknowns, vector)[self.windows.step]
        return np.ascontiguousarray(wrench.transpose(1, 2, 3, 0))


def _huber(residual: Array) -> tuple[Array, Array]:
    """Signed roots of Huber's loss, whose squares grow linearly beyond `CLIP`, and their slopes; 0
    where nothing was measured."""
    size = np.abs(np.nan_to_num(residual))
    root = np.sqrt(np.where(size > CLIP, 2.0 * CLIP * size - CLIP**2, size**2))
    slope = np.where(size > CLIP, CLIP / np.maximum(root, CLIP), np.isfinite(residual))
    return np.copysign(root, residual), slope
