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
from finlab.least_squares import DampingRule, levenberg_marquardt
from finlab.swim.identification.robot_model import RobotModel
from finlab.swim.identification.swim import ANGLES, STEP_S
from finlab.swim.identification.unknowns import BASE, Unknowns
from finlab.swim.vehicle.fossen import Dynamics
from finlab.swim.vehicle.many_bodies import integrate

WINDOW_STEPS = 80
"""Steps of a window."""
DEVIATION = np.array([0.02, 0.02, 0.01, 0.01, 0.01, 0.02, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01])
"""What is believed of the sensors' noise (12,) before their residuals tell [m, rad, m/s, rad/s]."""
START_DEVIATION = np.array([0.1] * 3 + [0.1] * 3 + [0.1] * 3 + [0.2] * 3)
"""How far a window may begin from the smoothed measurements (12,) [m, rad, m/s, rad/s]."""
DIFFERENCE = 1e-3
"""Step of the differences that give derivatives, in scales of the unknowns and in deviations of a
window's beginning."""
MAX_STEPS = 16
"""Most Gauss-Newton steps of a fit."""
DAMPING = DampingRule(
    initial=1e-3,
    accepted_factor=0.1,
    refused_factor=10.0,
    refused_increment=0.0,
    minimum=1e-6,
    maximum=1e6,
)
"""Levenberg's damping, and how it changes after accepted and refused steps."""
CONVERGED = 1e-4
"""Relative gain of a step below which a fit ends."""
FOLDS = 6
"""Parts into which windows are dealt for cross-validation."""
HUBER_LIMIT = 4.0
"""Deviations from which on Huber's loss of a residual grows linearly: a rare outlier must not
rule."""


class Windows(NamedTuple):
    """W windows of up to L steps, cut out of swims of M steps in all."""

    step: NDArray[np.intp]
    """Which of the M steps each step of a window is (W, L)."""
    measured: Array
    """Measurements (L, 12, W); NaN where a swim does not fill them."""
    start: Array
    """Smoothed states at the beginnings (12, W)."""


@dataclass(frozen=True)
class WindowsFit:
    """Unknowns theta, beginnings x of the windows, and the normal equations there.

    The beginnings are eliminated: `information` and `gradient` are those of theta alone. In both,
    what was believed of theta before a swim is counted once, beside what each window brings.
    """

    unknowns: Unknowns
    vector: Array
    """theta (size,), in scales of the unknowns."""
    start: Array
    """x (12, W), states in which the windows begin [m, rad, m/s, rad/s]."""
    cost: Array
    """Half the sum of squares (1,); infinite where a simulation took off."""
    gradient: Array
    """Of minus the cost by theta (size,)."""
    information: Array
    """Second derivatives of the cost by theta (size, size)."""
    window_information: Array
    """What each window brings to `information`, its Schur complement (W, size, size)."""
    scores: Array
    """What each window brings to `gradient` (W, size)."""
    residual: Array
    """Measured less simulated, in deviations (L, 12, W); NaN where nothing was measured."""
    state: Array
    """Simulated states (L, 12, W)."""
    H_xx_inverse: Array
    """Inverse of the second derivatives by x (W, 12, 12)."""
    H_xt: Array
    """Second derivatives by x and theta (W, 12, size)."""
    g_x: Array
    """Gradient of minus the cost by x (W, 12)."""

    def step(self, damping: float) -> tuple[Array, Array]:
        """Returns a step by Levenberg and Marquardt.

            (H + damping diag H) d_theta = g,    d_x = H_xx^-1 (g_x - H_xt d_theta)

        Args:
            damping: of the unknowns; a window's beginning needs none.

        Returns:
            Changes of theta (size,) and of x (12, W).
        """
        damped = self.information + damping * np.diag(np.diag(self.information))
        d_theta = np.asarray(np.linalg.solve(damped, self.gradient), np.float64)
        rest = self.g_x - self.H_xt @ d_theta
        d_x = (self.H_xx_inverse @ rest[..., None])[..., 0]
        return d_theta, d_x.T * START_DEVIATION[:, None]


def cut(n_steps: list[int], measured: Array, smooth: Array) -> Windows:
    """Returns the windows of swims.

    Args:
        n_steps: steps of each swim, M in all.
        measured: measurements of all swims, one after the other (M, 12).
        smooth: the same, smoothed (M, 12).
    """
    steps = []
    begin = 0
    for count in n_steps:
        n_windows = max(1, round(count / WINDOW_STEPS))
        length = count // n_windows
        for k in range(n_windows):
            steps.append(begin + length * k + np.arange(length))
        begin += count
    lengths = np.array([len(window) for window in steps])
    longest = lengths.max()
    padded = np.array([np.pad(window, (0, longest - len(window)), "edge") for window in steps])
    is_filled = np.arange(longest) < lengths[:, None]  # (W, L)
    values = np.where(is_filled[..., None], measured[padded], np.nan)
    return Windows(padded, np.moveaxis(values, 0, -1), smooth[padded[:, 0]].T.copy())


def fit_windows(
    model: RobotModel,
    unknowns: Unknowns,
    windows: Windows,
    deviation: Array,
    vector: Array,
    start: Array,
) -> WindowsFit:
    """Fits unknowns to windows.

    Args:
        model: the robot.
        unknowns: which numbers of it are looked for.
        windows: what was measured.
        deviation: standard deviation of the noise of each channel (12,).
        vector: theta to begin with (size,).
        start: beginnings of the windows to begin with (12, W).
    """
    problem = WindowProblem(model, unknowns, windows, deviation)

    def moved(at: WindowsFit, damping: Array, last: bool) -> WindowsFit:
        d_theta, d_x = at.step(float(damping[0]))
        with np.errstate(all="ignore"):  # a step too far may make a robot take off
            return problem.linearized(at.vector + d_theta, at.start + d_x)

    return levenberg_marquardt(
        problem.linearized(vector, start), moved, MAX_STEPS, DAMPING, CONVERGED
    )


def unseen_gain(
    model: RobotModel, fitted: WindowsFit, windows: Windows, deviation: Array, name: str
) -> Array:
    """By how much a block beside `BASE` would lessen half the squared residuals of windows not seen
    (W,).

    Cross-validation to second order about the fit: the windows are dealt to some folds, and the
    normal equations of all windows but those of a fold tell the change of the unknowns, with the
    block and without.

    Args:
        model: the robot.
        fitted: a fit of `BASE`.
        windows: what was measured.
        deviation: standard deviation of the noise of each channel (12,).
        name: of the block.
    """
    with_block = Unknowns(model.blocks, (*BASE, name))
    vector = np.pad(fitted.vector, (0, with_block.size - len(fitted.vector)))
    at = WindowProblem(model, with_block, windows, deviation).linearized(vector, fitted.start)
    prior = with_block.prior_information
    fold = np.arange(windows.start.shape[1]) % FOLDS
    is_base = np.ones(with_block.size, bool)
    is_base[with_block.slice_of(name)] = False

    def gain(is_free: NDArray[np.bool_]) -> Array:
        """What each window gains by changes of the free unknowns that the others ask for (W,)."""
        gains = np.empty(len(fold))
        free = np.flatnonzero(is_free)
        for k in range(FOLDS):
            seen = fold != k
            unseen = np.flatnonzero(fold == k)
            H = at.window_information[seen].sum(axis=0) + prior
            g = at.scores[seen].sum(axis=0) - prior @ vector
            change = np.linalg.solve(H[np.ix_(free, free)], g[free])
            H_unseen = at.window_information[np.ix_(unseen, free, free)]
            g_unseen = at.scores[np.ix_(unseen, free)]
            gains[unseen] = g_unseen @ change - 0.5 * (H_unseen @ change) @ change
        return gains

    return gain(np.ones_like(is_base)) - gain(is_base)


@dataclass(frozen=True)
class WindowProblem:
    """The sum of squares that a fit of windows makes least."""

    model: RobotModel
    unknowns: Unknowns
    windows: Windows
    deviation: Array
    """Of the noise of each channel (12,)."""

    def linearized(self, vector: Array, start: Array) -> WindowsFit:
        """Linearizes the problem, and eliminates where its windows begin.

        Each of the W windows has a beginning x of its own, 12 numbers, beside the unknowns theta
        that all share. To the normal equations of a Gauss-Newton step (d_theta, d_x) it brings

            H_tt d_theta + H_xt^T d_x = g_t,        H_tt = J_t J_t^T,      g_t = J_t r,
            H_xt d_theta + H_xx   d_x = g_x,        H_xt = J_x J_t^T,      g_x = J_x r - b,
                                                    H_xx = J_x J_x^T + I,

        with r measured less simulated, and b the beginning's distance from the smoothed one, all in
        standard deviations. The second row is the window's alone. Solved for d_x, it leaves for
        theta the Schur complement of H_xx:

            (H_tt - H_xt^T H_xx^-1 H_xt) d_theta = g_t - H_xt^T H_xx^-1 g_x.

        Its sum over all windows, with what is believed of theta before, is what `WindowsFit.step`
        solves.

        Args:
            vector: theta (size,), in scales of the unknowns.
            start: x (12, W), states in which the windows begin [m, rad, m/s, rad/s].
        """
        state, sensed = self._simulated(vector, start)
        residual = self._residual(sensed[:, :, 0])
        root, root_slope = _huber(residual)
        J_t, J_x = self._jacobians(sensed, root_slope)  # (W, size, m), (W, 12, m), m = 12 L
        r = np.moveaxis(root, 2, 0).reshape(len(J_t), -1)  # (W, m)
        b = (start - self.windows.start).T / START_DEVIATION  # (W, 12)

        H_tt = J_t @ J_t.swapaxes(1, 2)
        H_xt = J_x @ J_t.swapaxes(1, 2)
        H_xx = J_x @ J_x.swapaxes(1, 2) + np.eye(12)
        g_t = np.einsum("wkm,wm->wk", J_t, r)
        g_x = np.einsum("wkm,wm->wk", J_x, r) - b

        H_xx_inverse = np.asarray(np.linalg.inv(H_xx), np.float64)
        schur = H_tt - H_xt.swapaxes(1, 2) @ H_xx_inverse @ H_xt  # (W, size, size)
        scores = g_t - np.einsum("wkn,wkl,wl->wn", H_xt, H_xx_inverse, g_x)  # (W, size)

        prior = self.unknowns.prior_information
        cost = 0.5 * float((root**2).sum() + (b**2).sum() + vector @ prior @ vector)
        if not np.isfinite(sensed).all():
            cost = np.inf
        return WindowsFit(
            unknowns=self.unknowns,
            vector=vector,
            start=start,
            cost=np.array([cost]),
            gradient=scores.sum(axis=0) - prior @ vector,
            information=schur.sum(axis=0) + prior,
            window_information=schur,
            scores=scores,
            residual=residual,
            state=state[:, :, 0],
            H_xx_inverse=H_xx_inverse,
            H_xt=H_xt,
            g_x=g_x,
        )

    def _simulated(self, vector: Array, start: Array) -> tuple[Array, Array]:
        """Simulates all windows as they are, and with one entry of theta or of x moved.

        Returns:
            States, and what the sensors say of them, (L, 12, B, W) each. B = 1 + size + 12: the
            problem as it is, with each entry of theta moved by DIFFERENCE, and with each entry of x
            moved by that share of its deviation.
        """
        size = self.unknowns.size
        theta_moved = vector + DIFFERENCE * np.eye(size)
        vectors = np.concatenate([vector[None], theta_moved])
        wrench = self._wrenches(vectors)
        # To begin elsewhere changes neither theta nor the actuators' wrench.
        wrench = np.concatenate([wrench, np.repeat(wrench[:, :, :1], 12, axis=2)], axis=2)
        vectors = np.concatenate([vectors, np.repeat(vector[None], 12, axis=0)])

        begin = np.repeat(start[:, None], len(vectors), axis=1)  # (12, B, W)
        for channel in range(12):
            begin[channel, 1 + size + channel] += DIFFERENCE * START_DEVIATION[channel]

        bodies = Dynamics(*(part[..., None] for part in self.model.bodies(self.unknowns, vectors)))
        current = self.unknowns.block("current", vectors).T[..., None]
        state = integrate(begin, wrench, bodies, current, STEP_S)
        return state, self.model.sensed(self.unknowns, vectors, state)

    def _residual(self, sensed: Array) -> Array:
        """Measured less simulated (L, 12, W), in deviations; angles by the shorter way."""
        difference = self.windows.measured - sensed
        difference[:, ANGLES] = wrapped(difference[:, ANGLES])
        return np.asarray(difference / self.deviation[:, None])

    def _jacobians(self, sensed: Array, root_slope: Array) -> tuple[Array, Array]:
        """Derivatives of the weighted simulated measurements by theta (W, size, m) and by x (W, 12,
        m), m = 12 L.

        Args:
            sensed: simulated measurements (L, 12, B, W), see `_simulated`.
            root_slope: what Huber's loss makes of a change of each residual (L, 12, W).
        """
        size = self.unknowns.size
        slope = (sensed[:, :, 1:] - sensed[:, :, :1]) / DIFFERENCE
        slope *= (root_slope / self.deviation[:, None])[:, :, None]
        by_window = np.moveaxis(slope, (2, 3), (1, 0))  # (W, size + 12, L, 12)
        jacobian = by_window.reshape(*by_window.shape[:2], -1)
        return jacobian[:, :size], jacobian[:, size:]

    def _wrenches(self, vectors: Array) -> Array:
        """Wrenches (L, 6, B, W) of B vectors (B, size) that differ from the first in one entry
        each."""
        first = self.model.wrench(self.unknowns, vectors[0])[self.windows.step]
        wrench = np.empty((*first.shape, len(vectors)))
        wrench[:] = first[..., None]
        for k, vector in enumerate(vectors[1:], start=1):
            moved_entry = np.argmax(vector != vectors[0])
            if self.unknowns.moves_wrench[moved_entry]:
                wrench[..., k] = self.model.wrench(self.unknowns, vector)[self.windows.step]
        return np.ascontiguousarray(wrench.transpose(1, 2, 3, 0))


def _huber(residual: Array) -> tuple[Array, Array]:
    """Signed roots of Huber's loss, and their slopes, both of the residuals' shape.

    rho(r) = sign(r) |r| up to the limit c, sign(r) sqrt(2 c |r| - c^2) beyond: its square grows
    linearly there. 0 where nothing was measured.
    """
    size = np.abs(np.nan_to_num(residual))
    is_outlier = size > HUBER_LIMIT
    root = np.sqrt(np.where(is_outlier, 2.0 * HUBER_LIMIT * size - HUBER_LIMIT**2, size**2))
    outlier_slope = HUBER_LIMIT / np.maximum(root, HUBER_LIMIT)
    slope = np.where(is_outlier, outlier_slope, np.isfinite(residual))
    return np.copysign(root, residual), slope
