"""What travels with a bundle in its `bundle.json`: the method and what it is made with."""

import json
from typing import TYPE_CHECKING, Any, NamedTuple

from finlab.bundle_files import ABOUT, VERSION, Files
from finlab.errors import DataError
from finlab.files.guarded import decoded
from finlab.files.plain_values import parse_json

if TYPE_CHECKING:
    from finlab.allocation.allocator import Allocator

FORMAT = "finlab-bundle"
METHODS_ON_BOARD = ("dual", "mdn")
"""Methods that a bundle can answer with."""


class About(NamedTuple):
    """What a bundle says of itself."""

    method: str
    """One of `METHODS_ON_BOARD`."""
    checkpoint: str | None
    """Name of the shipped checkpoint that the networks come from; None for methods without."""
    settings: dict[str, Any]
    """Settings of the method, by name, as the file holds them: the method checks them."""


def about_bundle(allocator: "Allocator", made_by: str) -> bytes:
    """The contents of `bundle.json` for an allocator, made by a version of finlab."""
    document = {
        "format": FORMAT,
        "version": VERSION,
        "finlab": made_by,
        "method": allocator.method,
        "checkpoint": allocator.checkpoint,
        "settings": vars(allocator.settings),
    }
    return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()


def read_about(files: Files, source: str) -> About:
    """What the allocator on board is made with.

    Raises:
        DataError: of another format, or a method that runs on no robot.
    """
    place = f"{source}/{ABOUT}"
    document = parse_json(decoded(files[ABOUT], place, "JSON"), place)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{place}: expected format {FORMAT}; a bundle is made by `finlab export`")
    method, checkpoint, values = (document.get(key) for key in ("method", "checkpoint", "settings"))
    if not isinstance(method, str) or method not in METHODS_ON_BOARD:
        known = ", ".join(METHODS_ON_BOARD)
        raise DataError(f"{place}: method must be one of {known}, got {method!r:.40}")
    if not isinstance(checkpoint, str | None) or not isinstance(values, dict):
        raise DataError(f"{place}: checkpoint must be a name and settings must be keys and values")
    return About(method, checkpoint, values)
