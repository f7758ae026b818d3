"""What the `eval` verbs share: kinds of arguments, checks before the work, JSON files after it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import arg

if TYPE_CHECKING:
    from finlab.allocation import Allocator
    from finlab.layout import Layout

Count = Annotated[int, arg(metavar="N")]
Split = Annotated[str, arg(metavar="NAME")]
Methods = Annotated[str, arg(metavar="A,B,...")]
Checkpoint = Annotated[str | None, arg(metavar="NAME|FOLDER")]
JsonFile = Annotated[Path | None, arg(metavar="FILE")]
Folder = Annotated[Path | None, arg(metavar="DIR")]


def load_methods(methods: str, checkpoint: str | None) -> dict[str, Allocator]:
    """All methods, loaded before the first one runs so that a wrong name costs no time."""
    from finlab.evaluation.method_specs import load_method_spec, method_names

    return {name: load_method_spec(name, checkpoint) for name in method_names(methods)}


def open_layouts(names: str) -> list[Layout]:
    """Layouts from their names or files, with commas between."""
    from finlab.cli.inputs import open_robot
    from finlab.errors import LayoutError

    texts = [text.strip() for text in names.split(",") if text.strip()]
    if not texts:
        raise LayoutError(f"layouts: expected names or files with commas between (A,penta), got {names!r}")
    return [open_robot(text).layout for text in texts]


def check_positive(name: str, value: int | None) -> None:
    """Refuse a number below one."""
    from finlab.errors import DataError

    if value is not None and value < 1:
        raise DataError(f"{name}: expected a number of at least 1, got {value}")


def check_writable(path: Path | None) -> None:
    """Refuse a file that cannot be written before the work, not after."""
    from finlab.errors import DataError

    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise DataError(f"json: expected a file in an existing folder, got {path}")


def check_folder(name: str, path: Path | None) -> None:
    """Refuse a folder that cannot be one."""
    from finlab.errors import DataError

    if path is not None and path.exists() and not path.is_dir():
        raise DataError(f"{name}: expected a folder, got the file {path}")


def write_json(path: Path | None, content: dict[str, Any]) -> None:
    """Write the rows, where a file was named."""
    if path is not None:
        path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", "utf-8")
