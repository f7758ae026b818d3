"""Files that are either there whole or not at all."""

import os
from contextlib import suppress
from pathlib import Path

from finlab.errors import FinlabError, LayoutError


def write_whole(
    path: str | os.PathLike[str], content: str | bytes, error: type[FinlabError] = LayoutError
) -> None:
    """Write a file, replacing an existing one; a kill or a full disk never leaves half of it.

    Raises:
        FinlabError: of the kind `error`; the file cannot be written.
    """
    file = Path(path)
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
        os.replace(part, file)
    except OSError as failure:
        with suppress(OSError):
            part.unlink()
        raise error(f"{path}: cannot be written: {failure.strerror}") from None
