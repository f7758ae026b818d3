"""Newton's method on the dual: the prices of the wrench at which the answers of all actuators add up to it.

    max over l of  g(l) = l.w - sum c*(B'l),   with gradient  w - sum B y(B'l)

`g` is concave, its Hessian is `-G` with `G = sum B (dy/ds) B'`. Where actuators are at their limits, `G`
loses rank: a ridge `mu tr(G) M`, with M the Hessian of quadratic costs over its mean (`DualRobot.metric`),
keeps the step finite and is adapted to what a step brought (Levenberg, Marquardt; Nielsen's growth where
steps are refused).
"""

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.deadline import NEVER, Deadline
from finlab.allocation.dual.robot import DualRobot
from finlab.allocation.dual.sets import Sets
from finlab.arrays import Array
from finlab.precision import NEARLY, NOTHING, ROUNDING
from finlab.small_systems import solve as solve_systems

TOLERANCE = 1e-10
"""Scaled wrench that may be left of a target."""
SATURATED_RIDGE = 1e-2
"""Ridge to begin with, as a share of the trace, where an actuator may be at its limit; NEARLY elsewhere."""
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
        parts: list[Any] = [values[..., columns] for values in self]
        return Prices(*parts)

    def put(self, columns: NDArray[np.intp], found: "Prices") -> None:
        """Replaces what was found for some of the targets."""
        for values, new in zip(self, found, strict=True):
            values[..., columns] = new


class _State(NamedTuple):
    """Prices and what they give, for some targets."""

    target: Array
    prices: Array
    force: Array
    derivative: Array
    conjugate: Array | None
    residual: Array
    paid: Array
    """What the targets are worth at the prices (N,) [W]."""
    size: Array

    @property
    def value(self) -> Array:
        """Dual value (N,) [W], where it was asked for."""
        assert self.conjugate is not None
        return self.paid - self.conjugate


def start(robot: DualRobot, target: Array, sets: Sets) -> tuple[Array, NDArray[np.bool_]]:
    """Prices (r, N) to begin with, and where an actuator may be at its limit (N,): those that come nearest to
    the marginal costs of the forces of quadratic costs, weighted by what costs `~ T^1.5` would answer."""
    answers, lines = robot.answers, robot.answers.lines
    force = robot.first_force @ target
    size = np.concatenate([np.abs(force[:lines]), answers.sizes(force)])
    share = size / robot.most
    saturated = np.asarray((share > 0.8).any(axis=0))
    within = np.minimum(size, 0.97 * robot.most)
    within[:lines] *= np.where(force[:lines] < 0.0, -1.0, 1.0)
    price = answers.marginal(within)[0] / np.maximum(size, 1e-300)
    fit = robot.gain * _by_direction(robot, np.sqrt(np.minimum(np.maximum(share, 1e-4), 1.0)))
    hessian = fit.T @ robot.squares.T
    diagonal = hessian[:, :: robot.shape[0] + 1]
    # Of a robot with only some directions asked for, nothing may drive one of them.
    diagonal += NOTHING * diagonal.sum(axis=1, keepdims=True)
    hessian = hessian.reshape(-1, *robot.shape)
    right = target  # where lift drags, forces of quadratic costs say little of its marginal cost
    if not len(answers.dragging):
        right = robot.matrix.T @ (fit * _by_direction(robot, price) * force)
    prices: Array = solve_systems(hessian, right.T[..., None])[..., 0].T
    return prices, saturated


def _by_direction(robot: DualRobot, values: Array) -> Array:
    """Values (k, N) of the directions of actuators that have values (n, N)."""
    lines, dragging = robot.answers.lines, robot.answers.dragging
    return np.concatenate([values, values[lines:], values[dragging]])


def solve(
    robot: DualRobot,
    target: Array,
    sets: Sets | None = None,
    prices: Array | None = None,
    value: bool = False,
    way: Literal["either", "one", "many"] = "either",
    most_steps: int = MOST_STEPS,
    deadline: Deadline = NEVER,
) -> Prices:
    """Prices for targets. One target is solved without the value, which takes long, until that is needed.

    Args:
        robot: the robot.
        target: scaled wrenches in its basis (r, N).
        sets: what its actuators may give; None for all that they can.
        prices: where to begin (r, N).
        value: whether the dual value is asked for.
        way: whether targets take the way of one or of many; where either will do, what remains unsolved is
            tried the other way, so that a target has the same answer alone and among others.
        most_steps: after how many steps a target is given up.
        deadline: when all are.
    """
    sets = robot.sets if sets is None else sets
    count = target.shape[1]
    if prices is None:
        prices, saturated = start(robot, target, sets)
        ridge = np.where(saturated, SATURATED_RIDGE, NEARLY)
    else:
        ridge = np.full(count, NEARLY)
    most = sets.most_cost * (1.0 + 1e-9) + 1e-9 + np.zeros(count)
    end = most_steps, deadline
    with np.errstate(invalid="ignore"):  # systems without an inverse are told by what is not finite
        if count == 1 and way != "many":
            state = _state(robot, target, prices, sets, value or bool(ridge[0] > NEARLY))
            found = _one(robot, state, sets, float(ridge[0]), float(most[0]), value, end)
            if found.solved[0] or found.beyond[0] or way == "one":
                return found
        found = _many(robot, _state(robot, target, prices, sets), sets, ridge, most, end)
        if count > 1 and way == "either":
            for row in np.flatnonzero(~(found.solved | found.beyond)):
                at = np.array([row])
                own, state = sets.take(at), _state(robot, target[:, at], prices[:, at], sets.take(at))
                found.put(at, _one(robot, state, own, float(ridge[row]), most[row], True, end))
    return found


def dual_value(robot: DualRobot, target: Array, sets: Sets, prices: Array) -> Array:
    """Dual values (N,) [W] of prices (r, N) for targets (r, N) that are to be met."""
    return _state(robot, target, prices, sets).value


def _state(robot: DualRobot, target: Array, prices: Array, sets: Sets, value: bool = True) -> _State:
    answer = robot.answers(robot.matrix @ prices, sets, value)
    residual = target - robot.matrix.T @ answer.force
    return _State(target, prices, *answer, residual, np.einsum("rn,rn->n", prices, target), _length(residual))


def _length(vectors: Array) -> Array:
    """Lengths (N,) of columns (r, N)."""
    return np.asarray(np.sqrt(np.einsum("rn,rn->n", vectors, vectors)))


def _step(robot: DualRobot, state: _State, ridge: Array) -> Array:
    """Steps (r, N) of the prices."""
    hessian = state.derivative.T @ robot.outer.T
    trace = np.maximum(robot.trace @ state.derivative, robot.least_trace)
    hessian += (ridge * trace)[:, None] * robot.metric.ravel()
    hessian = hessian.reshape(-1, *robot.shape)
    step: Array = solve_systems(hessian, state.residual.T[..., None])[..., 0].T
    if not np.isfinite(step).all():  # a matrix without inverse: along the gradient
        step = np.where(np.isfinite(step), step, state.residual / trace)
    return step


def _accepted(state: _State, trial: _State, left: Array) -> NDArray[np.bool_]:
    """Which steps are kept (N,): the slope left along the step is uphill, or the value rose, or is the same
    to rounding and the residual fell."""
    rose, slack = trial.value - state.value, ROUNDING * np.abs(state.value)
    return (left >= 0.0) | (rose > 0.0) | ((rose > -slack) & (trial.size < 0.9 * state.size))


def _one(
    robot: DualRobot,
    state: _State,
    sets: Sets,
    ridge: float,
    most: float,
    value: bool,
    end: tuple[int, Deadline],
) -> Prices:
    """`solve` for one target. The dual value takes long: it is asked for where a step was too long, or the
    target may be out of reach."""
    spare = most - sets.least_cost  # the value is no more than what is paid and this cost
    growth, told = 2.0, state.conjugate is not None
    for steps in range(end[0] + 1):
        solved, beyond = bool(state.size[0] <= TOLERANCE), False
        if not solved and state.paid[0] > spare:
            told, state = True, _valued(robot, state, sets)
            beyond = bool(state.value[0] > most)
        if solved or beyond or steps == end[0] or ridge > MOST_RIDGE or end[1].passed():
            break
        step = _step(robot, state, np.array([ridge]))
        trial = _state(robot, state.target, state.prices + step, sets, told)
        slope = max(float(step[:, 0] @ state.residual[:, 0]), 1e-300)
        change = float(step[:, 0] @ trial.residual[:, 0]) / slope
        good = change >= 0.0 or (change > -0.1 and bool(trial.size[0] < 0.1 * state.size[0]))
        if not good:
            told, state, trial = True, _valued(robot, state, sets), _valued(robot, trial, sets)
            good = bool(_accepted(state, trial, np.array([change]))[0])
        if good:
            state, growth = trial, 2.0
            ridge *= 0.1 if abs(change) < 0.5 else 0.3 if change > 0.5 else 1.0
        else:
            ridge, growth = ridge * max(growth, min(-change, 10.0)), 2.0 * growth
        ridge = max(ridge, ROUNDING)
    worth = _valued(robot, state, sets).value if value else np.array([np.nan])
    return Prices(state.prices, state.force, worth, np.array([solved]), np.array([beyond]), np.array([steps]))


def _valued(robot: DualRobot, state: _State, sets: Sets) -> _State:
    """The same with its dual value."""
    return state if state.conjugate is not None else _state(robot, state.target, state.prices, sets)


def _many(
    robot: DualRobot, state: _State, sets: Sets, ridge: Array, most: Array, end: tuple[int, Deadline]
) -> Prices:
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
    for steps in range(end[0] + 1):
        solved = state.size <= TOLERANCE
        beyond = ~solved & (state.value > most)
        done = solved | beyond | (steps == end[0] or end[1].passed()) | (ridge > MOST_RIDGE)
        if done.any():
            own = Prices(state.prices, state.force, state.value, solved, beyond, np.full(len(place), steps))
            found.put(place[done], own.take(np.flatnonzero(done)))
            left = np.flatnonzero(~done)
            if not len(left):
                break
            place, ridge, growth, most = place[left], ridge[left], growth[left], most[left]
            state, sets = _columns(state, left), sets.take(left)
        step = _step(robot, state, ridge)
        trial = _state(robot, state.target, state.prices + step, sets)
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
