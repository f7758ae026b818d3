"""Asks a method every question: each ends in a command or in a failure, whatever the method does."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.bench.child import Child, Reply
from finlab.bench.problems import Problems
from finlab.bench.protocol import CPU, GREETING, Failure, checked_commands, parse_answer, question
from finlab.errors import AllocationError
from finlab.evaluation.progress import progress
from finlab.layout.file import layout_to_dict
from finlab.physics import Plant, plant_of

LIMIT_S = 1.0
"""Longest time for one target [s]; a later answer is a failure."""
PATIENCE = 4.0
"""How many times the limit is waited for an answer before the process is ended."""
START_S = 60.0
"""Longest time for a process to start [s]."""
FIRST_S = 60.0
"""Longest time for the first answer about a robot [s]."""
GIVE_UP = 3
"""Processes that end or hang one after the other before no further question is asked."""


class Answer(NamedTuple):
    """What came of one target."""

    command: Array | None
    """The command (n, 3), within its limits; None for a failure."""
    seconds: float
    """Time of the call over its targets; NaN where nothing came back."""
    failure: Failure | None
    """Why there is no command."""


@dataclass(frozen=True)
class Method:
    """A method under test."""

    name: str
    """What the tables call it."""
    command: tuple[str, ...]
    """The process that speaks the protocol."""
    greets: bool = False
    """Whether it says that it is ready, and tells how long each call took: finlab's own worker."""

    @classmethod
    def of(cls, name: str, cpu: bool = False) -> "Method":
        """One of finlab's methods, `module:function` or `file.py:function`; timed by the processor's time,
        which other work on the machine does not prolong, or by the wall clock."""
        shown = name.rpartition("/")[2] if ":" in name else name
        worker = (sys.executable, "-m", "finlab.bench.worker", name)
        return cls(shown, (*worker, CPU) if cpu else worker, greets=True)


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
    method: Method, problems: Problems, limit_s: float = LIMIT_S, together: bool = False
) -> Answers:
    """Ask a method everything.

    The first call for each robot is not counted: a robot's computer keeps its layout for long.

    Args:
        method: the process to ask.
        problems: what to ask.
        limit_s: longest time for one target [s].
        together: ask for all single targets of a robot in one call, in place of one by one; their limits
            add up.

    Raises:
        DataError: the program cannot be started.
        AllocationError: finlab's worker cannot load the method.
    """
    found = Answers(method.name, [_NOTHING] * len(problems.targets.robot))
    with Asker(method, limit_s) as asker:
        for place in progress(np.unique(problems.targets.robot).tolist(), "robot", method.name):
            asker.turn_to(problems, place)
            rows = np.flatnonzero(problems.targets.robot == place)
            for part in [rows] if together else np.split(rows, len(rows)):
                for row, answer in zip(part, asker.ask(problems.targets.wrench[part]), strict=True):
                    found.targets[row] = answer
        paths = list(zip(problems.sequences.robot.tolist(), problems.sequences.wrench, strict=True))
        for place, path in progress(paths, "path", method.name):
            asker.turn_to(problems, place)
            previous, answers = None, []
            for wrench in path:
                answers += asker.ask(wrench[None], previous)
                previous = previous if answers[-1].command is None else answers[-1].command
            found.sequences.append(answers)
    return found


class Asker:
    """One method's process and what it is asked at present."""

    def __init__(self, method: Method, limit_s: float) -> None:
        self.method, self.limit_s = method, limit_s
        self.child = Child(method.command, method.greets)
        self.number, self.lost = 0, 0
        self.plant: Plant
        self.layout: dict[str, Any]
        self.sigma: Array

    def __enter__(self) -> "Asker":
        return self

    def __exit__(self, *_: object) -> None:
        self.child.stop()

    def turn_to(self, problems: Problems, place: int) -> None:
        """Make the robot at a place the one that is asked about; its first call is not counted."""
        layout = problems.layout(place)
        self.plant, self.layout, self.sigma = plant_of(layout), layout_to_dict(layout), problems.sigma(place)
        self.ask(problems.targets.wrench[problems.targets.robot == place][:1], wait_s=FIRST_S)

    def ask(self, targets: Array, previous: Array | None = None, wait_s: float = 0.0) -> list[Answer]:
        """Answers to targets (N, 6) in one call."""
        count, limit = len(targets), self.limit_s * len(targets)
        if self.lost >= GIVE_UP:
            return [Answer(None, math.nan, Failure("died", "not asked any more"))] * count
        if not self.child.runs:
            self._start()
            wait_s = max(wait_s, FIRST_S)
        self.number += 1
        line = question(self.number, self.layout, self.sigma, targets, previous)
        reply = self.child.ask(line, max(PATIENCE * limit, wait_s))
        answer = self._read(reply)
        if isinstance(answer, Failure):
            return [Answer(None, reply.seconds / count, answer)] * count
        seconds = float(answer.get("seconds", reply.seconds)) if self.method.greets else reply.seconds
        if seconds > max(limit, wait_s):
            late = Failure("late", f"{seconds:.2f} s for {count} target{'s' * (count > 1)}")
            return [Answer(None, seconds / count, late)] * count
        commands = checked_commands(answer["commands"], self.plant, count)
        if isinstance(commands, Failure):
            return [Answer(None, seconds / count, commands)] * count
        return [Answer(command, seconds / count, None) for command in commands]

    def _start(self) -> None:
        """Start the process; what keeps a method from starting at all is the user's to mend."""
        hello = self.child.start(START_S)
        said = None if hello is None else parse_answer(hello.line or b"", GREETING)
        if isinstance(said, Failure) and self.number == 0:
            words = said.words if hello and hello.line else self.child.last_words()
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


def failures(answers: Sequence[Answer]) -> list[Failure]:
    """Those that failed."""
    return [answer.failure for answer in answers if answer.failure is not None]
