"""Questions that a file of another program leaves open, as data: what is asked, among what, and
which option of an exchange holds the answer.

A reader that cannot go on without an answer raises a `QuestionError`; one that takes a default puts
the question into its note (`notes`). The command line words both by its options. The app makes a
dialog of them, and reads the file again with the answers (`inquiry`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

from finlab.errors import LayoutError

Option = Literal["model", "thrusters", "fins", "rows", "frame", "length", "origin", "missing_force"]
"""Field of `Exchange` that an answer sets; in the order in which they are asked."""
Answers = Mapping[Option, tuple[str, ...]]
"""Values of the choices that were made, by option; of `missing_force` also two numbers."""


class Choice(NamedTuple):
    """One of the answers to a question."""

    value: str
    """What the option gets."""
    words: str
    """What it is called."""
    meaning: str = ""
    """What it would make of this file; empty where there is nothing to say."""


@dataclass(frozen=True)
class Question:
    """What a file leaves open."""

    option: Option
    asks: str
    """A sentence that ends with a question mark."""
    why: str
    """What the file lacks, as a sentence."""
    choices: tuple[Choice, ...]
    default: tuple[str, ...]
    """Values of the choices that are likely, or are taken without an answer."""
    takes_several: bool = False
    """Whether any number of choices may be made, or none; else it is one."""
    takes_numbers: bool = False
    """Whether two numbers, least and most, do in place of a choice."""

    def words_of(self, answer: tuple[str, ...]) -> str:
        """Returns an answer as people read it."""
        words = {choice.value: choice.words for choice in self.choices}
        if self.takes_numbers and len(answer) == 2:
            return f"{answer[0]} to {answer[1]} N"
        return ", ".join([words.get(value, value) for value in answer]) or "none"


class QuestionError(LayoutError):
    """A file cannot be read until questions are answered.

    Its text is worded for the command line, by options.
    """

    def __init__(
        self,
        problem: str,
        key: str = "",
        source: str = "",
        actuator: str = "",
        questions: tuple[Question, ...] = (),
    ) -> None:
        """Takes the parts of a `LayoutError`, and the questions, whose answers do together."""
        super().__init__(problem, key, source, actuator)
        self.questions = questions

    def with_prefix(self, prefix: str, source: str = "") -> "QuestionError":
        """Returns the same error with a longer path of its key; see `LayoutError`."""
        longer = super().with_prefix(prefix, source)
        return QuestionError(
            longer.problem, longer.key, longer.source, longer.actuator, self.questions
        )


def which_robot(names: list[str], kind: str = "robots") -> Question:
    """Returns the question which of several robots is meant; the first is taken without an answer.

    Args:
        names: of the robots.
        kind: what the file calls them, in the plural.
    """
    return Question(
        "model",
        "Which robot?",
        f"The file holds {len(names)} {kind}.",
        tuple(Choice(name, name) for name in names),
        (names[0],),
    )


def which_frame(why: str, meanings: tuple[str, str] = ("", "")) -> Question:
    """Returns the question for the frame of a matrix or of places; FLU is taken without an answer.

    Args:
        why: what the file lacks, as a sentence.
        meanings: what FLU and FRD would make of the file.
    """
    choices = (
        Choice("FLU", "x forward, y left, z up (FLU, ENU, ROS)", meanings[0]),
        Choice("FRD", "x forward, y right, z down (FRD, NED, SNAME, PX4)", meanings[1]),
    )
    return Question("frame", "Which frame?", why, choices, ("FLU",))


def which_links(
    kinds: Mapping[str, str], pushing: tuple[str, ...], finned: tuple[str, ...]
) -> tuple[Question, Question]:
    """Returns the questions which links push, and which are fins, of a file whose links no plugin
    or actuator drives.

    Args:
        kinds: the links that a joint moves, with words on that joint.
        pushing: links whose names are those of thrusters.
        finned: links whose names are those of fins.
    """
    choices = tuple(Choice(link, link, words) for link, words in kinds.items())
    why = "No plugin or actuator of the file drives one. These hang on a joint."
    return (
        Question("thrusters", "Which links push?", why, choices, pushing, takes_several=True),
        Question(
            "fins",
            "Which links are fins?",
            "A fin flaps about the axis of its joint.",
            choices,
            finned,
            takes_several=True,
        ),
    )


def which_origin(lack: str) -> Question:
    """Returns the question where the centre of gravity is, of a file that does not say it.

    Args:
        lack: what the file lacks, as a sentence.
    """
    choice = Choice("base", "At the origin of the file's base")
    return Question("origin", "Where is the centre of gravity?", lack, (choice,), (choice.value,))


def which_rows(why: str, may_be_axes: bool = True) -> Question:
    """Returns the question what the rows of numbers stand for.

    Args:
        why: what is open, as a sentence.
        may_be_axes: whether there are as many rows as axes.
    """
    choices = [Choice("thrusters", "A thruster each: its Fx, Fy, Fz, Tx, Ty, Tz")]
    if may_be_axes:
        choices.insert(0, Choice("axes", "An axis each: Fx, Fy, Fz, Tx, Ty, Tz of all thrusters"))
    return Question("rows", "What does a row stand for?", why, tuple(choices), (choices[0].value,))


def which_length(reach: float) -> Question:
    """Returns the question which unit lengths have, of a file whose largest one is `reach`."""
    choices = []
    for unit, meters in (("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)):
        meaning = f"the farthest thruster is {reach * meters:g} m away"
        choices.append(Choice(unit, unit, meaning))
    return Question(
        "length",
        "In which unit are the places?",
        f"They reach {reach:g}, and no key names a unit.",
        tuple(choices),
        ("mm",),
    )
