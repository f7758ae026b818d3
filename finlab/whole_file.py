"""Files and folders that are either there whole or not at all."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from finlab.errors import FinlabError, LayoutError


def write_whole(
    path: str | os.PathLike[str], content: str | bytes, error: type[FinlabError] = LayoutError
) -> None:
    """Write a file, replacing an existing one; a kill or a full disk never leaves half of it.

    A link is followed; what is no regular file (`/dev/stdout`) is written to, not replaced.

    Raises:
        FinlabError: of the kind `error`; the file cannot be written.
    """
    file = Path(os.path.realpath(path))
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    data = content.encode() if isinstance(content, str) else content
    try:
        if file.exists() and not file.is_file():
            file.write_bytes(data)
            return
        part.write_bytes(data)
        os.replace(part, file)
    except OSError as failure:
        with suppress(OSError):
            part.unlink()
        raise error(f"{path}: cannot be written: {failure.strerror}") from None


UNFINISHED = ".unfinished"
"""Folder inside a folder that is being filled."""


def check_new_folder(path: str | os.PathLike[str]) -> None:
    """Refuse what `whole_folder` would not fill: a file, or a folder that holds something.

    Raises:
        FinlabError: it is one.
    """
    folder = Path(path)
    if folder.exists() and not folder.is_dir():
        raise FinlabError(f"{path}: expected a new or empty folder, got a file")
    if folder.exists() and any(folder.iterdir()) and not (folder / UNFINISHED).exists():
        raise FinlabError(f"{path}: expected a new or empty folder; name another one")
    there = next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise FinlabError(f"{path}: cannot be made in {there}; name another folder")


@contextmanager
def whole_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A folder to write files into, which are moved to a new or empty folder when all of them are there.

    When writing fails nothing is left; what a kill leaves is overwritten by the next run.

    Raises:
        FinlabError: a file cannot be written.
    """
    folder = Path(path)
    part, made = folder / UNFINISHED, not folder.exists()
    try:
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        yield part
        for file in sorted(part.iterdir()):
            os.replace(file, folder / file.name)
        part.rmdir()
    except BaseException as failure:
        shutil.rmtree(part, ignore_errors=True)
        if made:
            with suppress(OSError):
                folder.rmdir()
        if isinstance(failure, FinlabError):
            raise type(failure)(str(failure).replace(f"{UNFINISHED}/", "")) from None
        if isinstance(failure, OSError):
            raise FinlabError(f"{path}: cannot be written: {failure.strerror or failure}") from None
        raise
