"""Newton's method on the dual: the prices of the wrench at which the answers of all actuators add up to it.

    max over l of  g(l) = l.w - sum c*(B'l),   with gradient  w - sum B y(B'l)

`g` is concave, its Hessian is `-G` with `G = sum B (dy/ds) B'`. Where actuators are at their limits, `G`
loses rank: a ridge `mu tr(G) M`, with M the Hessian of quadratic costs over its mean (`DualRobot.metric`),
keeps the step finite and is adapted to what a step brought (Levenberg, Marquardt; Nielsen's growth where
steps are refused).
"""

from time import thread_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.robot import DualRobot
from finlab.allocation.dual.sets import Sets
from finlab.arrays import Array
from finlab.arrays import solve as solve_systems
from finlab.precision import NEARLY, NOTHING, ROUNDING

LIMIT_S = 0.15
"""Processor time [s] of this thread after which a search for one target ends with what it has found."""


class Deadline:
    """When the searches of one call end."""

    def __init__(self, targets: float) -> None:
        self._end = thread_time() + LIMIT_S * targets
        self._struck = False

    def passed(self) -> bool:
        """Whether a search has to end now."""
        self._struck = self._struck or thread_time() > self._end
        return self._struck

    @property
    def notes(self) -> set[str]:
        """The sentence about a search that has ended so."""
        ended = "the search for a better answer was ended by its limit of processor time"
        return {ended} if self._struck else set()


NEVER = Deadline(float("inf"))
"""One that does not come."""


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
    """Dual value (N,) [W]: no forces within the sets that give the target cost less."""
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

    def put(self, columns: NDArray[np.intp], new: "Prices") -> None:
        """Replaces what was known for some of the targets."""
        for values, own in zip(self, new, strict=True):
            values[..., columns] = own


class _State(NamedTuple):
    """Prices and what they give, for some targets."""

    target: Array
    prices: Array
    force: Array
    derivative: Array
    value: Array
    residual: Array
    size: Array


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
    most_steps: int = MOST_STEPS,
    deadline: Deadline = NEVER,
) -> Prices:
    """Prices for targets (r, N) in the basis of a robot within sets (None for all that it can), from `prices`
    (r, N) on, each in at most some steps and all before the deadline; what is done takes no further step."""
    sets = robot.sets if sets is None else sets
    count = target.shape[1]
    ridge = np.full(count, NEARLY)
    if prices is None:
        prices, saturated = start(robot, target, sets)
        ridge[saturated] = SATURATED_RIDGE
    most = sets.most_cost * (1.0 + 1e-9) + 1e-9 + np.zeros(count)
    place, growth, result = np.arange(count), np.full(count, 2.0), None
    with np.errstate(invalid="ignore"):  # systems without an inverse are told by what is not finite
        state = _state(robot, target, prices, sets)
        for steps in range(most_steps + 1):
            solved = state.size <= TOLERANCE
            beyond = ~solved & (state.value > most)
            done = solved | beyond | (ridge > MOST_RIDGE)
            if steps == most_steps or deadline.passed():
                done[:] = True
            if done.any():
                taken = np.full(len(place), steps)
                own = Prices(state.prices, state.force, state.value, solved, beyond, taken)
                if result is None:
                    result = own.take(np.arange(count))
                if done.all():
                    result.put(place, own)
                    break
                result.put(place[done], own.take(np.flatnonzero(done)))
                left = np.flatnonzero(~done)
                place, ridge, growth, most = place[left], ridge[left], growth[left], most[left]
                state, sets = _State(*(values[..., left] for values in state)), sets.take(left)
            step = _step(robot, state, ridge)
            trial = _state(robot, state.target, state.prices + step, sets)
            slope = np.maximum(np.einsum("rn,rn->n", step, state.residual), 1e-300)
            change = np.einsum("rn,rn->n", step, trial.residual) / slope
            good = _accepted(state, trial, change)
            kept = np.where(np.abs(change) < 0.5, 0.1, np.where(change > 0.5, 0.3, 1.0))
            grown = np.maximum(growth, np.minimum(-change, 10.0))
            ridge = np.maximum(ridge * np.where(good, kept, grown), ROUNDING)
            growth = np.where(good, 2.0, 2.0 * growth)
            if good.all():
                state = trial
            elif good.any():
                both = zip(trial, state, strict=True)
                state = _State(*(np.where(good, new, old) for new, old in both))
    assert result is not None  # the last step ends all
    return result


def dual_value(robot: DualRobot, target: Array, sets: Sets, prices: Array) -> Array:
    """Dual values (N,) [W] of prices (r, N) for targets (r, N) that are to be met."""
    return _state(robot, target, prices, sets).value


def _state(robot: DualRobot, target: Array, prices: Array, sets: Sets) -> _State:
    force, derivative, conjugate = robot.answers(robot.matrix @ prices, sets)
    residual = target - robot.matrix.T @ force
    value = np.einsum("rn,rn->n", prices, target) - conjugate
    size = np.sqrt(np.einsum("rn,rn->n", residual, residual))
    return _State(target, prices, force, derivative, value, residual, size)


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
    """Steps that are kept (N,): they end uphill, or the value rose, or is the same and the residual fell."""
    rose, slack = trial.value - state.value, ROUNDING * np.abs(state.value)
    return (left >= 0.0) | (rose > 0.0) | ((rose > -slack) & (trial.size < 0.9 * state.size))
