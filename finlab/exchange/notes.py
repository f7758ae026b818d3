"""Notes of a conversion: what was taken where a file is silent, what was read or left out."""

from dataclasses import dataclass

from finlab.exchange.questions import Question


@dataclass(frozen=True)
class Note:
    """One sentence on a conversion.

    The sentence is in the words of the file. What to do about it differs: the command line has
    options and keys of layout files, the app has boxes.
    """

    sentence: str
    """Without a full stop."""
    remedy: str = ""
    """What to do about it, for the command line; empty where there is nothing to do."""
    field: str = ""
    """Field of the actuators, or `body.` and a field of the body, that holds what was taken; empty
    where none does."""
    actuators: tuple[str, ...] = ()
    """Names of those that the field is of; all of them when empty."""
    question: Question | None = None
    """The question that was not asked; its default was taken."""

    @property
    def is_assumption(self) -> bool:
        """Whether something was taken for granted, which a user may know better."""
        return bool(self.field) or self.question is not None

    def __str__(self) -> str:
        """The note of the command line."""
        return f"{self.sentence}; {self.remedy}." if self.remedy else f"{self.sentence}."
