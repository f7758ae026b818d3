"""Atomic writes: files that are either there whole or not at all, and folders for them.

Whatever finlab saves goes through here: layouts, bundles, checkpoints, tables, logs, pictures.
"""

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from finlab.errors import DataError, FinlabError, LayoutError

TEMPORARY_SUFFIX = ".part"
"""End of the name of a file that is being written; the name begins with a dot."""


def write_whole(
    path: str | os.PathLike[str], content: str | bytes, error: type[FinlabError] = LayoutError
) -> None:
    """Writes a file, replacing an existing one; a kill or a full disk never leaves half of it.

    A link is followed. What is no regular file (`/dev/stdout`) is written to, not replaced.

    Args:
        path: the file.
        content: text, which becomes UTF-8, or bytes.
        error: class of the errors.

    Raises:
        FinlabError: of class `error`; the file cannot be written.
    """
    file = Path(os.path.realpath(path))
    data = content.encode() if isinstance(content, str) else content
    try:
        if file.exists() and not file.is_file():
            file.write_bytes(data)
            return
    except OSError as failure:
        raise error(f"{path}: cannot be written: {failure.strerror}") from None
    write_together({file: data}, error, str(path))


def write_together(files: Mapping[Path, bytes], error: type[FinlabError], name: str) -> None:
    """Writes several files under temporary names, and renames them in order once all are on disk.

    Args:
        files: path -> content.
        error: class of the errors.
        name: what the errors call the files.

    Raises:
        FinlabError: of class `error`; one cannot be written, and none is there.
    """
    final_of_temporary = {}
    for file in files:
        temporary = file.with_name(f".{file.name}.{os.getpid()}{TEMPORARY_SUFFIX}")
        final_of_temporary[temporary] = file
    try:
        for temporary, file in final_of_temporary.items():
            with temporary.open("wb") as stream:
                stream.write(files[file])
                stream.flush()
                os.fsync(stream.fileno())
        for temporary, file in final_of_temporary.items():
            os.replace(temporary, file)
    except OSError as failure:
        raise error(f"{name}: cannot be written: {failure.strerror}") from None
    finally:
        for temporary in final_of_temporary:
            with suppress(OSError):
                temporary.unlink()


def write_folder(
    folder: str | os.PathLike[str], files: Mapping[str, bytes], foreign: Iterable[Path], what: str
) -> None:
    """Writes files into a folder, which is made, as `write_together` does.

    Args:
        folder: the folder.
        files: name in the folder, which may have folders in it -> content.
        foreign: files in the folder that are no part of `what`; where there are any, nothing is
            written, so that nobody's files are mixed with these.
        what: what the folder holds, for the message, such as `a bundle`.

    Raises:
        DataError: one cannot be written, or there are foreign files.
    """
    path = Path(folder)
    foreign_files = sorted(foreign)
    if foreign_files:
        name = foreign_files[0].relative_to(path).as_posix()
        raise DataError(
            f"{path}: holds {name!r:.60}, which is no part of {what}; name an empty folder"
        )
    for name in files:
        make_folder((path / name).parent)
    write_together({path / name: content for name, content in files.items()}, DataError, str(path))


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Makes a folder and those above it, unless they are there.

    Raises:
        DataError: it cannot be made.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise DataError(f"{path}: cannot be made a folder: {failure.strerror}") from None
    return folder


def remove_temporary_files(folder: Path) -> None:
    """Removes what a killed process has left of files that it was writing in a folder."""
    for temporary in folder.glob(f".*{TEMPORARY_SUFFIX}"):
        with suppress(OSError):
            temporary.unlink()
