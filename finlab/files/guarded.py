"""The one way to open a file: a regular file, within a size, and one sentence where it is not."""

import os
import stat
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from finlab.errors import DataError, FinlabError

Name = str | os.PathLike[str]
PART = 1 << 20
"""Bytes that are read at once."""


def read_file(path: Name, most: int, what: str, error: type[FinlabError] = DataError) -> bytes:
    """Returns the content of a regular file of up to `most` bytes.

    A pipe, a socket and a device are refused without waiting for them. Raises FinlabError of the kind
    `error`: the file is missing, not regular, too large or not readable; the sentence says `what` is
    expected, such as "a layout file"."""
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            about = os.fstat(file.fileno())
            if stat.S_ISDIR(about.st_mode):
                raise error.at(str(path), f"is a folder, expected {what}")
            if not stat.S_ISREG(about.st_mode):
                raise error.at(str(path), f"is not a regular file, expected {what}")
            content = _read(file, most) if about.st_size <= most else None
    except FileNotFoundError:
        raise error.at(str(path), f"no such file, expected {what}") from None
    except IsADirectoryError:
        raise error.at(str(path), f"is a folder, expected {what}") from None
    except (OSError, ValueError) as problem:  # ValueError: a NUL byte in the name
        reason = getattr(problem, "strerror", None) or problem
        raise error.at(str(path)[:300], f"cannot be read: {reason}") from None
    if content is None or len(content) > most:
        raise error.at(str(path), f"is larger than {most:,} bytes, too large for {what}")
    return content


def _read(file: BinaryIO, most: int) -> bytes:
    """The content, or its first `most` + 1 bytes: a file may grow while it is read, and some report no size
    at all. A single `read` of that many would take the memory of the largest file for a small one."""
    content = BytesIO()
    while part := file.read(min(PART, most + 1 - content.tell())):
        content.write(part)
    return content.getvalue()


def read_text(path: Name, most: int, what: str, error: type[FinlabError] = DataError) -> str:
    """Returns the text of a regular file; arguments and errors as in `read_file`, and it must be text."""
    return decoded(read_file(path, most, what, error), str(path), what, error)


def decoded(content: bytes, source: str, what: str, error: type[FinlabError] = DataError) -> str:
    """Returns UTF-8 text, without a byte order mark. Raises FinlabError of the kind `error`: the bytes are no
    UTF-8 text; the message calls them `source`."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise error.at(source, f"is not UTF-8 text, expected {what}") from None
    if "\0" in text:
        raise error.at(source, f"is a binary file, expected {what}")
    return text


def is_regular(path: Name) -> bool:
    """Whether there is a regular file; False also for names that cannot be a path."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False
