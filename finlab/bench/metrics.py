"""Figures of a run: every command is judged by the fins' own laws, apart from what the method believed.

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
from finlab.bench.protocol import FAILURES
from finlab.bench.runner import Answer, Answers, failures
from finlab.layout.angles import command_change
from finlab.physics import Plant, plant_of
from finlab.physics.energy import command_energy

Row = dict[str, Any]
SOLVED = 0.01
"""Relative error up to which a target counts as delivered, or as delivered as far as possible."""
TRACKED = 1e-3
"""Relative error up to which costs are compared."""
LEVELS = np.logspace(-6.0, 0.0, 37)
"""Relative errors of the profile."""
EXAMPLES = 3
"""Failures that are described."""
WITHIN = KINDS.index("boundary")
"""The last kind of targets that can be delivered whole."""


class Scores(NamedTuple):
    """What N answers are worth."""

    relative: Array
    """Relative error (N,)."""
    error: Array
    """Normalized error (N,)."""
    power: Array
    """Mean mechanical power (N,) [W]; NaN for a failure."""
    effort: Array
    """The paper's J_en (N,); NaN for a failure."""
    seconds: Array
    """Time of the call (N,); NaN where nothing came back."""
    failed: NDArray[np.bool_]
    """Which are no answers (N,)."""


def score(answers: list[Answer], plant: Plant, sigma: Array, wrench: Array, best_error: Array) -> Scores:
    """Scores of answers to wrenches (N, 6) on one robot.

    Args:
        answers: one for each wrench.
        plant: the robot's fins.
        sigma: per-axis yardstick (6,).
        wrench: what was asked for [N, N m].
        best_error: least normalized error known (N,).
    """
    failed = np.array([answer.command is None for answer in answers])
    rest = np.full((plant.n_fins, 3), np.nan)
    command = np.array([rest if answer.command is None else answer.command for answer in answers])
    error = np.linalg.norm((plant.wrench(command) - wrench) / sigma, axis=-1)
    asked = np.linalg.norm(wrench / sigma, axis=-1)
    return Scores(
        np.maximum(error - best_error, 0.0) / asked,
        error,
        np.where(failed, np.nan, plant.power(command).sum(-1)),
        np.where(failed, np.nan, command_energy(command, plant.upper)),
        np.array([answer.seconds for answer in answers]),
        failed,
    )


def target_scores(problems: Problems, answers: Answers) -> Scores:
    """Scores of all single targets."""
    asked, found = problems.targets, [np.empty(len(answers.targets)) for _ in Scores._fields]
    for place in np.unique(asked.robot).tolist():
        rows = np.flatnonzero(asked.robot == place)
        plant, sigma = plant_of(problems.layout(place)), problems.sigma(place)
        mine = [answers.targets[row] for row in rows]
        for values, part in zip(
            found, score(mine, plant, sigma, asked.wrench[rows], asked.best_error[rows]), strict=True
        ):
            values[rows] = part
    return Scores._make([*found[:-1], found[-1].astype(bool)])


def figures(problems: Problems, answers: Answers) -> dict[str, Any]:
    """All that is kept of a method's run, as plain data: rows for the tables, and the profile."""
    scores, asked = target_scores(problems, answers), problems.targets
    names = np.array([robot.set for robot in problems.robots])[asked.robot]
    sets = {name: _row(scores, problems, names == name) for name in dict.fromkeys(names.tolist())}
    kinds = {name: _row(scores, problems, asked.kind == k) for k, name in enumerate(KINDS)}
    every = answers.targets + [answer for path in answers.sequences for answer in path]
    seconds = np.array([answer.seconds for answer in every])
    seconds = seconds[np.isfinite(seconds)]
    failed = failures(every)
    counts = Counter(failure.kind for failure in failed)
    paths = [_path_rows(problems, answers, noisy) for noisy in (False, True)]
    return {
        "method": answers.method,
        "summary": {
            "calls": len(every),
            "failed": len(failed) / len(every),
            **_row(scores, problems, np.full(len(names), True)),
            "turn": paths[1]["turn"] if paths[1] else None,
            "p50_ms": _quantile_ms(seconds, 0.5),
            "p99_ms": _quantile_ms(seconds, 0.99),
        },
        "sets": sets,
        "kinds": kinds,
        "paths": {name: row for name, row in zip(("smooth", "noisy"), paths, strict=True) if row},
        "profile": [float((scores.relative <= level).mean()) for level in LEVELS],
        "failures": {kind: counts[kind] for kind in FAILURES if counts[kind]},
        "examples": list(dict.fromkeys(f"{f.kind}: {f.words}" for f in failed))[:EXAMPLES],
    }


def _row(scores: Scores, problems: Problems, chosen: NDArray[np.bool_]) -> Row:
    """Figures of some of the single targets; None where there is nothing to tell."""
    asked = problems.targets
    within, beyond = chosen & (asked.kind <= WITHIN), chosen & (asked.kind > WITHIN)
    tracked = chosen & (scores.relative <= TRACKED)
    return {
        "targets": int(chosen.sum()),
        "solved": _mean(scores.relative[chosen] <= SOLVED),
        "error": _mean(scores.relative[within]),
        "error_max": float(scores.relative[within].max()) if within.any() else None,
        "beyond": _mean(scores.relative[beyond]),
        "power": _mean_ratio(scores.power, asked.power_best, tracked),
        "power_over_bound": _mean_ratio(scores.power, asked.power_bound, tracked),
        "effort": _mean_ratio(scores.effort, asked.effort_best, tracked),
        "compared": int((tracked & np.isfinite(asked.power_best)).sum()),
    }


def _path_rows(problems: Problems, answers: Answers, noisy: bool) -> Row | None:
    """Figures of the paths with or without noise: errors, and changes of commands from tick to tick."""
    errors, steps = [], []
    for k in np.flatnonzero(problems.sequences.noisy == noisy).tolist():
        place, path = int(problems.sequences.robot[k]), answers.sequences[k]
        plant, sigma = plant_of(problems.layout(place)), problems.sigma(place)
        best, wrench = problems.sequences.best_error[k], problems.sequences.wrench[k]
        errors.append(score(path, plant, sigma, wrench, best).relative)
        for last, now in zip(path[:-1], path[1:], strict=True):
            if last.command is not None and now.command is not None:
                steps.append(command_change([last.command, now.command])[0])
    if not errors:
        return None
    error, step = np.concatenate(errors), np.concatenate(steps) if steps else np.full((1, 3), np.nan)
    mean, most = step.mean(0), step.max(0)
    return {
        "ticks": len(error),
        "solved": float((error <= SOLVED).mean()),
        "error": float(error.mean()),
        "amplitude": _known(mean[0]),
        "frequency": _known(mean[1]),
        "turn": _known(mean[2]),
        "amplitude_max": _known(most[0]),
        "frequency_max": _known(most[1]),
        "turn_max": _known(most[2]),
    }


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _mean(values: Array | NDArray[np.bool_]) -> float | None:
    return float(values.mean()) if len(values) else None


def _mean_ratio(values: Array, best: Array, chosen: NDArray[np.bool_]) -> float | None:
    """Mean of values over the best known, where both are."""
    both = chosen & np.isfinite(values) & np.isfinite(best)
    return _mean((values / best)[both])


def _quantile_ms(seconds: Array, share: float) -> float | None:
    return float(1e3 * np.quantile(seconds, share)) if len(seconds) else None
