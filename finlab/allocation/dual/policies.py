"""Targets out of reach: the nearest wrench, the same direction, or groups of axes; changes within a tick.

Each is the point of a convex set nearest to another (`nearest_point`), in coordinates in which what counts
more is longer. `closest` takes the axes by their weights, `direction` the farthest share of the target,
`priority` the axes of one group after the other, what those before it have got held. From
tick to tick, commands change no faster than the drives of the actuators allow.
"""

import heapq
from dataclasses import dataclass
from itertools import count
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.branch import halves
from finlab.allocation.dual.nearest_point import CLOSE_BY, Mixture, farthest_along, nearest_point
from finlab.allocation.dual.newton import NEVER, Deadline, solve
from finlab.allocation.dual.robot import DualRobot
from finlab.allocation.dual.sets import Sets
from finlab.allocation.policy import Policy
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.physics.plant import Plant
from finlab.precision import CLOSE, FINE, NEARLY, ROUNDS

HELD = 1e3
"""Weight of an axis that is held over one of the group that is served."""
STEPS_AT_RIM = 60
"""Steps after which Newton's method is given up at the rim of what can be given."""
PULL = 1e-3
"""What a group may miss, on the yardstick, without pulling at the axes that are held."""


class Nearest(NamedTuple):
    """What is given in place of a target out of reach."""

    force: Array
    """Forces (k,) [N] of the robot's directions."""
    wrench: Array
    """The wrench (6,) [N, N m] that they give."""
    prices: Array
    """Prices (r,) of it, at its least power."""


def nearest(
    robot: DualRobot, sets: Sets, wrench: Array, policy: Policy, yardstick: Array, deadline: Deadline
) -> Nearest:
    """What a policy gives for one wrench (6,) [N, N m] that no forces within the sets give; its miss counts
    on a yardstick (6,). Sets with gaps are cut until the best answer of all lies in none."""

    def served(part: Sets) -> tuple[tuple[float, ...], int, Array, Sets]:
        """How badly a part serves the policy, and its forces."""
        force = SERVING[policy.kind](robot, part, wrench, policy, yardstick)
        return _missed(robot, force, wrench, policy, yardstick), next(number), force, part

    number = count()
    parts = [served(sets)]
    for round_ in range(ROUNDS + len(sets.high)):
        _, _, force, part = heapq.heappop(parts)
        cut = halves(robot, part, force)
        if cut is None or deadline.passed():
            break
        parts = parts if round_ < ROUNDS else []  # there are too many: the better half is taken
        for each in cut:
            heapq.heappush(parts, served(each))
    inside = np.zeros(6) if policy.kind == "direction" else robot.effectiveness.T @ robot.middle(part)
    actual = robot.effectiveness.T @ force
    met = np.where(np.abs(actual - wrench) <= FINE * yardstick, wrench, actual)
    return cheapest(robot, part, force, inside, met, deadline)


def _missed(
    robot: DualRobot, force: Array, wrench: Array, policy: Policy, yardstick: Array
) -> tuple[float, ...]:
    """How much forces (k,) leave undone of a wrench (6,), by what counts to a policy."""
    missing = (wrench - robot.effectiveness.T @ force) / yardstick
    if policy.kind == "priority":
        return tuple(round(float(np.linalg.norm(missing[group])), 6) for group in policy.groups)
    if policy.kind == "direction":
        along = wrench / yardstick
        left = float(missing @ along) / max(float(along @ along), 1e-300)
        return round(float(np.linalg.norm(missing - left * along)), 6), left
    return (float(np.linalg.norm(missing * _axis_weights(policy))),)


def _axis_weights(policy: Policy) -> Array:
    weights = np.array(policy.axis_weights)
    return np.asarray(np.maximum(weights / weights.max(), CLOSE))


def cheapest(
    robot: DualRobot,
    sets: Sets,
    force: Array,
    inside: Array,
    wanted: Array | None = None,
    deadline: Deadline = NEVER,
) -> Nearest:
    """The least power for the wrench that some forces (k,) give, or for one hardly apart (6,); where Newton's
    method does not settle, at the rim, a little towards one inside (6,), else these forces."""
    wrench = robot.effectiveness.T @ force
    inwards = (inside - wrench) / max(1.0, float(np.linalg.norm((inside - wrench) / robot.scale)))
    aims = [wrench, wrench + NEARLY * inwards]
    for aim in aims if wanted is None else [wanted, *aims]:
        result = solve(robot, robot.target(aim[None]), sets, None, STEPS_AT_RIM, deadline)
        if result.solved[0]:
            return Nearest(result.force[:, 0], aim, result.prices[:, 0])
    return Nearest(force, wrench, result.prices[:, 0])


def closest(robot: DualRobot, sets: Sets, wrench: Array, policy: Policy, yardstick: Array) -> Array:
    """Forces (k,) [N] whose wrench comes nearest to one (6,), each axis by its weight over the yardstick."""
    weight = _axis_weights(policy) / yardstick
    return nearest_point(robot.farthest(sets), robot.effectiveness * weight, wrench * weight).force


def direction(robot: DualRobot, sets: Sets, wrench: Array, policy: Policy, yardstick: Array) -> Array:
    """Forces (k,) [N] that give the largest share of a wrench (6,), all else 0."""
    scaled = wrench / robot.scale
    held = np.linalg.norm(robot.basis @ (robot.basis.T @ scaled) - scaled) <= NEARLY * np.linalg.norm(scaled)
    rows = robot.effectiveness / yardstick
    return farthest_along(robot.farthest(sets), rows, wrench / yardstick if held else 0.0 * wrench).force


def priority(robot: DualRobot, sets: Sets, wrench: Array, policy: Policy, yardstick: Array) -> Array:
    """Forces (k,) [N] that serve groups of axes of a wrench (6,), each as far as those before it allow. A
    group that wants more than there is pulls at the held axes: then its miss is cut to `PULL`."""
    held, aim = np.zeros(6), np.array(wrench)
    near: Mixture | None = None
    for group in policy.groups:
        weight, close = (HELD * held + group) / yardstick, CLOSE_BY * (HELD if held.any() else 1.0)
        rows = robot.effectiveness * weight
        for _ in range(ROUNDS if held.any() else 1):
            near = nearest_point(robot.farthest(sets), rows, aim * weight, near, close)
            got = robot.effectiveness.T @ near.force
            missed = float(np.linalg.norm((wrench - got)[group] / yardstick[group]))
            if missed <= PULL or near.miss @ near.miss <= 4.0 * PULL**2:
                break
            aim = np.where(group, got + PULL / missed * (wrench - got), aim)
        held = np.maximum(held, group)
        aim = np.where(group & (missed > NEARLY), got, aim)
    assert near is not None  # there is a group
    return near.force


SERVING = {"closest": closest, "direction": direction, "priority": priority}
"""What each policy does."""


class Box(NamedTuple):
    """Commands that may follow a previous one."""

    lower: Array
    """Least commands (n, 3); angles that turn freely are counted from the previous one."""
    upper: Array
    """Largest commands (n, 3)."""
    free: NDArray[np.bool_]
    """Angles (n, 3) that may be any."""
    turns: NDArray[np.bool_]
    """Angles (n, 3) that are counted around the circle."""

    def clipped(self, command: Array) -> Array:
        """Commands (..., n, 3) brought into the box."""
        middle = 0.5 * (self.lower + self.upper)
        turned = np.where(self.turns, middle + wrapped(command - middle), command)
        return np.clip(turned, self.lower, self.upper)


@dataclass(frozen=True, eq=False)
class Rates:
    """How far the commands of a robot may change in a tick."""

    plant: Plant
    """The robot."""
    step: Array
    """Largest changes (n, 3) in a tick; infinite where nothing limits them."""

    def allow(self, previous: Array, command: Array) -> bool:
        """Whether a command (n, 3) may follow a previous one (n, 3), of which actuators may be NaN."""
        change = np.abs(command - previous)
        around = np.minimum(change, np.abs(2.0 * np.pi - change))
        return not (np.where(self.plant.turns, around, change) > self.step).any()

    def box(self, previous: Array) -> Box:
        """What may follow a previous command (n, 3); an actuator with NaN is left free."""
        lower, upper, step = self.plant.lower, self.plant.upper, self.step
        known = np.asarray(np.isfinite(previous).all(axis=1))[:, None]
        turns = self.plant.turns & known & (step < np.pi)
        center = np.where(known, np.where(turns, previous, np.clip(previous, lower, upper)), lower)
        low, high = np.maximum(center - step, lower), np.minimum(center + step, upper)
        low, high = np.where(turns, center - step, low), np.where(turns, center + step, high)
        low, high = np.where(known, low, lower), np.where(known, high, upper)
        free = self.plant.turns & ~turns
        return Box(np.where(free, lower, low), np.where(free, upper, high), free, turns)


def within_tick(robot: DualRobot, sets: Sets, wrench: Array, prices: Array, weight: Array) -> Array:
    """Forces (k, 1) [N] within the sets of a tick that give a wrench (1, 6) [N, N m], or come near to it by
    weights of the axes (6,) [1/N, 1/(N m)]; the search begins at prices (r, 1)."""
    target = robot.target(wrench)
    if not len(target):  # nothing pushes, such as foils at rest
        return np.zeros((len(robot.effectiveness), 1))
    result = solve(robot, target, sets, prices)
    if result.solved[0]:
        return result.force
    near = nearest_point(robot.farthest(sets), robot.effectiveness * weight, wrench[0] * weight)
    return cheapest(robot, sets, near.force, robot.effectiveness.T @ robot.middle(sets)).force[:, None]
