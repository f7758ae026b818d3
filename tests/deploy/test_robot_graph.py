"""The layout graph file: the same robot comes back, networkx opens it, the schema holds."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import networkx
import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.methods import choose_method
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.deploy.robot_graph import features_of, graph_text, write_graph
from finlab.errors import LayoutError
from finlab.layout import load_layout
from finlab.research.paper.network import raw_features
from finlab.research.paper.pipeline import Paper
from tests.terminal import refused

SCHEMA = Path(__file__).parents[2] / "finlab" / "layout" / "graph.schema.json"
"""The published schema of the format."""


@pytest.mark.parametrize("name", sorted(shipped_layouts()))
def test_the_same_robot_comes_back(name: str, tmp_path: Path) -> None:
    layout = load_layout(name)
    file = tmp_path / "robot.json"
    write_graph(layout, file)
    assert load_layout(file) == layout
    data = json.loads(file.read_text())
    jsonschema.validate(data, json.loads(SCHEMA.read_text()))
    graph = networkx.node_link_graph(data, edges="edges")
    assert tuple(graph.nodes) == layout.names
    assert graph.number_of_edges() == layout.n * (layout.n + 1) // 2
    np.testing.assert_allclose(
        list(data["graph"]["normalization"]["wrench"].values()), Allocator(layout).scale
    )


def test_features_over_their_scales_are_what_the_papers_network_sees() -> None:
    layout = load_layout("A")
    data = json.loads(graph_text(layout))
    scales = data["graph"]["normalization"]["features"]
    seen = raw_features(layout.position, layout.mounting_angle, layout.lower, layout.upper)
    for node, row in zip(data["nodes"], seen, strict=True):
        assert list(node["features"]) == list(scales) and len(scales) == 10
        np.testing.assert_allclose([node["features"][key] / scales[key] for key in scales], row)
    part = load_layout("turtle_hybrid").actuators[-1]
    assert {"x [m]", "force_min [N]", "force_max [N]"} <= set(features_of(part))


def test_what_the_paper_divides_by_is_in_the_file() -> None:
    layout = load_layout("A")
    data = json.loads(graph_text(layout))
    paper = data["graph"]["normalization"]["paper"]
    choice = choose_method("paper")
    method = choice.kind(layout, choice.settings, Allocator(layout).scale, choice.networks)
    assert isinstance(method, Paper)
    np.testing.assert_array_equal(list(paper["mean"].values()), method.normalization.mean)
    np.testing.assert_array_equal(list(paper["std"].values()), method.normalization.std)
    assert list(paper["std"]) == list(data["graph"]["normalization"]["wrench"])


def test_a_file_of_the_version_before_is_read(tmp_path: Path) -> None:
    layout = load_layout("A")
    data = json.loads(graph_text(layout))
    data["graph"]["version"] = 4
    del data["graph"]["normalization"]["paper"]
    file = tmp_path / "old.json"
    file.write_text(json.dumps(data))
    assert load_layout(file) == layout


def test_a_graph_that_was_changed_says_where(tmp_path: Path) -> None:
    data = json.loads(graph_text(load_layout("A")))
    file = tmp_path / "a.json"
    for change, words in (
        (lambda d: d["edges"].pop(), "edges"),
        (lambda d: d["nodes"][1].update(colour=3), "actuators.1..colour"),
        (lambda d: d["graph"].update(version=9), "graph.version"),
        (lambda d: d["nodes"].clear(), "nodes"),
    ):
        broken = json.loads(json.dumps(data))
        change(broken)
        file.write_text(json.dumps(broken))
        with pytest.raises(LayoutError, match=words):
            load_layout(file)


def test_the_command_writes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "b.graph.json"
    assert main(["export", "bluerov2", "--graph", str(file)]) == 0
    assert "6 thrusters, 6 nodes" in capsys.readouterr().out
    assert load_layout(file) == replace(load_layout("bluerov2"))
    assert "nothing to write" in refused(["export", "bluerov2"])
