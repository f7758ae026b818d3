"""Asks a method every question: each ends in a command or in a failure, whatever the method raises."""

import math
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from finlab.arrays import Array
from finlab.bench.methods import BenchMethod
from finlab.bench.problems import Problems
from finlab.layout.file import layout_to_dict
from finlab.physics import Plant, plant_of

LIMIT_S = 1.0
"""Longest time for one target [s]; a later answer is a failure."""
TOLERANCE = 1e-6
"""By how much a command may leave its limits, as a share of what they span and of one [rad, Hz, rad]."""
FAILURES = ("exception", "malformed", "not finite", "out of limits", "late")
"""What may be wrong with an answer: the method raised; it is no command; it holds NaN or an infinity; it
leaves the fin's limits; or it came too late."""


class Failure(NamedTuple):
    """Why there is no answer."""

    kind: str
    """One of `FAILURES`."""
    words: str
    """What was seen."""


class Answer(NamedTuple):
    """What came of one target."""

    command: Array | None
    """The command (n, 3), within its limits; None for a failure."""
    seconds: float
    """Time of the call; NaN where the method raised."""
    failure: Failure | None
    """Why there is no command."""


@dataclass
class Answers:
    """What a method did."""

    method: str
    """Its name."""
    targets: list[Answer] = field(default_factory=list)
    """One for each target."""
    sequences: list[list[Answer]] = field(default_factory=list)
    """One for each wrench of each sequence."""


def run_method(
    method: BenchMethod,
    problems: Problems,
    limit_s: float = LIMIT_S,
    done: Callable[[], object] = lambda: None,
    clock: Callable[[], float] = time.perf_counter,
) -> Answers:
    """Ask a method everything, on one thread of BLAS; what it prints goes to stderr.

    The first call for each robot is not counted: a robot's computer keeps its layout for long.

    Args:
        method: who is asked.
        problems: what to ask.
        limit_s: longest time for one target [s].
        done: called after each answer.
        clock: gives the time [s] by which calls are timed.
    """
    found = Answers(method.name, [_NOTHING] * len(problems.targets.robot))
    with threadpool_limits(1), redirect_stdout(sys.stderr):
        for robot in np.unique(problems.targets.robot).tolist():
            asker = _Asker(method, problems, robot, limit_s, clock)
            for row in np.flatnonzero(problems.targets.robot == robot):
                found.targets[row] = asker.ask(problems.targets.wrench[row])
                done()
        for robot, path in zip(problems.sequences.robot.tolist(), problems.sequences.wrench, strict=True):
            asker = _Asker(method, problems, robot, limit_s, clock)
            previous, answers = None, []
            for wrench in path:
                answers.append(asker.ask(wrench, previous))
                previous = previous if answers[-1].command is None else answers[-1].command
                done()
            found.sequences.append(answers)
    return found


class _Asker:
    """A method that is asked about one robot; its first call is not counted."""

    def __init__(
        self, method: BenchMethod, problems: Problems, robot: int, limit_s: float, clock: Callable[[], float]
    ) -> None:
        layout = problems.layout(robot)
        self._answer, self._limit_s, self._clock, self._plant = (
            method.answer,
            limit_s,
            clock,
            plant_of(layout),
        )
        self._known = {"layout": layout, "robot": layout_to_dict(layout), "sigma": problems.sigma(robot)}
        self.ask(problems.targets.wrench[problems.targets.robot == robot][0])

    def ask(self, target: Array, previous: Array | None = None) -> Answer:
        """The answer to a target (6,), with the command (n, 3) of the tick before."""
        begin = self._clock()
        try:
            given = self._answer(targets=target[None].astype(np.float64), previous=previous, **self._known)
        except Exception as error:  # whatever a method raises is one failure of it
            words = f"{type(error).__name__}: {error}"[:300]
            return Answer(None, math.nan, Failure("exception", words))
        seconds = self._clock() - begin
        if seconds > self._limit_s:
            return Answer(None, seconds, Failure("late", f"{seconds:.2f} s"))
        command = _checked(given, self._plant)
        if isinstance(command, Failure):
            return Answer(None, seconds, command)
        return Answer(command, seconds, None)


def _checked(given: Any, plant: Plant) -> Array | Failure:
    """The command (n, 3) of an answer, within the limits of a robot's fins.

    Fins that may turn freely may be given any angle.
    """
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return Failure("malformed", "expected numbers, three for each fin")
    if values.shape != (1, plant.n_fins, 3):
        return Failure("malformed", f"expected {(1, plant.n_fins, 3)}, got {values.shape}")
    if not np.isfinite(values).all():
        return Failure("not finite", "commands hold NaN or an infinity")
    within: Array = plant.feasible(values[0])
    away = np.abs(values[0] - within)
    away[plant.full_turn, 2] = 0.0
    room = TOLERANCE * np.maximum(plant.width, 1.0)
    if (away > room).any():
        fin, part = np.unravel_index(int((away - room).argmax()), away.shape)
        what = ("amplitude", "frequency", "zero direction")[part]
        return Failure("out of limits", f"{what} of {plant.layout.names[fin]} by {away.max():.3g}")
    return within


_NOTHING = Answer(None, math.nan, None)
