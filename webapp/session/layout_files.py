"""Layouts, candidates and graphs as files that a browser sends and takes."""

import csv
import io
import re
import tempfile
from pathlib import Path

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.errors import FinlabError, LayoutError
from finlab.layout import Layout, parse_layout, save_layout
from finlab.layout.load import SUFFIX, parse_graph_layout
from finlab.layout.reading import MAX_BYTES, parse_json
from finlab.layout.yaml_file import parse_yaml


def file_stem(name: str) -> str:
    """A layout's name as the name of a file, without surprises."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "layout"


def read_layout(name: str, content: bytes) -> Layout:
    """The layout in an uploaded layout file or layout graph file.

    Raises:
        LayoutError: the file is too large, no text or no layout; the message names file and key.
    """
    source = Path(str(name)).name[:80] or "upload"
    if len(content) > MAX_BYTES:
        raise LayoutError(f"is larger than {MAX_BYTES:,} bytes, a layout has a few thousand", source=source)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise LayoutError("is not UTF-8 text, expected a YAML or JSON layout file", source=source) from None
    if "\0" in text:
        raise LayoutError("is a binary file, expected a YAML or JSON layout file", source=source)
    if source.lower().endswith(SUFFIX):
        return parse_graph_layout(text, source)
    parse = parse_json if source.lower().endswith(".json") else parse_yaml
    return parse_layout(parse(text, source), source=source)


def layout_bytes(layout: Layout) -> bytes:
    """The layout as a YAML file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "layout.yaml"
        save_layout(layout, path)
        return path.read_bytes()


def graph_bytes(layout: Layout, failed: tuple[str, ...], allocator: Allocator) -> bytes:
    """The layout graph file for deployment with the allocator's checkpoint."""
    from finlab.deploy.graph import build_graph
    from finlab.deploy.graph_file import write_graph

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "layout.graph.json"
        write_graph(build_graph(layout, allocator, failed), path)
        return path.read_bytes()


def bundle_bytes(layout: Layout, failed: tuple[str, ...], allocator: Allocator) -> bytes:
    """The bundle for the robot as a zip file: graph, networks, README and checksums.

    Raises:
        FinlabError: the allocator has no trained network.
    """
    from finlab.deploy.bundle import make_bundle

    return make_bundle(layout, allocator, failed).zip_bytes()


def candidates_csv(allocation: Allocation | None) -> bytes:
    """The refined candidates of an answer, one line each, SI units and radians."""
    if allocation is None or allocation.candidates is None:
        raise FinlabError("there are no candidates to save; choose the method learned")
    candidates = allocation.candidates
    text = io.StringIO()
    writer = csv.writer(text)
    columns = [
        f"{name}.{quantity}"
        for name in allocation.layout.names
        for quantity in ("amplitude_rad", "frequency_hz", "zero_direction_rad")
    ]
    writer.writerow(["err_norm", "energy", "source", *columns])
    for k, command in enumerate(candidates.command):
        values = [f"{v:.6g}" for v in command.ravel()]
        writer.writerow(
            [f"{candidates.err_norm[k]:.6g}", f"{candidates.energy[k]:.6g}", candidates.source[k], *values]
        )
    return text.getvalue().encode()
