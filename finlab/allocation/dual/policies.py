"""Targets out of reach: the nearest wrench, the same direction, or groups of axes in order, by the same dual.

`closest` allows a miss `m = E l` with `E` the inverse of `rho` times the squared weights: exact as `rho`
grows. `direction` pays a reward for the share `t` of the target that is given. `priority` asks for the axes
of one group after the other, the groups before it met exactly. At the wrench that is got, one more solution
finds the least watts.
"""

import heapq
from itertools import count
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.answers import Sets
from finlab.allocation.dual.branch import halves
from finlab.allocation.dual.newton import Prices, Terms, solve
from finlab.allocation.dual.robot import DualRobot
from finlab.allocation.policy import Policy
from finlab.arrays import Array
from finlab.precision import CLOSE, NEARLY, NOTHING, ROUNDING, ROUNDS

STIFFNESS = (10.0, 1e3, 1e5, 1e7)
"""Costs of a miss, one after the other, as multiples of the robot's largest power per actuator."""
REWARD = 1e4
"""Reward for a share of a target, as a multiple of the same."""


class Nearest(NamedTuple):
    """What is given in place of a target out of reach."""

    force: Array
    """Forces (k,) [N] of the robot's directions."""
    prices: Array
    """Prices (r,) of the wrench that they give, at its least power."""


def nearest(robot: DualRobot, sets: Sets, wrench: Array, policy: Policy, yardstick: Array) -> Nearest:
    """Forces for one wrench (6,) [N, N m] that no forces within the sets give.

    Sets with gaps are cut until the best answer of all parts lies in none.

    Args:
        robot: the robot.
        sets: what its actuators may give, for one target.
        wrench: the target.
        policy: what counts.
        yardstick: scales (6,) of the missing wrench [N, N m].
    """
    weight = robot.scale / yardstick
    asked = wrench / robot.scale

    def served(part: Sets) -> tuple[tuple[float, ...], int, Array, Sets]:
        """How badly a part serves the policy, and its forces."""
        if policy.kind == "direction":
            force = direction(robot, part, asked)
        elif policy.kind == "priority":
            force = priority(robot, part, asked, policy.groups, weight)
        else:
            force = closest(robot, part, asked, weight * _axis_weights(policy))
        return _missed(robot, force, asked, policy, weight), next(number), force, part

    number = count()
    parts = [served(sets)]
    for _ in range(ROUNDS):
        _, _, force, part = heapq.heappop(parts)
        cut = halves(robot, part, force)
        if cut is None:
            break
        for each in cut:
            heapq.heappush(parts, served(each))
    return _cheapest(robot, part, force)


def _axis_weights(policy: Policy) -> Array:
    weights = np.array(policy.axis_weights)
    return np.asarray(np.maximum(weights / weights.max(), CLOSE))


def _missed(robot: DualRobot, force: Array, asked: Array, policy: Policy, weight: Array) -> tuple[float, ...]:
    """How much forces (k,) leave undone of a scaled wrench (6,), by what counts to a policy."""
    missing = (asked - robot.effectiveness.T @ force / robot.scale) * weight
    if policy.kind == "priority":
        return tuple(round(float(np.linalg.norm(missing[group])), 6) for group in policy.groups)
    if policy.kind == "direction":
        along = asked * weight
        return (float(missing @ along),)
    return (float(np.linalg.norm(missing * _axis_weights(policy))),)


def _cheapest(robot: DualRobot, sets: Sets, force: Array) -> Nearest:
    """The least power for the wrench that some forces (k,) give."""
    target = (robot.matrix.T @ force)[:, None]
    for share in (1.0, 1.0 - NEARLY):
        found = solve(robot, share * target, sets)
        if found.solved[0]:
            return Nearest(found.force[:, 0], found.prices[:, 0])
    return Nearest(force, found.prices[:, 0])


def closest(robot: DualRobot, sets: Sets, wrench: Array, weight: Array) -> Array:
    """Forces (k,) [N] whose scaled wrench comes nearest to a scaled one (6,), each axis by its weight
    (6,)."""
    metric = robot.basis.T * weight**2
    inner = metric @ robot.basis
    target = np.linalg.solve(inner, metric @ wrench)[:, None].astype(np.float64)
    compliance = np.linalg.inv(inner).astype(np.float64)
    return _nearer(robot, sets, target, compliance).force[:, 0]


def _nearer(robot: DualRobot, sets: Sets, target: Array, compliance: Array) -> Prices:
    """Prices for a target (r, 1) that may be missed, the more it costs the less: a miss is `compliance` (r,
    r) times the prices over the stiffness."""
    unit = _unit(sets)
    prices, last = None, STIFFNESS[0]
    for stiffness in STIFFNESS:
        if prices is not None:
            prices = prices + (stiffness / last - 1.0) * _unanswered(robot, prices, sets)
        found = solve(robot, target, sets, prices, Terms(penalty=compliance / (stiffness * unit)))
        prices, last = found.prices, stiffness
    return found


def _unit(sets: Sets) -> float:
    """The largest power per actuator [W]."""
    return float(sets.most_cost[0]) / len(sets.high) + 1e-12


def _unanswered(robot: DualRobot, prices: Array, sets: Sets) -> Array:
    """The part (r, 1) of prices to which no actuator answers: they are at their limits along it."""
    answer = robot.answers(robot.matrix @ prices, sets)
    hessian = (robot.outer @ answer.derivative).reshape(robot.shape)
    values, vectors = np.linalg.eigh(hessian)
    still = vectors[:, values <= NOTHING * max(values[-1], robot.least_trace)]
    part: Array = still @ (still.T @ prices)
    return part


def direction(robot: DualRobot, sets: Sets, wrench: Array) -> Array:
    """Forces (k,) [N] that give the largest share of a scaled wrench (6,)."""
    target = (robot.basis.T @ wrench)[:, None]
    if np.linalg.norm(robot.basis @ target[:, 0] - wrench) > NEARLY * np.linalg.norm(wrench):
        return solve(robot, 0.0 * target, sets).force[:, 0]
    target = target / max(float(np.linalg.norm(target)) / 4.0, 1.0)  # farther than any robot reaches
    return solve(robot, target, sets, None, Terms(reward=REWARD * _unit(sets))).force[:, 0]


def priority(
    robot: DualRobot, sets: Sets, wrench: Array, groups: list[NDArray[np.bool_]], weight: Array
) -> Array:
    """Forces (k,) [N] that serve groups of axes (masks (6,)) of a scaled wrench (6,), each as far as those
    before it allow.

    A group that is missed lies on a face of the reach: the actuators that its normal drives stay at their
    limits, and what is left of the group's axes is held.
    """
    held, aim = np.zeros((6, 0)), np.array(wrench)
    for group in groups:
        basis = np.concatenate([held, np.eye(6)[:, group]], axis=1)
        part = robot.within(basis)
        compliance = np.zeros(basis.shape[1])
        compliance[held.shape[1] :] = 1.0 / weight[group] ** 2
        found = _nearer(part, sets, (basis.T @ aim)[:, None], np.diag(compliance))
        force = found.force[:, 0]
        got = (robot.effectiveness.T @ force) / robot.scale
        missed = np.linalg.norm(basis.T @ (got - aim))
        held = basis
        if missed > NEARLY * np.linalg.norm(basis.T @ aim):
            normal = _unanswered(part, found.prices, sets)[:, 0]
            driven = np.abs(part.matrix @ normal)
            least = max(float(driven.max()), float(np.abs(part.matrix).max() * np.linalg.norm(normal)))
            sets = _kept_at_limits(robot, sets, force, driven > NEARLY * least)  # none at an axis without any
            held = _beside(basis, normal)
        aim = np.where(_spanned(held), got, aim)
    return force


def _beside(basis: Array, normal: Array) -> Array:
    """The part (6, q - 1) of a basis (6, q) at right angles to one of its directions (q,)."""
    size = float(np.linalg.norm(normal))
    if size == 0.0:
        return basis
    _, _, right = np.linalg.svd((normal / size)[None], full_matrices=True)
    return np.asarray(basis @ right[1:].T)


def _spanned(basis: Array) -> NDArray[np.bool_]:
    """Which axes (6,) a basis (6, q) touches."""
    return np.asarray((np.abs(basis) > ROUNDING).any(axis=1))


def _kept_at_limits(robot: DualRobot, sets: Sets, force: Array, directions: NDArray[np.bool_]) -> Sets:
    """Sets in which the actuators of some directions (k,) keep their forces (k,)."""
    lines, planes = robot.answers.lines, robot.answers.planes
    planar = directions[lines : lines + planes] | directions[lines + planes :]
    fixed = np.concatenate([directions[:lines], planar])[:, None]
    return robot.frozen(sets, force[:, None], fixed)
