"""`--json [FILE]`, the same for every verb: one JSON object in a file, or on stdout in place of the table."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from finlab.errors import DataError
from finlab.whole_file import write_whole

STDOUT = Path("-")
"""What stands for stdout."""
JsonFile = Annotated[Path | None, arg(metavar="[FILE]")]


def with_json_file(argv: Sequence[str]) -> list[str]:
    """Arguments in which `--json` without a file is followed by that of stdout."""
    whole: list[str] = []
    for word, after in zip(argv, [*argv[1:], None], strict=False):
        whole.append(word)
        bare = after is None or (after.startswith("-") and after != str(STDOUT))
        if word == "--json" and bare:
            whole.append(str(STDOUT))
    return whole


def check_json_file(path: Path | None, option: str = "json") -> None:
    """Refuse a file that cannot be written before the work, not after it."""
    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise DataError(f"{option}: expected a file in an existing folder, got {path}")


def put_json(value: Any, path: Path | None, table: str | None = None) -> None:
    """Write one JSON object into a file and print a table, where they are given; or print the object."""
    if path == STDOUT:
        print(json.dumps(value, allow_nan=False))
        return
    if path is not None:
        write_whole(path, json.dumps(value, indent=1, allow_nan=False) + "\n", DataError)
    if table is not None:
        print(table)
