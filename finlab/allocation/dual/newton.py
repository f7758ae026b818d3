"""Newton's method on the dual: the prices of the wrench at which the answers of all actuators add up to it.

    max over l of  g(l) = l.w - sum c*(B'l) - 1/2 l'El,   with gradient  w - sum B y(B'l) - El

`g` is concave. The Hessian is `G + E` with `G = sum B (dy/ds) B'`. Where actuators are at their limits, `G`
loses rank: a ridge `mu tr(G) M`, with M the Hessian of quadratic costs over its mean (`DualRobot.metric`),
keeps the step finite and is adapted to what a step brought (Levenberg, Marquardt; Nielsen's growth where
steps are refused). The last step, near the target, is taken of the forces themselves, to first order.
With a reward, the target is `t w` with `t` in [0, 1], paid `rho (2 t - t^2 / 2)`.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.answers import STEADY, Sets
from finlab.allocation.dual.robot import DualRobot
from finlab.arrays import Array
from finlab.precision import NEARLY, NOTHING, ROUNDING
from finlab.small_systems import solve as solve_systems

TOLERANCE = 1e-10
"""Scaled wrench that may be left of a target."""
SATURATED_RIDGE = 1e-2
"""Ridge to begin with, as a share of the trace, where an actuator may be at its limit; NEARLY elsewhere."""
LINEAR = 10.0 * STEADY
"""Scaled wrench that is left of a target from which on a step to first order may be the last one."""
MOST_RIDGE = 1.0 / ROUNDING
"""Ridge beyond which a step is lost in rounding."""
MOST_STEPS = 200
"""Steps after which a target is given up."""


class Prices(NamedTuple):
    """What Newton's method found for N targets."""

    prices: Array
    """Prices (r, N) of the scaled wrench in the robot's basis [W]."""
    force: Array
    """Forces (k, N) [N] of the actuators' directions."""
    value: Array
    """Dual value (N,) [W]: no forces within the sets that give the target cost less. NaN where it was not
    asked for."""
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

    @property
    def tolerance(self) -> float:
        """Scaled wrench that may be left. High prices are rounded: what may be missed is found roughly."""
        return TOLERANCE if self.penalty is None else NEARLY


MEET = Terms()


class _State(NamedTuple):
    """Prices and what they give, for some targets."""

    target: Array
    prices: Array
    force: Array
    derivative: Array
    conjugate: Array | None
    residual: Array
    paid: Array
    """The value (N,) [W] but for what the actuators' forces are worth."""
    size: Array
    stretch: Array | None
    """Curvature (N,) [1/W] of the share of the target, where that is rewarded."""

    @property
    def value(self) -> Array:
        """Dual value (N,) [W], where it was asked for."""
        assert self.conjugate is not None
        return self.paid - self.conjugate


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
    value: bool = False,
) -> Prices:
    """Prices for targets.

    Args:
        robot: the robot.
        target: scaled wrenches in its basis (r, N).
        sets: what its actuators may give; None for all that they can.
        prices: where to begin (r, N).
        terms: penalty and reward.
        value: whether the dual value is asked for.
    """
    sets = robot.sets if sets is None else sets
    count = target.shape[1]
    if prices is None:
        prices, saturated = start(robot, target, sets)
        ridge = np.where(saturated, SATURATED_RIDGE, NEARLY)
    else:
        ridge = np.full(count, NEARLY)
    most = np.full(count, np.inf)
    if terms.penalty is None and terms.reward is None:
        most = sets.most_cost * (1.0 + 1e-9) + 1e-9 + np.zeros(count)
    with np.errstate(invalid="ignore"):  # systems without an inverse are told by what is not finite
        told = value or bool((ridge > NEARLY).any())  # near the limits, values decide
        state = _state(robot, target, prices, sets, terms, told or count > 1)
        if count == 1:
            return _one(robot, state, sets, terms, float(ridge[0]), float(most[0]), value)
        return _many(robot, state, sets, terms, ridge, most)


def dual_value(robot: DualRobot, target: Array, sets: Sets, prices: Array) -> Array:
    """Dual values (N,) [W] of prices (r, N) for targets (r, N) that are to be met."""
    return _state(robot, target, prices, sets, MEET).value


def _state(
    robot: DualRobot, target: Array, prices: Array, sets: Sets, terms: Terms, value: bool = True
) -> _State:
    answer = robot.answers(robot.matrix @ prices, sets, value)
    paid = np.einsum("rn,rn->n", prices, target)
    stretch, wanted = None, target
    if terms.reward is not None:
        left = 2.0 * terms.reward - paid
        share = np.minimum(np.maximum(left / terms.reward, 0.0), 1.0)
        stretch = ((left > 0.0) & (left < terms.reward)) / terms.reward
        paid = 0.5 * terms.reward * share * share - left * share
        wanted = share * target
    residual = wanted - robot.matrix.T @ answer.force
    if terms.penalty is not None:
        missed = terms.penalty @ prices
        residual = residual - missed
        paid = paid - 0.5 * np.einsum("rn,rn->n", prices, missed)
    return _State(target, prices, *answer, residual, paid, _length(residual), stretch)


def _length(vectors: Array) -> Array:
    """Lengths (N,) of columns (r, N)."""
    return np.asarray(np.sqrt(np.einsum("rn,rn->n", vectors, vectors)))


def _step(robot: DualRobot, state: _State, terms: Terms, ridge: Array) -> tuple[Array, Array]:
    """Steps (r, N) of the prices, and what the ridge leaves of the residual (N,), to first order. For a
    single target, a small ridge is taken back but for its square."""
    hessian = state.derivative.T @ robot.outer.T
    trace = np.maximum(robot.trace @ state.derivative, robot.least_trace)
    if terms.penalty is not None:
        hessian += terms.penalty.ravel()
    if state.stretch is not None:
        weighted = state.stretch * state.target
        hessian += np.einsum("in,jn->nij", weighted, state.target).reshape(hessian.shape)
    added = ridge * trace
    hessian += added[:, None] * robot.metric.ravel()
    hessian = hessian.reshape(-1, *robot.shape)
    step: Array = solve_systems(hessian, state.residual.T[..., None])[..., 0].T
    if not np.isfinite(step).all():  # a matrix without inverse: along the gradient
        step = np.where(np.isfinite(step), step, state.residual / trace)
        return step, np.inf * trace
    if len(ridge) > 1 or ridge[0] > NEARLY:
        return step, added * _length(robot.metric @ step)
    more: Array = solve_systems(hessian, (added * (robot.metric @ step)).T[..., None])[..., 0].T
    return step + more, added * _length(robot.metric @ more)


def _last(
    robot: DualRobot, state: _State, step: Array, left: Array, sets: Sets
) -> tuple[Array, NDArray[np.bool_]]:
    """Forces (k, N) after steps (r, N) of the prices, to first order, and where they will do (N,): they give
    the target but for what is `left` (N,), within the sets, and cost hardly more than the least."""
    price, further = robot.matrix @ state.prices, robot.matrix @ step
    change = robot.answers.change(state.derivative, further)
    fits = (left <= TOLERANCE) & robot.answers.linear(state.force, change, sets)
    if fits.any():
        fits &= robot.answers.kept(state.force, price, further, sets)
    return state.force + change, fits


def _accepted(state: _State, trial: _State, left: Array) -> NDArray[np.bool_]:
    """Which steps are kept (N,): the slope left along the step is uphill, or the value rose, or is the same
    to rounding and the residual fell."""
    rose, slack = trial.value - state.value, ROUNDING * np.abs(state.value)
    return (left >= 0.0) | (rose > 0.0) | ((rose > -slack) & (trial.size < 0.9 * state.size))


def _one(
    robot: DualRobot, state: _State, sets: Sets, terms: Terms, ridge: float, most: float, value: bool
) -> Prices:
    """`solve` for one target. The dual value takes long: it is asked for where a step was too long, or the
    target may be out of reach."""
    spare = most - sets.least_cost  # the value is no more than what is paid and this cost
    force, growth, told = None, 2.0, state.conjugate is not None
    for steps in range(MOST_STEPS + 1):
        solved, beyond = bool(state.size[0] <= terms.tolerance), False
        if not solved and state.paid[0] > spare:
            told, state = True, _valued(robot, state, sets, terms)
            beyond = bool(state.value[0] > most)
        if solved or beyond or steps == MOST_STEPS or ridge > MOST_RIDGE:
            break
        step, left = _step(robot, state, terms, np.array([ridge]))
        if terms.reward is None and left[0] <= TOLERANCE and state.size[0] < LINEAR:
            force, fits = _last(robot, state, step, left, sets)
            if solved := bool(fits[0]):
                state = state._replace(prices=state.prices + step)
                steps += 1
                break
        trial = _state(robot, state.target, state.prices + step, sets, terms, told)
        slope = max(float(step[:, 0] @ state.residual[:, 0]), 1e-300)
        change = float(step[:, 0] @ trial.residual[:, 0]) / slope
        good = change >= 0.0 or (change > -0.1 and bool(trial.size[0] < 0.1 * state.size[0]))
        if not good:
            told, state, trial = True, _valued(robot, state, sets, terms), _valued(robot, trial, sets, terms)
            good = bool(_accepted(state, trial, np.array([change]))[0])
        if good:
            state, growth = trial, 2.0
            ridge *= 0.1 if abs(change) < 0.5 else 0.3 if change > 0.5 else 1.0
        else:
            ridge, growth = ridge * max(growth, min(-change, 10.0)), 2.0 * growth
        ridge = max(ridge, ROUNDING)
        force = None
    worth = _valued(robot, state, sets, terms).value if value else np.array([np.nan])
    given = state.force if force is None else force
    return Prices(state.prices, given, worth, np.array([solved]), np.array([beyond]), np.array([steps]))


def _valued(robot: DualRobot, state: _State, sets: Sets, terms: Terms) -> _State:
    """The same with its dual value."""
    if state.conjugate is not None:
        return state
    return _state(robot, state.target, state.prices, sets, terms)


def _many(robot: DualRobot, state: _State, sets: Sets, terms: Terms, ridge: Array, most: Array) -> Prices:
    """`solve` for many targets, those that are done left out."""
    count = state.target.shape[1]
    place, growth = np.arange(count), np.full(count, 2.0)
    found = Prices(
        np.empty(state.prices.shape),
        np.empty(state.force.shape),
        np.empty(count),
        np.zeros(count, bool),
        np.zeros(count, bool),
        np.zeros(count, np.intp),
    )
    for steps in range(MOST_STEPS + 1):
        solved = state.size <= terms.tolerance
        beyond = ~solved & (state.value > most)
        done = solved | beyond | (steps == MOST_STEPS) | (ridge > MOST_RIDGE)
        if done.any():
            at = place[done]
            found.prices[:, at], found.force[:, at] = state.prices[:, done], state.force[:, done]
            found.value[at], found.solved[at], found.beyond[at] = (
                state.value[done],
                solved[done],
                beyond[done],
            )
            found.steps[at] = steps
            left = np.flatnonzero(~done)
            if not len(left):
                break
            place, ridge, growth, most = place[left], ridge[left], growth[left], most[left]
            state, sets = _columns(state, left), sets.take(left)
        step, _ = _step(robot, state, terms, ridge)
        trial = _state(robot, state.target, state.prices + step, sets, terms)
        slope = np.maximum(np.einsum("rn,rn->n", step, state.residual), 1e-300)
        change = np.einsum("rn,rn->n", step, trial.residual) / slope
        good = _accepted(state, trial, change)
        kept = np.where(np.abs(change) < 0.5, 0.1, np.where(change > 0.5, 0.3, 1.0))
        grown = np.maximum(growth, np.minimum(-change, 10.0))
        growth = np.where(good, 2.0, 2.0 * growth)
        ridge = np.maximum(ridge * np.where(good, kept, grown), ROUNDING)
        state = trial if good.all() else _merged(good, trial, state)
    return found


def _columns(state: _State, columns: NDArray[np.intp]) -> _State:
    parts: list[Any] = [None if values is None else values[..., columns] for values in state]
    return _State(*parts)


def _merged(good: NDArray[np.bool_], trial: _State, state: _State) -> _State:
    both: Any = zip(trial, state, strict=True)
    parts: list[Any] = [None if new is None else np.where(good, new, old) for new, old in both]
    return _State(*parts)
