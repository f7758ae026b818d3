"""The bundle that a robot runs: the robot, the fins' physics, settings, a README and checksums; its
graph.

`finlab.load_layout` and `finlab.Allocator.from_bundle` read a bundle, so the robot runs the library
itself. The same layout and settings give the same bytes, as a folder and as a zip archive. The
layout graph file is the robot as the complete graph that the networks see, which
`networkx.node_link_graph` opens: features of a fin with a horizontal shaft are the paper's ten (x_i
in R^10: position, mounting angle, limits), those of other actuators have two of their own axes in
place of the angle.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import rmtree

from msgspec import to_builtins

import finlab
from finlab import bundle_files
from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import METHODS_ON_BOARD, method_class
from finlab.assets import NAME
from finlab.axes import AXES
from finlab.bundle_files import named_content
from finlab.deploy.deployed_robot import self_tests
from finlab.errors import AllocationError, DataError, LayoutError
from finlab.files.guarded import packed
from finlab.interaction.learned import MAX_BYTES as LARGEST_NETWORK
from finlab.interaction.learned import NETWORK_SUFFIX, WHAT
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.bundled_robot import Robot
from finlab.layout.graph_file import (
    POSITION_SCALE,
    SCALES,
    Data,
    Edge,
    Graph,
    Normalization,
    edges_of,
)
from finlab.layout.load import FORMAT as LAYOUT_FORMAT
from finlab.layout.save import layout_to_dict, plain
from finlab.physics.objective import yardstick
from finlab.whole_file import PART, write_folder, write_whole


@dataclass(frozen=True)
class Bundle:
    """A bundle in memory."""

    files: Mapping[str, bytes]  # contents by name

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write the files into a folder, which is made; an earlier bundle there is replaced. Raises
        DataError: the folder holds something else, or cannot be written."""
        path = Path(folder)
        made = not path.exists()
        present = [file for file in path.rglob("*") if not file.is_dir()]
        names = {
            file: file.relative_to(path).as_posix()
            for file in present
            if not file.name.endswith(PART)
        }
        try:
            # The checksums come last: what a kill leaves is refused.
            odd = (file for file, name in names.items() if bundle_files.largest(name) < 0)
            write_folder(path, self.files, odd, "a bundle")
            for file in set(present) - {path / name for name in self.files}:
                file.unlink()
        except OSError as error:
            raise DataError(f"{error.filename}: cannot be written: {error.strerror}") from None
        finally:
            if made and not (path / bundle_files.CHECKSUMS).exists():
                rmtree(path, ignore_errors=True)

    def write_zip(self, file: str | os.PathLike[str]) -> None:
        """Write one zip archive, in place of an existing file; a `DataError` where it cannot be
        written."""
        write_whole(file, self.zip_bytes(), DataError)

    def zip_bytes(self) -> bytes:
        """The bundle as one zip archive."""
        return packed(self.files)


def make_bundle(allocator: Allocator, lost: tuple[str, ...] = ()) -> Bundle:
    """Prepare what a robot runs: the robot, method (`dual`, `mdn` or `paper`) and settings of an
    allocator, and the names of fins that do not work; networks that do not come with finlab travel.
    Raises LayoutError: an unknown lost fin, or none left; AllocationError: the method cannot run
    from a bundle; DataError: a force table cannot be read, or something is too large to travel."""
    if allocator.method not in METHODS_ON_BOARD:
        raise AllocationError(
            f"method {allocator.method!r} cannot be exported; a bundle runs "
            f"{' or '.join(METHODS_ON_BOARD)}"
        )
    layout = allocator.layout
    cases = self_tests(allocator, lost)
    inside, tables = with_tables_inside(layout)
    sha256, networks = method_class(allocator.method).networks_for_bundle(allocator.weights)
    files = {
        bundle_files.ROBOT: _robot_bytes(Robot(inside, lost, sha256, cases)),
        bundle_files.ABOUT: _about(allocator),
        **tables,
        **{bundle_files.NETWORKS + name: content for name, content in networks.items()},
        bundle_files.README: _readme(allocator, lost).encode(),
    }
    if sum(map(len, files.values())) > bundle_files.LARGEST_BUNDLE:
        raise DataError(
            f"layout {layout.name!r}: its bundle would be larger than "
            f"{bundle_files.LARGEST_BUNDLE:,} bytes"
        )
    return Bundle({**files, bundle_files.CHECKSUMS: bundle_files.checksums(files)})


def _robot_bytes(robot: Robot) -> bytes:
    """Contents of the file of the robot."""
    values = {**to_builtins(robot, builtin_types=(Layout,)), "layout": layout_to_dict(robot.layout)}
    return (json.dumps(values, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _about(allocator: Allocator) -> bytes:
    document = {
        "format": bundle_files.FORMAT,
        "version": bundle_files.VERSION,
        "finlab": finlab.__version__,
        "method": allocator.method,
        "checkpoint": allocator.checkpoint,
        "settings": vars(allocator.settings),
    }
    return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()


def with_tables_inside(layout: Layout) -> tuple[Layout, dict[str, bytes]]:
    """A layout whose force tables, and the network of whose interaction, have the names that they
    have in a bundle, and their contents by name; `DataError`: one cannot be read, or is too large
    to travel."""
    names = dict[str, str]()
    contents = dict[str, bytes]()
    own = layout.interaction
    table = bundle_files.LARGEST_TABLE, "a table of forces for a bundle"
    for path in layout.files:
        is_network = own is not None and path == own.reads
        content = named_content(path, *((LARGEST_NETWORK, WHAT) if is_network else table))
        names[path] = bundle_files.table_name(content, NETWORK_SUFFIX if is_network else ".csv")
        contents[names[path]] = content
    return renamed(layout, names), contents


def renamed(layout: Layout, names: Mapping[str, str]) -> Layout:
    """A layout whose tables and network have other names, or paths, by those that they have."""
    parts = tuple(
        part.reading(names[part.reads]) if part.reads else part for part in layout.actuators
    )
    own = layout.interaction
    if own is not None and own.reads is not None:
        own = own.reading(names[own.reads])
    return replace(layout, actuators=parts, interaction=own)


def _readme(allocator: Allocator, lost: tuple[str, ...]) -> str:
    template = Path(__file__).with_name("bundle_readme.md").read_text("utf-8")
    return template.format(
        name=allocator.layout.name,
        version=finlab.__version__,
        wheel=NAME.replace("-", "_"),
        method=allocator.method,
        networks=""
        if allocator.checkpoint is None
        else f" with checkpoint `{allocator.checkpoint}`",
        actuators=", ".join(allocator.layout.names),
        lost=list(lost),
    )


def features_of(part: Actuator) -> dict[str, float]:
    """Returns the features of an actuator by name and unit."""
    found = dict(zip(("x [m]", "y [m]", "z [m]"), part.position, strict=True))
    if (angle := part.value("mounting_angle")) is not None:
        found["alpha [rad]"] = angle
    else:
        for name, axis in zip(("first axis", "second axis"), part.frame, strict=False):
            found |= {f"{name} {one}": float(value) for one, value in zip("xyz", axis, strict=True)}
    for number, low, high in zip(part.KIND.numbers, part.lower, part.upper, strict=False):
        found[f"{number.name}_min [{number.unit}]"] = float(low)
        found[f"{number.name}_max [{number.unit}]"] = float(high)
    return found


def graph_of(layout: Layout) -> Graph:
    """Returns a robot as a graph; tables of fins' forces that it names are kept by their paths."""
    about = {
        key: value
        for key, value in layout_to_dict(layout).items()
        if key not in ("fins", "actuators")
    }
    parts = plain(layout.actuators)
    nodes = [
        {"id": part.pop("name"), **part, "features": features_of(own)}
        for part, own in zip(parts, layout.actuators, strict=True)
    ]
    scales = [POSITION_SCALE] * 3 + [SCALES[2]] + [scale for scale in SCALES for _ in range(2)]
    names = features_of(Fin("fin", (0.0, 0.0, 0.0), 0.0))
    wrench = dict(zip(AXES, yardstick(layout).tolist(), strict=True))
    return Graph(
        directed=False,
        multigraph=False,
        graph=Data(
            layout={**about, "format": LAYOUT_FORMAT, "version": 2},
            normalization=Normalization(dict(zip(names, scales, strict=True)), wrench),
        ),
        nodes=nodes,
        edges=[Edge(*pair) for pair in edges_of(list(layout.names))],
    )


def graph_text(layout: Layout) -> str:
    """Returns the text of a robot's graph file; the same robot gives the same text."""
    return (
        json.dumps(to_builtins(graph_of(layout)), indent=1, allow_nan=False, ensure_ascii=False)
        + "\n"
    )


def write_graph(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Writes a graph file; an existing file is replaced whole. Raises LayoutError: the name does
    not end in `.json`, or the file cannot be written."""
    if Path(path).suffix.lower() != ".json":
        raise LayoutError("expected the name of a file that ends in .json", source=str(path))
    write_whole(path, graph_text(layout))
