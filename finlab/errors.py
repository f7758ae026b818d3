"""Errors that a user can cause, under one base class, and how a command ends with one.

A message is one plain sentence that says what was got, what was expected, where, and what to do.
The command line prints it behind `finlab: error: ` and exits with status 2; the app shows it as a
notification.
"""

import errno
import io
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, redirect_stdout, suppress


def printable(text: str) -> str:
    """Returns a text with whatever a terminal would obey, or not show, as Python's escapes: names
    in it may come from a stranger."""
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

    The parts are kept apart so that a check deep inside (which knows the problem and the argument),
    the actuator (which knows its name) and the reader of a file (which knows the key of that
    argument and where it lies) can each add what they know.
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
        """Returns the same error with the actuator that it is about, unless that is known
        already."""
        return LayoutError(self.problem, self.key, self.source, self.actuator or actuator)


class CommandError(FinlabError):
    """A command or wrench has the wrong length, shape or values."""


class CheckpointError(FinlabError):
    """A checkpoint is missing, corrupt, of another format, or made for something else."""


class AllocationError(FinlabError):
    """A method cannot answer the question it was asked."""


class DataError(FinlabError):
    """A data set, a table of forces or a shard on disk is missing, corrupt or inconsistent."""


@contextmanager
def under(key: str = "", source: str = "") -> Iterator[None]:
    """Puts `key` before the keys of layout errors raised inside, and `source`, their file, before
    that."""
    try:
        yield
    except LayoutError as error:
        raise error.under(key, source) from None


FAILED = 2
"""Exit code after an error that is printed in one sentence."""
INTERRUPTED = 130
"""128 + SIGINT, as shells report it."""
BROKEN_PIPE = 141
"""128 + SIGPIPE, as shells report it."""


class ClosedOutput(io.TextIOBase):
    """Standard output of a command that was started without it, as by `>&-`: Python has None in its
    place, and `print` then says nothing and succeeds, as if somebody had read it."""

    def writable(self) -> bool:
        return False

    def write(self, text: str, /) -> int:
        raise OSError(errno.EBADF, "standard output is closed")


def exit_code(program: str, work: Callable[[], int]) -> int:
    """The exit code of a command: that of its work, or one of the above after one sentence on
    stderr.

    Standard output that is full or closed is an error like any other; a reader that ended early,
    such as `head`, has what it wanted, and gets no words.
    """
    output = nullcontext() if sys.stdout is not None else redirect_stdout(ClosedOutput())
    with output:
        return _code_of(program, work)


def _code_of(program: str, work: Callable[[], int]) -> int:
    try:
        code = work()
        sys.stdout.flush()
        return code
    except FinlabError as error:
        return _fail(program, str(error))
    except KeyboardInterrupt:
        return INTERRUPTED
    except OSError as error:
        if error.filename is not None:
            return _fail(program, f"{error.filename}: {error.strerror}")
        _drop_output()
        if isinstance(error, BrokenPipeError):
            return BROKEN_PIPE
        return _fail(
            program, f"cannot print: {error.strerror or error}; write the output to another place"
        )


def _fail(program: str, sentence: str) -> int:
    if sys.stderr is not None:
        with suppress(OSError):
            print(f"{program}: error: {sentence}", file=sys.stderr)
    return FAILED


def _drop_output() -> None:
    """Give standard output somewhere to write: Python flushes it once more at exit."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
