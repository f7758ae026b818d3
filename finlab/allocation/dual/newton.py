"""Newton's method on the dual: the prices of the wrench at which the answers of all actuators add up to it.

    max over l of  g(l) = l.w - sum c*(B'l) - 1/2 l'El,   with gradient  w - sum B y(B'l) - El

`g` is concave. The Hessian is `G + E` with `G = sum B (dy/ds) B'`. Where actuators are at their limits, `G`
loses rank: a ridge `mu tr(G)` keeps the step finite and is adapted to what a step brought (Levenberg,
Marquardt).
With a reward, the target is `t w` with `t` in [0, 1], paid `rho (2 t - t^2 / 2)`.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.answers import Answer, Sets
from finlab.allocation.dual.robot import DualRobot
from finlab.arrays import Array
from finlab.precision import NEARLY, NOTHING, ROUNDING
from finlab.small_systems import solve as solve_systems

TOLERANCE = 1e-10
"""Scaled wrench that may be left of a target."""
SATURATED_RIDGE = 1e-2
"""Ridge to begin with, as a share of the trace, where an actuator may be at its limit; NEARLY elsewhere."""
MOST_STEPS = 200
"""Steps after which a target is given up."""


class Prices(NamedTuple):
    """What Newton's method found for N targets."""

    prices: Array
    """Prices (r, N) of the scaled wrench in the robot's basis [W]."""
    force: Array
    """Forces (k, N) [N] of the actuators' directions."""
    value: Array
    """Dual value (N,) [W]: no forces within the sets that give the target cost less."""
    solved: NDArray[np.bool_]
    """Which targets are met (N,)."""
    beyond: NDArray[np.bool_]
    """Which are proved to be out of reach (N,)."""
    steps: NDArray[np.intp]
    """Steps taken (N,)."""

    def take(self, columns: NDArray[np.intp]) -> "Prices":
        """The same for some of the targets."""
        prices, force = self.prices[:, columns], self.force[:, columns]
        solved, beyond = self.solved[columns], self.beyond[columns]
        return Prices(prices, force, self.value[columns], solved, beyond, self.steps[columns])


@dataclass(frozen=True, eq=False)
class Terms:
    """What is asked of the prices beside the target."""

    penalty: Array | None = None
    """Matrix E (r, r) [1/W]: the target may be missed by E l. None: it is met."""
    reward: float | None = None
    """Reward rho [W] for the share t of the target; None: all of it is asked for."""


MEET = Terms()


class _State(NamedTuple):
    """Prices and what they give, for some targets."""

    target: Array
    prices: Array
    answer: Answer
    residual: Array
    value: Array
    size: Array
    stretch: Array | None
    """Curvature (N,) [1/W] of the share of the target, where that is rewarded."""


def start(robot: DualRobot, target: Array, sets: Sets) -> tuple[Array, NDArray[np.bool_]]:
    """Prices (r, N) to begin with, and where an actuator may be at its limit (N,): those of a quadratic cost,
    made once to fit a cost `~ T^1.5`."""
    gain, lines = robot.gain, robot.answers.lines
    force = robot.first_force @ target
    size = np.concatenate([np.abs(force[:lines]), robot.answers.sizes(force)])
    share = size / robot.most
    saturated = np.asarray((share > 0.8).any(axis=0))
    fit = np.sqrt(np.minimum(np.maximum(share, 1e-4), 1.0))
    weight = gain * np.concatenate([fit, fit[lines:]])
    hessian = weight.T @ robot.squares.T
    diagonal = hessian[:, :: robot.shape[0] + 1]
    # Of a robot with only some directions asked for, nothing may drive one of them.
    diagonal += NOTHING * diagonal.sum(axis=1, keepdims=True)
    hessian = hessian.reshape(-1, *robot.shape)
    prices: Array = solve_systems(hessian, target.T[..., None])[..., 0].T
    return prices, saturated


def solve(
    robot: DualRobot,
    target: Array,
    sets: Sets | None = None,
    prices: Array | None = None,
    terms: Terms = MEET,
) -> Prices:
    """Prices for targets.

    Args:
        robot: the robot.
        target: scaled wrenches in its basis (r, N).
        sets: what its actuators may give; None for all that they can.
        prices: where to begin (r, N).
        terms: penalty and reward.
    """
    sets = robot.sets if sets is None else sets
    count = target.shape[1]
    if prices is None:
        prices, saturated = start(robot, target, sets)
        ridge = np.where(saturated, SATURATED_RIDGE, NEARLY)
    else:
        ridge = np.full(count, NEARLY)
    most = sets.most_cost * (1.0 + 1e-9) + 1e-9 + np.zeros(count)
    proves = terms.penalty is None and terms.reward is None
    state = _state(robot, target, prices, sets, terms)
    with np.errstate(invalid="ignore"):  # systems without an inverse are told by what is not finite
        if count == 1:
            return _one(robot, state, sets, terms, float(ridge[0]), float(most[0]) if proves else np.inf)
        return _many(robot, state, sets, terms, ridge, most if proves else np.full(count, np.inf))


def _state(robot: DualRobot, target: Array, prices: Array, sets: Sets, terms: Terms) -> _State:
    answer = robot.answers(robot.matrix @ prices, sets)
    value = np.einsum("rn,rn->n", prices, target)
    stretch, wanted = None, target
    if terms.reward is not None:
        left = 2.0 * terms.reward - value
        share = np.minimum(np.maximum(left / terms.reward, 0.0), 1.0)
        stretch = ((left > 0.0) & (left < terms.reward)) / terms.reward
        value = 0.5 * terms.reward * share * share - left * share
        wanted = share * target
    residual = wanted - robot.matrix.T @ answer.force
    value = value - answer.conjugate
    if terms.penalty is not None:
        missed = terms.penalty @ prices
        residual = residual - missed
        value = value - 0.5 * np.einsum("rn,rn->n", prices, missed)
    return _State(
        target, prices, answer, residual, value, np.sqrt(np.einsum("rn,rn->n", residual, residual)), stretch
    )


def _step(robot: DualRobot, state: _State, terms: Terms, ridge: Array) -> Array:
    """Steps (r, N) of the prices."""
    hessian = state.answer.derivative.T @ robot.outer.T
    trace = np.maximum(robot.trace @ state.answer.derivative, robot.least_trace)
    if terms.penalty is not None:
        hessian += terms.penalty.ravel()
    if state.stretch is not None:
        weighted = state.stretch * state.target
        hessian += np.einsum("in,jn->nij", weighted, state.target).reshape(hessian.shape)
    hessian[:, :: robot.shape[0] + 1] += (ridge * trace)[:, None]
    step: Array = solve_systems(hessian.reshape(-1, *robot.shape), state.residual.T[..., None])[..., 0].T
    if not np.isfinite(step).all():  # a matrix without inverse: along the gradient
        step = np.where(np.isfinite(step), step, state.residual / trace)
    return step


def _accepted(state: _State, trial: _State, left: Array) -> NDArray[np.bool_]:
    """Which steps are kept (N,): the slope left along the step is uphill, or the value rose, or is the same
    to rounding and the residual fell."""
    slack = ROUNDING * np.abs(state.value)
    return (
        (left >= 0.0)
        | (trial.value > state.value)
        | ((trial.value > state.value - slack) & (trial.size < 0.9 * state.size))
    )


def _next_ridge(ridge: Array, left: Array, good: NDArray[np.bool_]) -> Array:
    kept = np.where(np.abs(left) < 0.5, 0.1, np.where(left > 0.5, 0.3, 1.0))
    grown = np.minimum(np.maximum(-left, 2.0), 10.0)
    return np.maximum(ridge * np.where(good, kept, grown), ROUNDING)


def _one(robot: DualRobot, state: _State, sets: Sets, terms: Terms, ridge: float, most: float) -> Prices:
    """`solve` for one target."""
    steps = 0
    while steps < MOST_STEPS and state.size[0] > TOLERANCE and state.value[0] <= most:
        step = _step(robot, state, terms, np.array([ridge]))
        trial = _state(robot, state.target, state.prices + step, sets, terms)
        slope = float(step[:, 0] @ state.residual[:, 0])
        left = float(step[:, 0] @ trial.residual[:, 0]) / max(slope, 1e-300)
        steps += 1
        rose = trial.value[0] - state.value[0]
        if (
            left >= 0.0
            or rose > 0.0
            or (rose > -ROUNDING * abs(state.value[0]) and trial.size[0] < 0.9 * state.size[0])
        ):
            state = trial
            ridge *= 0.1 if abs(left) < 0.5 else 0.3 if left > 0.5 else 1.0
        else:
            ridge *= min(max(-left, 2.0), 10.0)
        ridge = max(ridge, ROUNDING)
    solved = state.size <= TOLERANCE
    beyond = ~solved & (state.value > most)
    return Prices(state.prices, state.answer.force, state.value, solved, beyond, np.array([steps]))


def _many(robot: DualRobot, state: _State, sets: Sets, terms: Terms, ridge: Array, most: Array) -> Prices:
    """`solve` for many targets, those that are done left out."""
    count = state.target.shape[1]
    place = np.arange(count)
    found = Prices(
        np.empty(state.prices.shape),
        np.empty(state.answer.force.shape),
        np.empty(count),
        np.zeros(count, bool),
        np.zeros(count, bool),
        np.zeros(count, np.intp),
    )
    for steps in range(MOST_STEPS + 1):
        solved = state.size <= TOLERANCE
        beyond = ~solved & (state.value > most)
        done = solved | beyond | (steps == MOST_STEPS)
        if done.any():
            at = place[done]
            found.prices[:, at], found.force[:, at] = state.prices[:, done], state.answer.force[:, done]
            found.value[at], found.solved[at], found.beyond[at] = (
                state.value[done],
                solved[done],
                beyond[done],
            )
            found.steps[at] = steps
            left = np.flatnonzero(~done)
            if not len(left):
                break
            place, ridge, most, sets = place[left], ridge[left], most[left], sets.take(left)
            state = _columns(state, left)
        step = _step(robot, state, terms, ridge)
        trial = _state(robot, state.target, state.prices + step, sets, terms)
        slope = np.maximum(np.einsum("rn,rn->n", step, state.residual), 1e-300)
        change = np.einsum("rn,rn->n", step, trial.residual) / slope
        good = _accepted(state, trial, change)
        ridge = _next_ridge(ridge, change, good)
        state = trial if good.all() else _merged(good, trial, state)
    return found


def _columns(state: _State, columns: NDArray[np.intp]) -> _State:
    stretch = None if state.stretch is None else state.stretch[columns]
    return _State(
        state.target[:, columns],
        state.prices[:, columns],
        Answer(*(values[..., columns] for values in state.answer)),
        state.residual[:, columns],
        state.value[columns],
        state.size[columns],
        stretch,
    )


def _merged(good: NDArray[np.bool_], trial: _State, state: _State) -> _State:
    stretch = None
    if trial.stretch is not None and state.stretch is not None:
        stretch = np.where(good, trial.stretch, state.stretch)
    return _State(
        state.target,
        np.where(good, trial.prices, state.prices),
        Answer(*(np.where(good, a, b) for a, b in zip(trial.answer, state.answer, strict=True))),
        np.where(good, trial.residual, state.residual),
        np.where(good, trial.value, state.value),
        np.where(good, trial.size, state.size),
        stretch,
    )
