"""Asks a method every question: each ends in a command or in a failure, whatever the method does."""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self

import numpy as np

from finlab.arrays import Array
from finlab.bench.child import Child, Reply
from finlab.bench.problems import Problems
from finlab.bench.protocol import CPU, GREETING, Failure, checked_command, parse_answer, question
from finlab.errors import AllocationError
from finlab.layout.file import layout_to_dict
from finlab.physics import Plant, plant_of

LIMIT_S = 1.0
"""Longest time for one target [s]; a later answer is a failure."""
PATIENCE = 4.0
"""How many times the limit is waited for an answer before the process is ended."""
START_S, FIRST_S = 60.0, 60.0
"""Longest time for a process to start, and for the first answer about a robot [s]."""
GIVE_UP = 3
"""Processes that end or hang one after the other before no further question is asked."""


class Answer(NamedTuple):
    """What came of one target."""

    command: Array | None
    """The command (n, 3), within its limits; None for a failure."""
    seconds: float
    """Time of the call; NaN where nothing came back."""
    failure: Failure | None
    """Why there is no command."""


@dataclass(frozen=True)
class BenchMethod:
    """A method under test."""

    name: str
    """What the tables call it."""
    command: tuple[str, ...]
    """The process that speaks the protocol."""
    greets: bool = False
    """Whether it says that it is ready, and how long each call took: finlab's own worker."""

    @classmethod
    def of(cls, name: str, cpu: bool = False) -> Self:
        """One of finlab's methods, `module:function` or `file.py:function`; timed by the processor's time,
        which other work on the machine does not prolong, or by the wall clock."""
        worker = (sys.executable, "-m", "finlab.bench.worker", name, *((CPU,) if cpu else ()))
        return cls(name.rpartition("/")[2] if ":" in name else name, worker, greets=True)


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
) -> Answers:
    """Ask a method everything.

    The first call for each robot is not counted: a robot's computer keeps its layout for long.

    Args:
        method: the process to ask.
        problems: what to ask.
        limit_s: longest time for one target [s].
        done: called after each answer.

    Raises:
        DataError: the program cannot be started.
        AllocationError: finlab's worker cannot load the method.
    """
    found = Answers(method.name, [_NOTHING] * len(problems.targets.robot))
    with Asker(method, limit_s) as asker:
        for robot in np.unique(problems.targets.robot).tolist():
            asker.turn_to(problems, robot)
            for row in np.flatnonzero(problems.targets.robot == robot):
                found.targets[row] = asker.ask(problems.targets.wrench[row])
                done()
        for robot, path in zip(problems.sequences.robot.tolist(), problems.sequences.wrench, strict=True):
            asker.turn_to(problems, robot)
            previous, answers = None, []
            for wrench in path:
                answers.append(asker.ask(wrench, previous))
                previous = previous if answers[-1].command is None else answers[-1].command
                done()
            found.sequences.append(answers)
    return found


class Asker:
    """One method's process and the robot that it is asked about."""

    def __init__(self, method: BenchMethod, limit_s: float) -> None:
        self.method, self.limit_s = method, limit_s
        self.child = Child(method.command)
        self.number, self.lost = 0, 0
        self.plant: Plant
        self.layout: dict[str, Any]
        self.sigma: Array

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.child.stop()

    def turn_to(self, problems: Problems, robot: int) -> None:
        """Ask about a robot from now on; its first call is not counted."""
        layout = problems.layout(robot)
        self.plant, self.layout, self.sigma = plant_of(layout), layout_to_dict(layout), problems.sigma(robot)
        self.ask(problems.targets.wrench[problems.targets.robot == robot][0], wait_s=FIRST_S)

    def ask(self, target: Array, previous: Array | None = None, wait_s: float = 0.0) -> Answer:
        """The answer to a target (6,)."""
        if self.lost >= GIVE_UP:
            return Answer(None, math.nan, Failure("died", "not asked any more"))
        if not self.child.runs:
            self._start()
            wait_s = max(wait_s, FIRST_S)
        self.number += 1
        line = question(self.number, self.layout, self.sigma, target, previous)
        reply = self.child.ask(line, max(PATIENCE * self.limit_s, wait_s))
        answer, seconds = self._read(reply), reply.seconds
        if isinstance(answer, Failure):
            return Answer(None, seconds, answer)
        seconds = float(answer.get("seconds", seconds)) if self.method.greets else seconds
        if seconds > max(self.limit_s, wait_s):
            return Answer(None, seconds, Failure("late", f"{seconds:.2f} s"))
        command = checked_command(answer, self.plant)
        if isinstance(command, Failure):
            return Answer(None, seconds, command)
        return Answer(command, seconds, None)

    def _start(self) -> None:
        """Start the process; what keeps finlab's worker from starting at all is for the user to correct."""
        self.child.start()
        if not self.method.greets:
            return
        hello = self.child.ask("", START_S)
        said = parse_answer(hello.line or b"", GREETING)
        if isinstance(said, Failure) and self.number == 0:
            words = said.words if hello.line else self.child.last_words()
            raise AllocationError(f"method {self.method.name}: {words}")

    def _read(self, reply: Reply) -> dict[str, Any] | Failure:
        """The answer in a reply."""
        if reply.line:
            self.lost = 0
            return parse_answer(reply.line, self.number)
        self.lost += 1
        if reply.line is None:
            return Failure("late", f"no answer within {reply.seconds:.1f} s")
        words = self.child.last_words()
        self.child.stop(at_once=True)
        return Failure("died", words)


_NOTHING = Answer(None, math.nan, Failure("died", "not asked"))
