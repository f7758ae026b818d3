"""Exact answers from proposed forces: descent in forces, then Levenberg-Marquardt on commands."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.rates import CommandBox
from finlab.arrays import AnyArray, Array
from finlab.physics.objective import ZERO_DIRECTION, EffortMeter, effort_scale
from finlab.physics.plant import Plant
from finlab.research.mdn.descent import EffortProblem, descend, effort_problem, realize, wrench
from finlab.research.mdn.effort_fins import EffortFins, Projected
from finlab.research.mdn.features import RobotView, robot_view

EXACT = 1e-5
"""Normalized error up to which an answer is exact and effort decides: a thousandth of what counts
as delivered."""


PROMISING = 0.02
"""Normalized error in force space below which a descent has succeeded: refinement removes the
rest."""
SAME = 0.03
"""Mean difference over the fins, in roots of shares of the largest force, from which ways are
two."""
LAST = 1e12
"""Added to the rank of a way that is chosen already."""
NEARLY = 5e-5
"""Normalized error by which inexact answers may differ and count as equally near."""
INEXACT = 1e9
"""Rank of inexact answers, behind every exact one. Efforts reach thousands where an arc of zero
directions ends near zero, since the effort divides by that end."""

OTHER, NOW = -1, -2
"""Origins of answers that no network has proposed: other starts, and how the robot moves now."""


class EffortRobot(NamedTuple):
    """A robot of n healthy fins, ready for proposals, descent and refinement."""

    plant: Plant
    forces: EffortProblem
    commands: CommandProblem
    effort: EffortMeter
    view: RobotView
    exact: float = EXACT
    """Normalized error up to which an answer is exact."""

    def within(self, box: CommandBox) -> "EffortRobot":
        """The same robot, each fin kept within what may follow a previous command."""
        fins = self.forces.fins
        free = box.free[:, 2]
        lower, upper = (box.lower[:, 2], box.upper[:, 2])
        middle = 0.5 * (lower + upper)
        half = np.where(free, np.pi, 0.5 * (upper - lower))
        arcs = replace(fins, middle=middle + fins.deflection(middle), half=half)
        forces = self.forces._replace(fins=arcs)
        commands = self.commands.in_tick(box)
        return self._replace(forces=forces, commands=commands)


def effort_robot(plant: Plant, scale: Array) -> EffortRobot:
    """Prepare a robot of fins; `scale` (6,) is what wrenches are divided by. Raises DataError: a
    fin's force table cannot be read."""
    layout = plant.layout
    turning = ZERO_DIRECTION / effort_scale(layout.upper)[:, 2] ** 2
    idle = np.clip(0.0, layout.lower[:, 2], layout.upper[:, 2])
    fins = EffortFins.of(layout)
    forces = effort_problem(plant.effectiveness[:, 1:] / scale, fins, turning, idle)
    effort = EffortMeter(plant.upper)
    commands = CommandProblem.of(plant, scale)
    return EffortRobot(plant, forces, commands, effort, robot_view(forces))


class Steps(NamedTuple):
    """How many steps proposals are followed, in forces and then in commands."""

    descent: int = 8
    """Quadratic problems in force space."""
    commands: int = 2
    """Levenberg-Marquardt steps from there onto the target."""

    @property
    def steps(self) -> int:
        """All of them."""
        return self.descent + self.commands


class Answers(NamedTuple):
    """P refined answers to each of N targets, best first: the exact ones by effort, then the
    others."""

    command: Array
    """(N, P, n, 3)."""
    wrench: Array
    """Normalized wrench (N, P, 6)."""
    error: Array
    """Normalized error (N, P)."""
    effort: Array
    """(N, P)."""
    origin: NDArray[np.intp]
    """Number of the proposal that each came from (N, P), or `OTHER` or `NOW`."""

    def before(self, other: "Answers") -> "Answers":
        """These P answers to each target, then Q others to the same: (N, P + Q, ...)."""
        return Answers._make(np.concatenate(both, axis=1) for both in zip(self, other, strict=True))


def follow(
    robot: EffortRobot, target: Array, force: AnyArray, keep: int, steps: Steps, kept: int = 0
) -> Answers:
    """Answers to normalized targets (N, 6) from proposed forces (N, K, n), complex: the `keep` most
    promising descents are refined, the first `kept` proposals among these whatever they promise."""
    rows, count, n = force.shape
    each = np.repeat(target, count, axis=0)
    *_, reached = descend(robot.forces, each, force.reshape(-1, n).astype(complex), steps.descent)
    command, effort = realize(robot.forces, reached)
    error = np.linalg.norm(each - wrench(robot.forces, reached.force), axis=-1)
    score = np.where(error > PROMISING, INEXACT * (1.0 + error), effort).reshape(rows, count)
    score[:, :kept] = -1.0
    # Roots of shares of the largest forces: small ones count, too.
    root = reached.unit * np.sqrt(reached.size / robot.forces.fins.maximum)
    chosen, _ = distinct(score, root.reshape(rows, count, n), keep, SAME)
    command = command.reshape(rows, count, n, 3)[np.arange(rows)[:, None], chosen]
    return refined(robot, target, command, chosen, steps)


def traced(robot: EffortRobot, target: Array, force: AnyArray, steps: Steps) -> list[Array]:
    """Commands (K, n, 3) for one normalized target (6,): first of forces (K, n), complex, as
    proposed, then after each step of their refinement."""
    each = np.repeat(target[None], len(force), axis=0)
    reached = list(descend(robot.forces, each, force, steps.descent))
    gauges = [np.broadcast_to(at.gauge, force.shape) for at in reached]
    parts = (
        [at.unit for at in reached],
        [at.size for at in reached],
        [at.wanted for at in reached],
        gauges,
    )
    command, _ = realize(robot.forces, Projected._make(map(np.concatenate, parts)))
    ways = list(command.reshape(len(reached), *force.shape, 3))
    for _ in range(steps.commands):
        ways.append(refine(robot.commands, each, ways[-1], 1).command)
    return ways


def refined(
    robot: EffortRobot, target: Array, command: Array, origin: NDArray[np.intp], steps: Steps
) -> Answers:
    """Answers to normalized targets (N, 6) near commands (N, P, n, 3)."""
    rows, count, n, _ = command.shape
    each = np.repeat(target, count, axis=0)
    near = refine(robot.commands, each, command.reshape(-1, n, 3), steps.commands)
    effort = robot.effort(near.command)
    parts = [values.reshape(rows, count, *values.shape[1:]) for values in (*near, effort)]
    return ranked(robot, Answers._make([*parts, origin]))


def ranked(robot: EffortRobot, answers: Answers, bonus: float = 0.0) -> Answers:
    """Answers, best first: of those that are exact, or where none is as near as any, the cheapest.

    The effort of the first given counts less by a share `bonus`.
    """
    score = answers.effort.copy()
    score[:, 0] *= 1.0 - bonus
    least = answers.error.min(axis=1, keepdims=True)
    allowed = np.where(least <= robot.exact, robot.exact, least + NEARLY)
    score = np.where(answers.error > allowed, INEXACT * (1.0 + answers.error), score)
    order = score.argsort(axis=1, kind="stable")
    place = np.arange(len(order))[:, None]
    return Answers._make(values[place, order] for values in answers)


def distinct(
    score: Array, root: AnyArray, keep: int, apart: float
) -> tuple[NDArray[np.intp], Array]:
    """Places (N, P) of scores (N, K), `keep` at most, the least first, and their ranks; those last,
    ranked behind `LAST`, whose forces (N, K, n), as roots of shares, differ by less than `apart`
    from ones before them: several proposals mostly lead to the same forces."""
    left = score.copy()
    row = np.arange(len(score))
    chosen = np.empty((len(score), min(keep, score.shape[1])), np.intp)
    rank = np.empty(chosen.shape)
    for k in range(chosen.shape[1]):
        chosen[:, k] = first = left.argmin(axis=1)
        rank[:, k] = left[row, first]
        again = np.abs(root - root[row, first][:, None]).mean(-1) < apart
        left = np.where(again, left + LAST, left)
        left[row, first] = np.inf
    return chosen, rank
