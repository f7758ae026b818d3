"""Figures of a run: every command is scored by the fins' own laws, whatever the method's model says.

The error is ||(wrench - target) / sigma||, with the robot's own sigma. The relative error is what is missing
beyond the unavoidable, as a share of what was asked: (error - best error) / ||target / sigma||. A failure
counts as fins at rest, which deliver nothing.
"""

from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.bench.problems import KINDS, Problems
from finlab.bench.runner import FAILURES, Answer, Answers
from finlab.layout.angles import command_change
from finlab.physics import plant_of
from finlab.physics.effort import command_effort

Row = dict[str, Any]
SOLVED = 0.01
"""Relative error up to which a target counts as delivered, or as delivered as far as possible."""
TRACKED = 1e-3
"""Relative error up to which costs are compared."""
EXAMPLES = 3
"""Failures that are described."""
REACHABLE = KINDS.index("boundary")
"""The last kind of targets that can be delivered whole."""


class Scores(NamedTuple):
    """What N answers are worth."""

    relative: Array
    """Relative error (N,)."""
    power: Array
    """Mean mechanical power (N,) [W]; NaN for a failure."""
    effort: Array
    """The paper's J_en (N,); NaN for a failure."""


def score(answers: list[Answer], problems: Problems, robot: int, wrench: Array, best_error: Array) -> Scores:
    """Scores of answers to wrenches (N, 6) [N, N m] on a robot, of which the least errors (N,) are known."""
    plant, sigma = plant_of(problems.layout(robot)), problems.sigma(robot)
    failed = np.array([answer.command is None for answer in answers])
    rest = np.full((plant.n_fins, 3), np.nan)
    command = np.array([rest if answer.command is None else answer.command for answer in answers])
    error = np.linalg.norm((plant.wrench(command) - wrench) / sigma, axis=-1)
    return Scores(
        np.maximum(error - best_error, 0.0) / np.linalg.norm(wrench / sigma, axis=-1),
        np.where(failed, np.nan, plant.power(command).sum(-1)),
        np.where(failed, np.nan, command_effort(command, plant.upper)),
    )


def figures(problems: Problems, answers: Answers) -> Row:
    """All that is kept of a method's run, as plain data."""
    asked = problems.targets
    scores = Scores._make(np.empty(len(answers.targets)) for _ in Scores._fields)
    for robot in np.unique(asked.robot).tolist():
        rows = np.flatnonzero(asked.robot == robot)
        mine = [answers.targets[row] for row in rows]
        part = score(mine, problems, robot, asked.wrench[rows], asked.best_error[rows])
        for values, found in zip(scores, part, strict=True):
            values[rows] = found
    every = answers.targets + [answer for path in answers.sequences for answer in path]
    failed = [answer.failure for answer in every if answer.failure is not None]
    counts = Counter(failure.kind for failure in failed)
    seconds = np.array([answer.seconds for answer in every if np.isfinite(answer.seconds)])
    p50, p99 = np.quantile(1e3 * seconds, (0.5, 0.99)).tolist() if len(seconds) else (None, None)
    paths = {
        name: row
        for name, noisy in (("smooth", False), ("noisy", True))
        if (row := _path_row(problems, answers, noisy))
    }
    summary = {"calls": len(every), "failed": len(failed) / len(every), **_summary(scores, problems)}
    return {
        "method": answers.method,
        "summary": {**summary, "turn": paths.get("noisy", {}).get("turn"), "p50_ms": p50, "p99_ms": p99},
        "paths": paths,
        "failures": {kind: counts[kind] for kind in FAILURES if counts[kind]},
        "examples": list(dict.fromkeys(f"{f.kind}: {f.words}" for f in failed))[:EXAMPLES],
    }


def _summary(scores: Scores, problems: Problems) -> Row:
    """Errors and costs over all single targets; None where there is nothing to tell."""
    asked, tracked = problems.targets, scores.relative <= TRACKED
    reachable = asked.kind <= REACHABLE
    return {
        "targets": len(tracked),
        "solved": _mean(scores.relative <= SOLVED),
        "error": _mean(scores.relative[reachable]),
        "error_max": float(scores.relative[reachable].max(initial=0.0)),
        "beyond": _mean(scores.relative[~reachable]),
        "power": _mean_ratio(scores.power, asked.power_best, tracked),
        "effort": _mean_ratio(scores.effort, asked.effort_best, tracked),
    }


def _path_row(problems: Problems, answers: Answers, noisy: bool) -> Row | None:
    """Errors on the paths with or without noise, and the mean turn of a zero direction per tick [rad]."""
    errors, turns = [], [np.empty(0)]
    for k in np.flatnonzero(problems.sequences.noisy == noisy).tolist():
        path, wrench = answers.sequences[k], problems.sequences.wrench[k]
        robot, best = int(problems.sequences.robot[k]), problems.sequences.best_error[k]
        errors.append(score(path, problems, robot, wrench, best).relative)
        for last, now in zip(path[:-1], path[1:], strict=True):
            if last.command is not None and now.command is not None:
                turns.append(command_change([last.command, now.command])[0, :, 2])
    if not errors:
        return None
    error, turn = np.concatenate(errors), _mean(np.concatenate(turns))
    return {
        "ticks": len(error),
        "solved": float((error <= SOLVED).mean()),
        "error": float(error.mean()),
        "turn": turn,
    }


def _mean(values: Array | NDArray[np.bool_]) -> float | None:
    return float(values.mean()) if len(values) else None


def _mean_ratio(values: Array, best: Array, chosen: NDArray[np.bool_]) -> float | None:
    """Mean of values over the best known, where both are."""
    return _mean((values / best)[chosen & np.isfinite(values) & np.isfinite(best)])
