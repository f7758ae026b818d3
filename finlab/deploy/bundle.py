"""The bundle that a robot takes home: layout graph, networks in ONNX, a README and checksums.

The same layout, checkpoint and settings give the same bytes, as a folder and as a zip archive.
"""

from __future__ import annotations

import hashlib
import io
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from finlab.deploy.graph import build_graph
from finlab.deploy.graph_file import graph_bytes
from finlab.deploy.metadata import fast_metadata, network_metadata, surrogate_metadata
from finlab.deploy.onnx.fast import fast_model
from finlab.deploy.onnx.model import model_bytes
from finlab.deploy.onnx.network import network_model
from finlab.deploy.onnx.surrogate import surrogate_model
from finlab.deploy.readme import readme_text
from finlab.errors import AllocationError, DataError
from finlab.inference.learned_fin import FORCE_UNIT, REFERENCE
from finlab.layout import Layout

if TYPE_CHECKING:
    from finlab.allocation import Allocator

GRAPH, NETWORK, SURROGATE = "layout.graph.json", "network.onnx", "surrogate.onnx"
FAST = "fast.onnx"
README, CHECKSUMS = "README.md", "SHA256SUMS"
FILES = (GRAPH, NETWORK, SURROGATE, FAST, README, CHECKSUMS)
"""What a bundle may hold; `fast.onnx` only where the checkpoint has a distilled network."""


@dataclass(frozen=True)
class Bundle:
    """A bundle in memory."""

    files: Mapping[str, bytes]
    """Contents by name."""

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write the files into a folder, which is made; an earlier bundle there is replaced.

        Raises:
            DataError: the folder holds something else, or cannot be written.
        """
        path = Path(folder)
        try:
            path.mkdir(parents=True, exist_ok=True)
            strangers = sorted({file.name for file in path.iterdir()} - set(FILES))
            if strangers:
                raise DataError(
                    f"{path}: holds {strangers[0]!r:.60}, which is no part of a bundle; name an empty folder"
                )
            # The checksums come last: until they are there, a half-written bundle is refused.
            (path / CHECKSUMS).unlink(missing_ok=True)
            for name, content in self.files.items():
                (path / name).write_bytes(content)
        except OSError as error:
            raise DataError(f"{error.filename or path}: cannot be written: {error.strerror}") from None

    def write_zip(self, file: str | os.PathLike[str]) -> None:
        """Write one zip archive; an existing file is replaced whole.

        Raises:
            DataError: the file cannot be written.
        """
        path = Path(file)
        part = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            part.write_bytes(self.zip_bytes())
            os.replace(part, path)
        except OSError as error:
            raise DataError(f"{path}: cannot be written: {error.strerror}") from None

    def zip_bytes(self) -> bytes:
        """The bundle as one zip archive."""
        buffer = io.BytesIO()
        # Weights hardly shrink, and a compressor's bytes would differ from version to version.
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
            for name, content in self.files.items():
                entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
                entry.create_system, entry.external_attr = 3, 0o100644 << 16
                archive.writestr(entry, content)
        return buffer.getvalue()


def make_bundle(layout: Layout, allocator: Allocator, failed: tuple[str, ...] = ()) -> Bundle:
    """Prepare a layout for a robot with the trained networks of an allocator of method `learned`.

    Args:
        layout: the robot, failed fins included.
        allocator: with the checkpoint and the settings that the robot shall use.
        failed: names of fins that do not work.

    Raises:
        LayoutError: an unknown failed fin, or none left.
        AllocationError: the allocator's method cannot run on a robot.
    """
    from finlab.allocation.learned.learned_allocator import LearnedAllocator

    if not isinstance(allocator, LearnedAllocator):
        raise AllocationError(
            f"method {allocator.name!r} cannot be exported; a bundle runs method 'learned', choose that"
        )
    graph = build_graph(layout, allocator, failed)
    weights = allocator.weights
    about = network_metadata(graph, weights, allocator.settings, allocator.energy_weights)
    sizes = weights.check_network()
    network = network_model(weights.network, sizes.heads, sizes.n_components, about)
    surrogate = surrogate_model(weights.surrogate, REFERENCE, FORCE_UNIT, surrogate_metadata(graph, weights))
    files = {
        GRAPH: graph_bytes(graph),
        NETWORK: model_bytes(network),
        SURROGATE: model_bytes(surrogate),
    }
    if weights.fast is not None:
        files[FAST] = model_bytes(fast_model(weights.fast, fast_metadata(graph, weights)))
    files[README] = readme_text(graph, with_fast=FAST in files).encode()
    return Bundle({**files, CHECKSUMS: checksums(files)})


def checksums(files: Mapping[str, bytes]) -> bytes:
    """The lines of `SHA256SUMS`, which `sha256sum -c` reads as well."""
    lines = (f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files))
    return "".join(lines).encode()
