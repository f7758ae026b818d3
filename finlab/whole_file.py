"""Files that are either there whole or not at all, and folders for them."""

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from finlab.errors import DataError, FinlabError, LayoutError

PART = ".part"
"""What the name of a file that is being written ends with; it begins with a dot."""


def write_whole(
    path: str | os.PathLike[str], content: str | bytes, error: type[FinlabError] = LayoutError
) -> None:
    """Write a file, replacing an existing one; a kill or a full disk never leaves half of it.

    A link is followed; what is no regular file (`/dev/stdout`) is written to, not replaced. Raises
    FinlabError: of the kind `error`; the file cannot be written."""
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
    """Write files beside their places, and put them there in order once all are on the disk. Raises
    FinlabError: of the kind `error`; one cannot be written, and none is there. It calls them
    `name`."""
    parts = {file.with_name(f".{file.name}.{os.getpid()}{PART}"): file for file in files}
    try:
        for part, file in parts.items():
            with part.open("wb") as stream:
                stream.write(files[file])
                stream.flush()
                os.fsync(stream.fileno())
        for part, file in parts.items():
            os.replace(part, file)
    except OSError as failure:
        raise error(f"{name}: cannot be written: {failure.strerror}") from None
    finally:
        for part in parts:
            with suppress(OSError):
                part.unlink()


def write_folder(
    folder: str | os.PathLike[str], files: Mapping[str, bytes], strangers: Iterable[Path], what: str
) -> None:
    """Write files by name into a folder, which is made, as `write_together` does. Raises DataError:
    one cannot be written; or there are `strangers`, files that are no part of `what`, and nothing
    is written."""
    path = Path(folder)
    if odd := sorted(strangers):
        name = odd[0].relative_to(path).as_posix()
        raise DataError(
            f"{path}: holds {name!r:.60}, which is no part of {what}; name an empty folder"
        )
    for name in files:
        make_folder((path / name).parent)
    write_together({path / name: content for name, content in files.items()}, DataError, str(path))


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder and those above it, unless they are there. Raises DataError: that cannot be."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise DataError(f"{path}: cannot be made a folder: {failure.strerror}") from None
    return folder


def sweep_parts(folder: Path) -> None:
    """Remove what a killed process has left of files that it was writing in a folder."""
    for part in folder.glob(f".*{PART}"):
        with suppress(OSError):
            part.unlink()
