"""Reads a file of another program for somebody who can be asked: all questions at once.

Questions that must be answered are tried with their defaults, so that those behind them come to
light, too. `read_asking` gives what the file would be by the defaults, and everything that is open.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from finlab.errors import LayoutError
from finlab.exchange.convert import read_robot
from finlab.exchange.exchange import KNOWN_THRUSTERS, Exchange
from finlab.exchange.notes import Note
from finlab.exchange.questions import Answers, Option, Question, QuestionError
from finlab.layout import Layout

MAX_ROUNDS = 8
"""Most rounds of questions whose answers are tried: as many as there are options."""


@dataclass(frozen=True)
class Reading:
    """What a file holds, as far as that is known."""

    layout: Layout | None
    """By the answers, and by defaults for the rest; None where defaults do not do."""
    notes: tuple[Note, ...]
    """What was read, taken and left out."""
    questions: tuple[Question, ...]
    """Questions that the answers leave open."""


def exchange_of(answers: Answers) -> Exchange:
    """Returns an exchange with answers in it.

    Args:
        answers: by option, as `Question` has them.

    Raises:
        LayoutError: a force is neither that of a known thruster nor two numbers.
    """
    fields: dict[str, Any] = {}
    for option, values in answers.items():
        if option in ("thrusters", "fins"):
            fields[option] = values
        elif option == "missing_force":
            fields[option] = _force_of(values)
        else:
            fields[option] = values[0]
    return Exchange(**fields)


def _force_of(values: Sequence[str]) -> tuple[float, float]:
    """Least and most force [N] of an answer."""
    if len(values) == 1 and values[0] in KNOWN_THRUSTERS:
        return KNOWN_THRUSTERS[values[0]]
    try:
        low, high = [float(value) for value in values]
    except ValueError:
        raise LayoutError(
            f"expected least and most force, two numbers, got {' '.join(values)!r:.60}", "force"
        ) from None
    return low, high


def read_asking(text: str, file: str, answers: Answers) -> Reading:
    """Returns the layout in a text of any format, and what it leaves open.

    Args:
        text: the content of the file.
        file: the name of the file; see `read_robot`.
        answers: those that are known.

    Raises:
        LayoutError: the file cannot be read, whatever is answered.
    """
    question_of: dict[Option, Question] = {}
    tried: dict[Option, tuple[str, ...]] = dict(answers)
    for _ in range(MAX_ROUNDS):
        exchange = exchange_of(tried)
        try:
            layout = read_robot(text, file, exchange)
        except QuestionError as error:
            new = [question for question in error.questions if question.option not in tried]
            if not new:
                words = " ".join([question.asks for question in error.questions])
                raise LayoutError(
                    f"cannot be read by these answers: {words} Choose others", error.key
                ) from None
            for question in new:
                question_of[question.option] = question
                tried[question.option] = question.default
            if not any(question.default for question in new):
                break  # nothing is likely, and no default does
        except LayoutError:
            if not question_of:
                raise
            break  # the default does not do
        else:
            for note in exchange.taken:
                if note.question is not None and note.question.option not in answers:
                    question_of[note.question.option] = note.question
            return Reading(layout, tuple(exchange.taken), _ordered(question_of))
    return Reading(None, (), _ordered(question_of))


def _ordered(question_of: Mapping[Option, Question]) -> tuple[Question, ...]:
    """Questions in the order in which people think of a robot."""
    order = get_args(Option)
    return tuple(sorted(question_of.values(), key=lambda question: order.index(question.option)))
