"""Assumptions on a robot that was read from a file.

Its rows are settled one by one, as the user corrects or confirms them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from finlab.exchange import Answers, Note, Question
from finlab.layout import Layout

BODY = "body."
"""Start of the name of a body's field."""
Value = tuple[str, Any]
"""The name of an actuator, empty for the body, and the value of a field."""


@dataclass(frozen=True)
class Granted:
    """A value that was taken where the file is silent, or an answer to a question about it."""

    sentence: str
    """In the words of the file, without a full stop."""
    field: str = ""
    """Field of the actuators that holds it, or `body.` and one of the body; empty where none
    does."""
    taken: tuple[Value, ...] = ()
    """What was taken for each."""
    option: str = ""
    """Option of the question about it, which can be asked again; empty where there is none."""
    is_confirmed: bool = False
    """Whether the user said that it is right."""

    def left(self, layout: Layout) -> tuple[str, ...]:
        """Names of those in a layout that still have the value that was taken; the empty name is
        the body's."""
        names = []
        for name, value in self.taken:
            is_there = not name or name in layout.names
            if is_there and _value(layout, name, self.field) == value:
                names.append(name)
        return tuple(names)

    def is_settled(self, layout: Layout) -> bool:
        """Whether the user has confirmed it, or corrected it everywhere."""
        return self.is_confirmed or (bool(self.field) and not self.left(layout))

    def renamed(self, names: Mapping[str, str]) -> "Granted":
        """The same with other names of actuators, without those that have none."""
        taken = tuple((names.get(name, ""), value) for name, value in self.taken)
        if self.field.startswith(BODY):
            return self
        return replace(self, taken=tuple(pair for pair in taken if pair[0]))


@dataclass(frozen=True, eq=False)
class SourceFile:
    """The file that a robot was read from, so that questions about it can be asked again."""

    name: str
    content: bytes
    answers: Answers
    """Those that were given."""
    asked: Mapping[str, Question]
    """Questions that were asked about it, by option."""
    remarks: tuple[str, ...] = ()
    """What else was read of it, or left out, as sentences."""


def _value(layout: Layout, name: str, field: str) -> Any:
    """The value of a field of an actuator, or of the body where there is no name."""
    if field.startswith(BODY):
        return getattr(layout.body, field.removeprefix(BODY), None)
    if name not in layout.names:
        return None
    return getattr(layout.actuator(name), field, None)


def granted_of(
    layout: Layout, notes: Sequence[Note], answers: Answers, asked: Mapping[str, Question]
) -> tuple[Granted, ...]:
    """Returns the rows of a robot that was read: first what the user answered, then what nobody was
    asked.

    Args:
        layout: the robot.
        notes: what was read, taken and left out.
        answers: those that were given.
        asked: the questions that they answer, by option.
    """
    rows = []
    for option, values in answers.items():
        question = asked[option]
        words = f"{question.asks} {question.words_of(values)}"
        rows.append(Granted(words, option=option, is_confirmed=True))
    for note in notes:
        if not note.is_assumption:
            continue
        names: Sequence[str] = note.actuators or layout.names
        if note.field.startswith(BODY):
            names = ("",)
        taken = []
        for name in names if note.field else ():
            value = _value(layout, name, note.field)
            taken.append((name, value))
        asked_by = "" if note.question is None else note.question.option
        rows.append(Granted(note.sentence, note.field, tuple(taken), asked_by))
    return tuple(rows)


def remarks_of(notes: Sequence[Note]) -> tuple[str, ...]:
    """Returns what was read or left out, as sentences."""
    return tuple(f"{note.sentence}." for note in notes if not note.is_assumption)
