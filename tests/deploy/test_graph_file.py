"""Layout graph files: lossless, deterministic, readable by others, and refused once they are changed."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import networkx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import finlab
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.deploy.graph import N_SELF_TEST, LayoutGraph, build_graph
from finlab.deploy.graph_file import graph_bytes, parse_graph, read_graph, write_graph
from finlab.errors import FinlabError, LayoutError
from finlab.layout import Fin, Layout, load_layout, save_layout
from finlab.layout.azimuth import Azimuth, Tilt
from finlab.layout.graph_form import Case
from finlab.layout.load import GraphText, checksum_of
from finlab.layout.rudder import Rudder
from finlab.layout.thrust_model import PowerLaw, PowerTable
from finlab.layout.thruster import Thruster
from finlab.networks.checkpoint import read_checkpoint
from finlab.networks.normalization import Normalization
from tests.any_robot import AnyRobot
from tests.exhaustive import sampled

SCHEMA = json.loads((Path(__file__).parents[2] / "finlab/deploy/graph.schema.json").read_text())


def make_graph(layout: Layout, failed: tuple[str, ...] = ()) -> LayoutGraph:
    """A graph with made-up numbers; only its shape matters here."""

    def rows(*values: float) -> tuple[tuple[float, ...] | None, ...]:
        return tuple(None if name in failed else values for name in layout.names)

    case = Case((1.0, 0.0, 0.5, 0.0, 0.0, 0.1), rows(0.3, 1.0, -0.5), (0.9,) * 6)
    normalization = Normalization(np.zeros(6), np.array([1.0, 1.0, 1.0, 0.2, 0.2, 0.3]))
    checkpoint = ("default", "0" * 64) if failed else (None, None)
    return LayoutGraph(layout, failed, normalization, *checkpoint, "mdn" if failed else "dual", (case, case))


def same(a: LayoutGraph, b: LayoutGraph) -> bool:
    """Equality of two graphs; numpy arrays have none of their own."""
    plain = Normalization(np.zeros(6), np.ones(6))
    arrays = all(map(np.array_equal, a.normalization, b.normalization))
    return arrays and replace(a, normalization=plain) == replace(b, normalization=plain)


def edited(change: Callable[[dict[str, Any]], None], fix_checksum: bool = True) -> str:
    """The text of a graph file after a change, with a checksum that fits it (a careful forger's) or not."""
    document = json.loads(graph_bytes(make_graph(load_layout(shipped_layouts()["A"]))))
    change(document)
    if fix_checksum:
        document["checksum"] = checksum_of(document)
    return json.dumps(document)


@pytest.mark.parametrize("name", sampled(sorted(shipped_layouts()), every=5))
def test_shipped_layouts_come_back_as_they_were(name: str, tmp_path: Path) -> None:
    layout = load_layout(shipped_layouts()[name])
    graph = make_graph(layout, failed=layout.names[:1])
    path = tmp_path / f"{name}.graph.json"
    write_graph(graph, path)
    back = read_graph(path)
    jsonschema.validate(json.loads(path.read_text()), SCHEMA)
    assert same(back, graph)
    assert back.layout == layout, "not even the last bit of an angle may differ"
    assert list(tmp_path.iterdir()) == [path], "no temporary file is left"


@given(angle=st.floats(-math.pi, math.pi), x=st.floats(-10, 10), name=st.text(min_size=1, max_size=20))
def test_any_fin_comes_back_or_is_refused(angle: float, x: float, name: str) -> None:
    try:
        layout = Layout("any", (Fin(name, (x, 0.0, 0.0), angle),))
    except FinlabError:
        return
    assert parse_graph(GraphText(graph_bytes(make_graph(layout)).decode())).layout == layout


def test_every_type_of_actuator_comes_back() -> None:
    ahead, up, law = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), PowerLaw(2.0, 3.0)
    table = PowerTable(((-1.0, -9.0, 4.0), (0.0, 0.0, 0.0), (1.0, 10.0, 5.0)), "us")
    parts = (
        Fin("any shaft", (0.1, 0.2, 0.3), shaft=up, zero=ahead),
        Thruster("thruster", (0.0, 0.1, 0.0), (0.6, 0.8, 0.0), (-9.0, 10.0), table, 0.3, 0.01, rate=50.0),
        Azimuth("azimuth", (0.0, 0.0, 0.2), up, ahead, (0.0, 20.0), law, turn_rate=1.0 / 3.0),
        Tilt("tilt", (0.0, 0.0, 0.2), up, ahead, (0.0, 20.0), law, arc=(-math.pi / 7.0, 0.1)),
        Rudder("rudder", (-1.0, 0.0, 0.0), up, ahead, 0.03, (-0.7, 0.7), 3.0, stall=1.0 / 3.0),
    )
    graph = make_graph(Layout("all", parts), failed=("tilt",))
    jsonschema.validate(json.loads(graph_bytes(graph)), SCHEMA)
    back = parse_graph(GraphText(graph_bytes(graph).decode()))
    assert same(back, graph) and back.layout == graph.layout


def test_networkx_reads_nodes_and_edges() -> None:
    layout = load_layout(shipped_layouts()["A"])
    document = json.loads(graph_bytes(make_graph(layout, failed=("back_left",))))
    graph = networkx.node_link_graph(document["graph"], edges="edges")
    assert tuple(graph.nodes) == layout.names
    assert graph.nodes["front_left"]["position_m"] == [0.25753, 0.1502, 0.0]
    assert not graph.nodes["back_left"]["healthy"]
    assert graph.degree("back_left") == 0
    healthy = graph.subgraph(n for n in graph if n != "back_left")
    assert healthy.number_of_edges() == 3 + 3, "every pair and every fin with itself"


def test_white_space_and_order_of_keys_do_not_matter() -> None:
    text = edited(lambda document: None)
    document = json.loads(text)
    turned = json.dumps(dict(reversed(document.items())), indent=7)
    assert same(parse_graph(GraphText(text)), parse_graph(GraphText(turned)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(version=1), "version: this finlab reads version 3, got 1"),
        (lambda d: d.update(version=2.0), "version: this finlab reads version 3, got 2.0"),
        (lambda d: d.update(format="finlab-layout"), "format: expected finlab-graph, got 'finlab-layout'"),
        (lambda d: d.update(surprise=1), "surprise: unknown key"),
        (lambda d: d.pop("normalization"), "normalization: required key is missing"),
        (lambda d: d["graph"].update(nodes=[]), "expected a list of 1 to 64 values, got 0"),
        (lambda d: d["graph"]["nodes"][1].pop("limits"), r"graph.nodes\[1\].limits: required key is missing"),
        (lambda d: d["graph"]["nodes"][1].update(healthy=1), r"nodes\[1\].healthy: expected true or false"),
        (lambda d: d["graph"]["edges"].pop(), "graph.edges: expected every pair of healthy actuators"),
        (lambda d: d["self_test"]["cases"][0]["command"].pop(), r"\[0\].command: expected a list of 4 rows"),
        (lambda d: d["frame"].update(convention="NED"), "frame.convention: expected FLU"),
    ],
)
def test_refusals_name_the_key(change: Callable[[dict[str, Any]], None], message: str) -> None:
    with pytest.raises(LayoutError, match=message):
        parse_graph(GraphText(edited(change), "x.graph.json"))


@given(position=st.integers(0, 10_000), replacement=st.characters(max_codepoint=0x2FF))
def test_one_changed_character_never_passes_as_another_robot(position: int, replacement: str) -> None:
    graph = make_graph(load_layout(shipped_layouts()["D"]))
    text = graph_bytes(graph).decode()
    position %= len(text)
    try:
        back = parse_graph(GraphText(text[:position] + replacement + text[position + 1 :]))
    except FinlabError:
        return
    assert same(back, graph)


def test_wrong_name_and_missing_folder_are_refused(tmp_path: Path) -> None:
    graph = make_graph(load_layout(shipped_layouts()["A"]))
    with pytest.raises(LayoutError, match=r"expected a file name that ends in .graph.json"):
        write_graph(graph, tmp_path / "A.json")
    with pytest.raises(LayoutError, match="cannot be written: No such file or directory"):
        write_graph(graph, tmp_path / "nowhere" / "A.graph.json")


def test_stands_in_for_a_layout_file_everywhere(tmp_path: Path) -> None:
    layout = load_layout("ucat")
    write_graph(make_graph(layout, failed=layout.names[:1]), tmp_path / "x.graph.json")
    assert load_layout(tmp_path / "x.graph.json") == load_layout(str(tmp_path / "x.graph.json")) == layout
    text = (tmp_path / "x.graph.json").read_text()
    (tmp_path / "x.graph.json").write_text(text.replace("0.", "1.", 1))
    with pytest.raises(LayoutError, match="checksum: does not fit the contents"):
        load_layout(tmp_path / "x.graph.json")


@pytest.fixture(scope="module", params=["dual", "mdn"])
def allocator(request: pytest.FixtureRequest, untrained_mdn: Path) -> AnyRobot:
    return method(request.param, untrained_mdn)


def method(name: str, checkpoint: Path) -> AnyRobot:
    return AnyRobot(name, checkpoint=checkpoint if name == "mdn" else None)


@pytest.mark.parametrize("failed", [(), ("front_left",)], ids=["whole", "one lost"])
def test_graph_of_an_allocator(failed: tuple[str, ...], allocator: AnyRobot, untrained_mdn: Path) -> None:
    layout = finlab.load_layout(shipped_layouts()["A"])
    graph = build_graph(allocator.on(layout), failed)
    jsonschema.validate(json.loads(graph_bytes(graph)), SCHEMA)
    assert graph.layout == layout and graph.failed == failed and graph.healthy.n_fins == 4 - len(failed)
    weights = read_checkpoint(untrained_mdn)
    networks = (weights.name, weights.sha256) if allocator.name == "mdn" else (None, None)
    assert (graph.checkpoint, graph.checkpoint_sha256) == networks
    assert graph.method == allocator.name and len(graph.self_test) == N_SELF_TEST


def test_same_input_same_bytes(allocator: AnyRobot, untrained_mdn: Path) -> None:
    layout = finlab.load_layout(shipped_layouts()["ucat"])
    again = method(allocator.name, untrained_mdn)
    assert graph_bytes(build_graph(allocator.on(layout))) == graph_bytes(build_graph(again.on(layout)))


def test_force_tables_are_found_beside_the_graph_file(
    measured: Layout, allocator: AnyRobot, tmp_path: Path
) -> None:
    """A graph file alone names its tables by their places; one written relatively starts at the file."""
    path = tmp_path / "x.graph.json"
    write_graph(build_graph(allocator.on(measured)), path)
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
    assert finlab.Allocator(moved).allocate([0.2, 0, 0.2, 0, 0, 0]).err_norm < 1e-6
    capsys.readouterr()
    assert main(["export", str(there / "x.graph.json"), "-o", str(tmp_path / "no" / "x.graph.json")]) == 2
    assert "cannot be written: No such file or directory" in capsys.readouterr().err


def test_export_refuses_another_file_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "A", "-o", "A.json"]) == 2
    assert capsys.readouterr().err.startswith("finlab: error: A.json: expected a file name that ends in")
