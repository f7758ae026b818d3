"""Output of a command: tables as plain text, its exit code, and one sentence on stderr where it fails."""

import errno
import io
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, redirect_stdout, suppress

from finlab.errors import FinlabError


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool]) -> str:
    """Cells under a head, padded with spaces: columns of words to the left, others to the right."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        each = zip(cells, widths, words, strict=True)
        return "  ".join(
            cell.ljust(width) if left else cell.rjust(width) for cell, width, left in each
        ).rstrip()

    return "\n".join(map(line, [head, *rows]))


FAILED = 2
"""Exit code after an error that is printed in one sentence."""
INTERRUPTED = 130
"""128 + SIGINT, as shells report it."""
BROKEN_PIPE = 141
"""128 + SIGPIPE, as shells report it."""


class ClosedOutput(io.TextIOBase):
    """Standard output of a command that was started without it, as by `>&-`: Python has None in its place,
    and `print` then says nothing and succeeds, as if somebody had read it."""

    def writable(self) -> bool:
        return False

    def write(self, text: str, /) -> int:
        raise OSError(errno.EBADF, "standard output is closed")


def exit_code(program: str, work: Callable[[], int]) -> int:
    """The exit code of a command: that of its work, or one of the above after one sentence on stderr.

    Standard output that is full or closed is an error like any other; a reader that ended early, such as
    `head`, has what it wanted, and gets no words.
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
        return _fail(program, f"cannot print: {error.strerror or error}; write the output to another place")


def _fail(program: str, sentence: str) -> int:
    if sys.stderr is not None:
        with suppress(OSError):
            print(f"{program}: error: {sentence}", file=sys.stderr)
    return FAILED


def _drop_output() -> None:
    """Give standard output somewhere to write: Python flushes it once more at exit."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
