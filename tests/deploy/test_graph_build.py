"""Graphs made by an allocator, written, read back, and used in place of a layout."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import torch

import finlab
from finlab.allocation import Allocator
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.deploy.graph import build_graph
from finlab.deploy.graph_file import graph_bytes
from finlab.errors import FinlabError
from finlab.inference.checkpoint import read_checkpoint
from finlab.inference.features import fin_frame_features, geometry
from finlab.layout import stack_layouts
from finlab.training.saving import surrogate_of

SCHEMA = json.loads((Path(__file__).parents[2] / "finlab/deploy/graph.schema.json").read_text())
WRENCH = ["--wrench", "0.5", "0", "0.5", "0", "0", "0"]


@pytest.fixture(scope="module")
def allocator(untrained_checkpoint: Path) -> Allocator:
    return finlab.load_allocator(checkpoint=untrained_checkpoint)


@pytest.mark.parametrize("failed", [(), ("front_left",)], ids=["whole", "one lost"])
def test_graph_of_an_allocator(
    failed: tuple[str, ...], allocator: Allocator, untrained_checkpoint: Path
) -> None:
    layout = finlab.load_layout(shipped_layouts()["A"])
    graph = build_graph(layout, allocator, failed)
    jsonschema.validate(json.loads(graph_bytes(graph)), SCHEMA)
    assert graph.layout == layout and graph.failed == failed
    assert graph.checkpoint_sha256 == read_checkpoint(untrained_checkpoint).sha256
    assert [row is None for row in graph.features] == [name in failed for name in layout.names]


def test_self_test_holds_on_the_surrogate(allocator: Allocator, untrained_checkpoint: Path) -> None:
    layout = finlab.load_layout(shipped_layouts()["penta"])
    graph = build_graph(layout, allocator)
    surrogate = surrogate_of(read_checkpoint(untrained_checkpoint))
    arrays = [torch.tensor(a, dtype=torch.float32) for a in stack_layouts([layout])[:4]]
    for case in graph.self_test:
        command = torch.tensor([case.command])
        with torch.inference_mode():
            wrench = surrogate(command, *arrays)[0].numpy()
        assert graph.normalization.error(wrench, np.array(case.predicted_wrench)) < 1e-3


def test_features_are_those_of_training(allocator: Allocator) -> None:
    layout = finlab.load_layout(shipped_layouts()["penta"])
    graph = build_graph(layout, allocator)
    position, angle, lower, upper, _ = stack_layouts([layout])
    case = graph.self_test[0]
    scaled = (np.array(case.wrench) - graph.normalization.mean) / graph.normalization.std
    seen = geometry(position, angle, lower, upper, graph.normalization.std)
    np.testing.assert_allclose(case.features, fin_frame_features(seen, scaled[None])[0], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(graph.features, seen.static[0], rtol=1e-7, atol=1e-9)


def test_same_input_same_bytes(allocator: Allocator, untrained_checkpoint: Path) -> None:
    layout = finlab.load_layout(shipped_layouts()["ucat"])
    again = finlab.load_allocator(checkpoint=untrained_checkpoint)
    assert graph_bytes(build_graph(layout, allocator)) == graph_bytes(build_graph(layout, again))


def test_method_without_a_network_is_refused(untrained_checkpoint: Path) -> None:
    analytic = finlab.load_allocator("analytic", checkpoint=untrained_checkpoint)
    with pytest.raises(FinlabError, match="method 'analytic' has no trained network"):
        build_graph(finlab.load_layout(shipped_layouts()["A"]), analytic)


def test_unknown_failed_fin_is_refused(allocator: Allocator) -> None:
    with pytest.raises(FinlabError, match="no fin 'nobody'"):
        build_graph(finlab.load_layout(shipped_layouts()["A"]), allocator, ("nobody",))


def test_exported_file_stands_in_for_its_layout(
    untrained_checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    checkpoint = ["--checkpoint", str(untrained_checkpoint)]
    path = str(tmp_path / "A.graph.json")
    assert main(["export", "A", "-o", path, "--failed", "back_left", *checkpoint]) == 0
    capsys.readouterr()
    answers = []
    for argv in ([path], ["A", "--failed", "back_left"]):
        assert main(["allocate", *argv, *WRENCH, "--json", *checkpoint]) == 0
        answers.append(json.loads(capsys.readouterr().out))
    assert answers[0]["failed"] == ["back_left"]
    assert answers[0]["command"] == answers[1]["command"]
    assert main(["layout", "check", path]) == 0


def test_export_refuses_another_file_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "A", "-o", "A.json"]) == 2
    assert capsys.readouterr().err.startswith("finlab: error: A.json: expected a file name that ends in")


def test_edited_export_is_refused(
    untrained_checkpoint: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "A.graph.json"
    assert main(["export", "A", "-o", str(path), "--checkpoint", str(untrained_checkpoint)]) == 0
    path.write_text(path.read_text().replace("0.25753", "0.35753", 1))
    capsys.readouterr()
    assert main(["allocate", str(path), *WRENCH]) == 2
    assert capsys.readouterr().err == (
        f"finlab: error: {path}: checksum: does not fit the contents; the file was changed, export it again\n"
    )
