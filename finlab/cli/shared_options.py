"""Options that several verbs share: robots by name, counts, `--json [FILE]` and `--cluster
ADDRESS`."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, UseAppendAction, arg

from finlab.errors import CommandError, DataError

if TYPE_CHECKING:
    from finlab.layout import Layout

JSON = "file for one JSON object; it is printed in place of the table where no file is named"
LAYOUT = "layout file, bundle, or the name of a shipped layout"
FLOW = (
    "velocity of the robot relative to the water, body frame [m/s, rad/s]; it is at rest by default"
)
CLUSTER = "Dask scheduler whose workers run the parts of the work, such as tcp://desk:8786"
EXECUTOR = "finlab.research.executor"
"""Where the workers of a cluster are asked; it is imported with an address alone."""
STDOUT = Path("-")  # what stands for stdout
JsonFile = Annotated[Path | None, arg(metavar="[FILE]", help=JSON)]  # where one JSON object goes
Wrench = tuple[float, float, float, float, float, float]
Flow = Annotated[Wrench | None, arg(metavar="VX VY VZ WX WY WZ", help=FLOW)]
Robot = Annotated[Positional[str], arg(metavar="LAYOUT", help=LAYOUT)]
Lost = Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")]
Free = Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="AXIS")]
Count = Annotated[int, arg(metavar="N")]
Cluster = Annotated[str | None, arg(metavar="ADDRESS", help=CLUSTER)]


def with_json_file(argv: Sequence[str]) -> list[str]:
    """Arguments in which `--json` without a file is followed by that of stdout."""
    words: list[str] = []
    for word, after in zip(argv, [*argv[1:], None], strict=False):
        words.append(word)
        bare = after is None or (after.startswith("-") and after != str(STDOUT))
        if word == "--json" and bare:
            words.append(str(STDOUT))
    return words


def check_json_file(path: Path | None, option: str = "json") -> None:
    """Refuse a file before the work, not after it. Raises DataError: it is in no folder, or is
    one."""
    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise DataError(f"{option}: expected a file in an existing folder, got {path}")


def put_json(value: Any, path: Path | None, table: str | None = None) -> None:
    """Write one JSON object into a file and print a table, where they are given; or print the
    object."""
    if path == STDOUT:
        print(json.dumps(value, allow_nan=False))
        return
    if path is not None:
        from finlab.whole_file import write_whole

        write_whole(path, json.dumps(value, indent=1, allow_nan=False) + "\n", DataError)
    if table is not None:
        print(table)


def open_robot(text: str, lost: tuple[str, ...] = ()) -> tuple[Layout, tuple[str, ...]]:
    """The layout in a file, or the shipped one of that name, and the names of all actuators that do
    not work: those that a bundle marks as lost and those named now, each once. Raises LayoutError:
    neither a readable file nor a shipped layout."""
    from finlab.assets import shipped_layouts
    from finlab.layout.load import load_layout_and_lost

    if text in shipped_layouts():
        layout, known = load_layout_and_lost(text)
    else:
        from finlab.files.worker import in_worker

        layout, known = in_worker(load_layout_and_lost, text)
    return layout, tuple(dict.fromkeys([*known, *lost]))


def check_positive(**counts: int | None) -> None:
    """Refuse counts, each under the name of its option. Raises CommandError: one is below 1."""
    for name, value in counts.items():
        if value is not None and value < 1:
            raise CommandError(
                f"{name.replace('_', '-')}: expected a number of at least 1, got {value}"
            )


def tell(words: str) -> None:
    """Say what is being done, on a terminal."""
    if sys.stderr.isatty():
        print(f"{words} ...", file=sys.stderr, flush=True)


@contextmanager
def mapping_on(cluster: str | None) -> Iterator[Any]:
    """Yields what computes the parts of a piece of work, as `map` does: this process, or, with the
    address of a scheduler, the workers of its cluster. Raises FinlabError: nobody answers there."""
    if cluster is None:
        yield map
        return
    with resolve_name(EXECUTOR + ":on_cluster")(cluster):
        yield resolve_name(EXECUTOR + ":map_parts")
