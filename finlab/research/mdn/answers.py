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


DESCENT_ERROR_MAX = 0.02
"""Normalized error in force space below which a descent has succeeded: refinement removes the
rest."""
DISTINCT = 0.03
"""Mean difference over the fins, in roots of shares of the largest force, from which two answers
are distinct."""
DUPLICATE_SCORE = 1e12
"""Added to the score of an answer that is the same as one that is chosen already."""
EQUAL_ERROR = 5e-5
"""Normalized error by which inexact answers may differ and count as equally near."""
INEXACT_SCORE = 1e9
"""Score of inexact answers, behind every exact one. Efforts reach thousands where an arc of zero
directions ends near zero, since the effort divides by that end."""

OTHER_START = -1
"""Origin of an answer that no network has proposed: by the default method."""
PRESENT_MOTION = -2
"""Origin of an answer that no network has proposed: how the robot moves at present."""


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
        free = box.any_angle[:, 2]
        lower, upper = (box.lower[:, 2], box.upper[:, 2])
        middle = 0.5 * (lower + upper)
        half = np.where(free, np.pi, 0.5 * (upper - lower))
        arcs = replace(fins, middle=middle + fins.deflection(middle), half=half)
        forces = self.forces._replace(fins=arcs)
        commands = self.commands.in_tick(box)
        return self._replace(forces=forces, commands=commands)


def effort_robot(plant: Plant, scale: Array) -> EffortRobot:
    """Prepares a robot of fins.

    Args:
        plant: of the robot.
        scale: what wrenches are divided by (6,) [N, N m].

    Raises:
        DataError: a fin's force table cannot be read.
    """
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


class RefinedAnswers(NamedTuple):
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
    """Number of the proposal that each came from (N, P), or `OTHER_START` or `PRESENT_MOTION`."""

    def before(self, other: "RefinedAnswers") -> "RefinedAnswers":
        """These P answers to each target, then Q others to the same: (N, P + Q, ...)."""
        return RefinedAnswers._make(
            np.concatenate(both, axis=1) for both in zip(self, other, strict=True)
        )


def follow(
    robot: EffortRobot, target: Array, force: AnyArray, keep: int, steps: Steps, kept: int = 0
) -> RefinedAnswers:
    """Returns answers from proposed forces: descents, the most promising of which are refined.

    Args:
        robot: the robot.
        target: normalized targets (N, 6).
        force: proposals (N, K, n), complex [N].
        keep: how many distinct descents of each target are refined.
        steps: of descent and of refinement.
        kept: how many of the first proposals are among these whatever their descents promise.
    """
    rows, count, n = force.shape
    targets = np.repeat(target, count, axis=0)
    start = force.reshape(-1, n).astype(complex)
    *_, end = descend(robot.forces, targets, start, steps.descent)
    command, effort = realize(robot.forces, end)
    error = np.linalg.norm(targets - wrench(robot.forces, end.force), axis=-1)
    score = np.where(error > DESCENT_ERROR_MAX, INEXACT_SCORE * (1.0 + error), effort).reshape(
        rows, count
    )
    score[:, :kept] = -1.0
    # Roots of shares of the largest forces: small ones count, too.
    root = end.unit * np.sqrt(end.size / robot.forces.fins.maximum)
    chosen, _ = distinct(score, root.reshape(rows, count, n), keep, DISTINCT)
    command = command.reshape(rows, count, n, 3)[np.arange(rows)[:, None], chosen]
    return refined(robot, target, command, chosen, steps)


def traced(robot: EffortRobot, target: Array, force: AnyArray, steps: Steps) -> list[Array]:
    """Returns the commands of all proposals after each step of their refinement.

    Args:
        robot: the robot.
        target: one normalized target (6,).
        force: proposals (K, n), complex [N].
        steps: of descent and of refinement.

    Returns:
        Commands (K, n, 3): of the proposals themselves, then after each step.
    """
    targets = np.repeat(target[None], len(force), axis=0)
    descents = list(descend(robot.forces, targets, force, steps.descent))
    every = Projected(
        unit=np.concatenate([at.unit for at in descents]),
        size=np.concatenate([at.size for at in descents]),
        wanted=np.concatenate([at.wanted for at in descents]),
        gauge=np.concatenate([np.broadcast_to(at.gauge, force.shape) for at in descents]),
    )
    command, _ = realize(robot.forces, every)
    trace = list(command.reshape(len(descents), *force.shape, 3))
    for _ in range(steps.commands):
        trace.append(refine(robot.commands, targets, trace[-1], 1).command)
    return trace


def refined(
    robot: EffortRobot, target: Array, command: Array, origin: NDArray[np.intp], steps: Steps
) -> RefinedAnswers:
    """Returns answers near commands, by Levenberg and Marquardt's steps.

    Args:
        robot: the robot.
        target: normalized targets (N, 6).
        command: (N, P, n, 3).
        origin: of each command (N, P).
        steps: of refinement.
    """
    rows, count, n, _ = command.shape
    targets = np.repeat(target, count, axis=0)
    end = refine(robot.commands, targets, command.reshape(-1, n, 3), steps.commands)
    effort = robot.effort(end.command)
    parts = [values.reshape(rows, count, *values.shape[1:]) for values in (*end, effort)]
    return ranked(robot, RefinedAnswers._make([*parts, origin]))


def ranked(robot: EffortRobot, answers: RefinedAnswers, bonus: float = 0.0) -> RefinedAnswers:
    """Returns answers, best first: of the exact ones, or where none is of the nearest, the
    cheapest.

    Args:
        robot: the robot.
        answers: in any order.
        bonus: share by which the effort of the first of these counts less.
    """
    score = answers.effort.copy()
    score[:, 0] *= 1.0 - bonus
    least = answers.error.min(axis=1, keepdims=True)
    allowed = np.where(least <= robot.exact, robot.exact, least + EQUAL_ERROR)
    score = np.where(answers.error > allowed, INEXACT_SCORE * (1.0 + answers.error), score)
    order = score.argsort(axis=1, kind="stable")
    row = np.arange(len(order))[:, None]
    return RefinedAnswers._make(values[row, order] for values in answers)


def distinct(
    score: Array, root: AnyArray, keep: int, apart: float
) -> tuple[NDArray[np.intp], Array]:
    """Chooses distinct candidates: several proposals mostly lead to the same forces.

    Args:
        score: of candidates (N, K); the least is the best.
        root: their forces as roots of shares of the largest ones (N, K, n).
        keep: how many are chosen at most.
        apart: mean difference of the roots below which two candidates are the same.

    Returns:
        Which candidates (N, P), best first, duplicates last, and their scores (N, P), those of
        duplicates above `DUPLICATE_SCORE`.
    """
    remaining = score.copy()
    row = np.arange(len(score))
    chosen = np.empty((len(score), min(keep, score.shape[1])), np.intp)
    rank = np.empty(chosen.shape)
    for k in range(chosen.shape[1]):
        best = remaining.argmin(axis=1)
        chosen[:, k] = best
        rank[:, k] = remaining[row, best]
        is_duplicate = np.abs(root - root[row, best][:, None]).mean(-1) < apart
        remaining = np.where(is_duplicate, remaining + DUPLICATE_SCORE, remaining)
        remaining[row, best] = np.inf
    return chosen, rank
