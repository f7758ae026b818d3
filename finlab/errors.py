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
    """Returns a text whose control characters are Python's escapes, such as `\\x1b`.

    Names in a message may come from a stranger's file, and a terminal obeys control characters.
    Line ends and non-breaking spaces stay.
    """
    if text.isprintable():
        return text
    characters = []
    for character in text:
        is_shown = character.isprintable() or character in "\n\u00a0"
        characters.append(character if is_shown else ascii(character)[1:-1])
    return "".join(characters)


class FinlabError(Exception):
    """Base of all errors that finlab raises on purpose. Its text is meant to be read by a user."""

    def __init__(self, text: str = "") -> None:
        """Takes the sentence, and makes it `printable`."""
        super().__init__(printable(text))

    @classmethod
    def in_file(cls, source: str, problem: str, key: str = "") -> "FinlabError":
        """Returns an error about a file.

        Args:
            source: what to call the file, such as its path.
            problem: what was got and what was expected.
            key: path of the key in the file that is wrong; empty where it is the whole file.
        """
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
        location = " of ".join(part for part in (key, actuator) if part)
        super().__init__(": ".join(part for part in (source, location, problem) if part))
        self.problem = problem
        self.key = key
        self.source = source
        self.actuator = actuator

    @classmethod
    def in_file(cls, source: str, problem: str, key: str = "") -> "LayoutError":
        """Returns an error about a file; arguments as for `FinlabError.in_file`."""
        return cls(problem, key, source)

    def with_prefix(self, prefix: str, source: str = "") -> "LayoutError":
        """Returns the same error with a longer path of its key.

        Args:
            prefix: path of the part of the file in which the error was found; goes before the key.
            source: the file, where it is not known yet.
        """
        if prefix and self.key and not self.key.startswith("["):
            prefix += "."
        return LayoutError(self.problem, prefix + self.key, source or self.source, self.actuator)

    def for_actuator(self, actuator: str) -> "LayoutError":
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
def layout_errors_at(key: str = "", source: str = "") -> Iterator[None]:
    """Adds to layout errors that are raised inside where they were found.

    Args:
        key: path of the part of a file that is read inside; goes before the keys of the errors.
        source: the file.
    """
    try:
        yield
    except LayoutError as error:
        raise error.with_prefix(key, source) from None


EXIT_ERROR = 2
"""Exit code after an error that is printed in one sentence."""
EXIT_INTERRUPTED = 130
"""128 + SIGINT, as shells report it."""
EXIT_BROKEN_PIPE = 141
"""128 + SIGPIPE, as shells report it."""


class ClosedOutput(io.TextIOBase):
    """Standard output of a command that was started without it, as by `>&-`.

    Python has None in its place, with which `print` does nothing and succeeds, as if somebody had
    read it. This one refuses to be written to, so that the command fails.
    """

    def writable(self) -> bool:
        return False

    def write(self, text: str, /) -> int:
        raise OSError(errno.EBADF, "standard output is closed")


def exit_code(program: str, work: Callable[[], int]) -> int:
    """Runs a command, and returns its exit code.

    Standard output that is full or closed is an error like any other. A reader that ended early,
    such as `head`, has what it wanted: the command ends without a message.

    Args:
        program: name of the command, with which its messages begin.
        work: what the command does; returns its exit code.

    Returns:
        The exit code of the work, or one of the constants above after one sentence on stderr.
    """
    output = nullcontext() if sys.stdout is not None else redirect_stdout(ClosedOutput())
    with output:
        return _code_of(program, work)


def _code_of(program: str, work: Callable[[], int]) -> int:
    """As `exit_code`, with a standard output that is there or `ClosedOutput`."""
    try:
        code = work()
        sys.stdout.flush()
        return code
    except FinlabError as error:
        return _fail(program, str(error))
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except OSError as error:
        if error.filename is not None:  # a file of the command's own, not standard output
            return _fail(program, f"{error.filename}: {error.strerror}")
        _drop_output()
        if isinstance(error, BrokenPipeError):
            return EXIT_BROKEN_PIPE
        return _fail(
            program, f"cannot print: {error.strerror or error}; write the output to another place"
        )


def _fail(program: str, sentence: str) -> int:
    """Prints an error on stderr, unless that is closed, and returns the exit code."""
    if sys.stderr is not None:
        with suppress(OSError):
            print(f"{program}: error: {sentence}", file=sys.stderr)
    return EXIT_ERROR


def _drop_output() -> None:
    """Redirects standard output to nowhere, since Python flushes it once more at exit."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
