"""Graphs made by an allocator, written, read back, and used in place of a layout."""

import json
from pathlib import Path

import jsonschema
import pytest

import finlab
from finlab.allocation import Allocator
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.deploy.graph import N_SELF_TEST, build_graph
from finlab.deploy.graph_file import graph_bytes, read_graph, write_graph
from finlab.inference.checkpoint import read_checkpoint
from finlab.layout import Layout, save_layout
from finlab.layout.load import checksum_of

SCHEMA = json.loads((Path(__file__).parents[2] / "finlab/deploy/graph.schema.json").read_text())
WRENCH = ["--wrench", "0.5", "0", "0.5", "0", "0", "0"]


@pytest.fixture(scope="module", params=["search", "mdn"])
def allocator(request: pytest.FixtureRequest, untrained_mdn: Path) -> Allocator:
    return finlab.load_allocator(request.param, checkpoint=untrained_mdn)


@pytest.mark.parametrize("failed", [(), ("front_left",)], ids=["whole", "one lost"])
def test_graph_of_an_allocator(failed: tuple[str, ...], allocator: Allocator, untrained_mdn: Path) -> None:
    layout = finlab.load_layout(shipped_layouts()["A"])
    graph = build_graph(layout, allocator, failed)
    jsonschema.validate(json.loads(graph_bytes(graph)), SCHEMA)
    assert graph.layout == layout and graph.failed == failed and graph.healthy.n_fins == 4 - len(failed)
    weights = read_checkpoint(untrained_mdn)
    networks = (weights.name, weights.sha256) if allocator.name == "mdn" else (None, None)
    assert (graph.checkpoint, graph.checkpoint_sha256) == networks
    assert graph.method == allocator.name and len(graph.self_test) == N_SELF_TEST


def test_same_input_same_bytes(allocator: Allocator, untrained_mdn: Path) -> None:
    layout = finlab.load_layout(shipped_layouts()["ucat"])
    again = finlab.load_allocator(allocator.name, checkpoint=untrained_mdn)
    assert graph_bytes(build_graph(layout, allocator)) == graph_bytes(build_graph(layout, again))


def test_force_tables_are_found_beside_the_graph_file(
    measured: Layout, allocator: Allocator, tmp_path: Path
) -> None:
    """A graph file alone names its tables by their places; one written relatively starts at the file."""
    path = tmp_path / "x.graph.json"
    write_graph(build_graph(measured, allocator), path)
    assert read_graph(path).layout == finlab.load_layout(path) == measured
    document = json.loads(path.read_text())
    document["graph"]["nodes"][2]["model"]["path"] = "tank/soft.csv"
    document["checksum"] = checksum_of(document)
    path.write_text(json.dumps(document))
    for layout in (finlab.load_layout(path), read_graph(path).layout):
        assert layout.fins[2].model.values() == {"path": str(tmp_path / "tank" / "soft.csv")}


def test_an_exported_graph_file_takes_its_tables_along(
    measured: Layout, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_layout(measured, tmp_path / "robot.yaml")
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    assert main(["export", str(tmp_path / "robot.yaml"), "-o", str(here / "x.graph.json")]) == 0
    here.rename(there)
    moved = finlab.load_layout(there / "x.graph.json")
    paths = [str(fin.model.values()["path"]) for fin in moved.fins if fin.model.type == "table"]
    assert paths and all(path.startswith(str(there / "tables")) for path in paths)
    assert finlab.load_allocator().allocate(moved, [0.2, 0, 0.2, 0, 0, 0]).err_norm < 1e-6
    capsys.readouterr()
    assert main(["export", str(there / "x.graph.json"), "-o", str(tmp_path / "no" / "x.graph.json")]) == 2
    assert "cannot be written: No such file or directory" in capsys.readouterr().err


def test_export_refuses_another_file_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "A", "-o", "A.json"]) == 2
    assert capsys.readouterr().err.startswith("finlab: error: A.json: expected a file name that ends in")
