"""Makes the bundle that a robot runs: its layout, force tables, settings, a README and checksums.

`finlab.load_layout` and `finlab.Allocator.from_bundle` read a bundle, so the robot runs the library
itself. The same layout and settings give the same bytes, as a folder and as a zip archive.
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
from finlab.assets import DISTRIBUTION
from finlab.bundle_files import read_named_file
from finlab.deploy.deployed_robot import self_tests
from finlab.errors import AllocationError, DataError
from finlab.files.guarded import packed
from finlab.interaction.learned import EXPECTED_NETWORK_FILE, MAX_NETWORK_BYTES, NETWORK_SUFFIX
from finlab.layout import Layout
from finlab.layout.bundled_robot import BundledRobot
from finlab.layout.save import layout_to_dict
from finlab.whole_file import TEMPORARY_SUFFIX, write_folder, write_whole


@dataclass(frozen=True)
class Bundle:
    """A bundle in memory."""

    files: Mapping[str, bytes]
    """Contents by name."""

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Writes the files into a folder, which is made; an earlier bundle there is replaced.

        Raises:
            DataError: the folder holds something else, or cannot be written.
        """
        path = Path(folder)
        is_new = not path.exists()
        present = [file for file in path.rglob("*") if not file.is_dir()]
        names = {
            file: file.relative_to(path).as_posix()
            for file in present
            if not file.name.endswith(TEMPORARY_SUFFIX)
        }
        try:
            # The checksums come last: what a kill leaves is refused.
            foreign = []
            for file, name in names.items():
                if bundle_files.max_file_bytes(name) < 0:
                    foreign.append(file)
            write_folder(path, self.files, foreign, "a bundle")
            for file in set(present) - {path / name for name in self.files}:
                file.unlink()
        except OSError as error:
            raise DataError(f"{error.filename}: cannot be written: {error.strerror}") from None
        finally:
            if is_new and not (path / bundle_files.CHECKSUM_FILE).exists():
                rmtree(path, ignore_errors=True)

    def write_zip(self, file: str | os.PathLike[str]) -> None:
        """Writes one zip archive, in place of an existing file.

        Raises:
            DataError: the file cannot be written.
        """
        write_whole(file, self.zip_bytes(), DataError)

    def zip_bytes(self) -> bytes:
        """The bundle as one zip archive."""
        return packed(self.files)


def make_bundle(allocator: Allocator, lost: tuple[str, ...] = ()) -> Bundle:
    """Returns the bundle of an allocator: its robot, method and settings.

    Networks that do not come with finlab are part of it.

    Args:
        allocator: the allocator; of method `dual`, `mdn` or `paper`.
        lost: names of actuators that do not work on this robot.

    Raises:
        LayoutError: an unknown lost actuator, or none left.
        AllocationError: the method cannot run from a bundle.
        DataError: a force table cannot be read, or a file is too large for a bundle.
    """
    if allocator.method not in METHODS_ON_BOARD:
        raise AllocationError(
            f"method {allocator.method!r} cannot be exported; a bundle runs "
            f"{' or '.join(METHODS_ON_BOARD)}"
        )
    layout = allocator.layout
    cases = self_tests(allocator, lost)
    embedded, tables = with_tables_inside(layout)
    sha256, networks = method_class(allocator.method).networks_for_bundle(allocator.networks)
    files = {
        bundle_files.ROBOT_FILE: _robot_bytes(BundledRobot(embedded, lost, sha256, cases)),
        bundle_files.MANIFEST_FILE: _settings_bytes(allocator),
        **tables,
        **{bundle_files.CHECKPOINT_FOLDER + name: content for name, content in networks.items()},
        bundle_files.README_FILE: _readme(allocator, lost).encode(),
    }
    if sum(map(len, files.values())) > bundle_files.MAX_BUNDLE_BYTES:
        raise DataError(
            f"layout {layout.name!r}: its bundle would be larger than "
            f"{bundle_files.MAX_BUNDLE_BYTES:,} bytes"
        )
    return Bundle({**files, bundle_files.CHECKSUM_FILE: bundle_files.checksums(files)})


def _robot_bytes(robot: BundledRobot) -> bytes:
    """The content of the file of the robot."""
    values = {**to_builtins(robot, builtin_types=(Layout,)), "layout": layout_to_dict(robot.layout)}
    return (json.dumps(values, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _settings_bytes(allocator: Allocator) -> bytes:
    """The content of the file of the method and its settings."""
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
    """Puts the files that a layout names into a bundle.

    Args:
        layout: the layout, with paths of force tables, and of the network of its interaction.

    Returns:
        The layout with the names of these files in a bundle, and their contents by name.

    Raises:
        DataError: a file cannot be read, or is too large for a bundle.
    """
    names: dict[str, str] = {}
    contents: dict[str, bytes] = {}
    interaction = layout.interaction
    for path in layout.files:
        if interaction is not None and path == interaction.reads:
            content = read_named_file(path, MAX_NETWORK_BYTES, EXPECTED_NETWORK_FILE)
            suffix = NETWORK_SUFFIX
        else:
            table = "a table of forces for a bundle"
            content = read_named_file(path, bundle_files.MAX_TABLE_BYTES, table)
            suffix = ".csv"
        names[path] = bundle_files.table_name(content, suffix)
        contents[names[path]] = content
    return renamed(layout, names), contents


def renamed(layout: Layout, names: Mapping[str, str]) -> Layout:
    """Returns a layout whose tables and network have other names.

    Args:
        layout: the layout.
        names: the new name, or path, of each file by the one that the layout has.
    """
    actuators = tuple(
        actuator.reading(names[actuator.reads]) if actuator.reads else actuator
        for actuator in layout.actuators
    )
    interaction = layout.interaction
    if interaction is not None and interaction.reads is not None:
        interaction = interaction.reading(names[interaction.reads])
    return replace(layout, actuators=actuators, interaction=interaction)


def _readme(allocator: Allocator, lost: tuple[str, ...]) -> str:
    """The text of the README, from its template."""
    template = Path(__file__).with_name("bundle_readme.md").read_text("utf-8")
    return template.format(
        name=allocator.layout.name,
        version=finlab.__version__,
        wheel=DISTRIBUTION.replace("-", "_"),
        method=allocator.method,
        networks=""
        if allocator.checkpoint is None
        else f" with checkpoint `{allocator.checkpoint}`",
        actuators=", ".join(allocator.layout.names),
        lost=list(lost),
    )
