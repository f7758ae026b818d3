"""Errors that a user can cause, under one base class.

A message is one plain sentence that says what was got, what was expected, where, and what to do. The command
line prints it behind `finlab: error: ` and exits with status 2; the app shows it as a notification.
"""


def printable(text: str) -> str:
    """Returns a text with whatever a terminal would obey, or not show, as Python's escapes: names in it may
    come from a stranger."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\u00a0" else ascii(c)[1:-1] for c in text)


class FinlabError(Exception):
    """Base of all errors that finlab raises on purpose. Its text is meant to be read by a user."""

    def __init__(self, text: str = "") -> None:
        """Takes the sentence, and makes it `printable`."""
        super().__init__(printable(text))

    @classmethod
    def at(cls, source: str, problem: str, key: str = "") -> "FinlabError":
        """Returns an error about a file that is called `source`, at a key in it."""
        return cls(": ".join(part for part in (source, key, problem) if part))


class LayoutError(FinlabError):
    """A layout, or the file that describes it, is not acceptable.

    The parts are kept apart so that a check deep inside (which knows the problem and the argument), the
    actuator (which knows its name) and the reader of a file (which knows the key of that argument and where
    it lies) can each add what they know.
    """

    def __init__(self, problem: str, key: str = "", source: str = "", actuator: str = "") -> None:
        """Joins the parts to `source: key of actuator: problem`, leaving out empty ones.

        Args:
            problem: what was got and what was expected.
            key: the argument in Python, the path of the key in a file.
            source: the file.
            actuator: whose argument or key it is, such as `thruster 'lift'`.
        """
        place = " of ".join(part for part in (key, actuator) if part)
        super().__init__(": ".join(part for part in (source, place, problem) if part))
        self.problem = problem
        self.key = key
        self.source = source
        self.actuator = actuator

    @classmethod
    def at(cls, source: str, problem: str, key: str = "") -> "LayoutError":
        """Returns an error about a file that is called `source`, at a key in it."""
        return cls(problem, key, source)

    def under(self, prefix: str, source: str = "") -> "LayoutError":
        """Returns the same error seen from further out: `prefix` goes before the key."""
        if prefix and self.key and not self.key.startswith("["):
            prefix += "."
        return LayoutError(self.problem, prefix + self.key, source or self.source, self.actuator)

    def about(self, actuator: str) -> "LayoutError":
        """Returns the same error with the actuator that it is about, unless that is known already."""
        return LayoutError(self.problem, self.key, self.source, self.actuator or actuator)


class CommandError(FinlabError):
    """A command or wrench has the wrong length, shape or values."""


class CheckpointError(FinlabError):
    """A checkpoint is missing, corrupt, of another format, or made for something else."""


class AllocationError(FinlabError):
    """A method cannot answer the question it was asked."""


class DataError(FinlabError):
    """A data set, a table of forces or a shard on disk is missing, corrupt or inconsistent."""
