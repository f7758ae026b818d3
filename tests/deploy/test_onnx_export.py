"""The exported ONNX files answer, in onnxruntime, as the numpy networks do."""

import errno
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import pytest
from numpy.typing import NDArray

from finlab.assets import checkpoint_path
from finlab.cli import main
from finlab.deploy.onnx_export import NETWORK, SURROGATE, onnx_files, write_onnx
from finlab.errors import CheckpointError, DataError
from finlab.inference.checkpoint import read_checkpoint
from finlab.inference.force_network import NODE_SIZE, PAIR_SIZE, NumpyForceNetwork
from finlab.inference.network import NumpyNetwork
from finlab.inference.surrogate import surrogate_on
from finlab.inference.weights import ForceNetworkConfig, NetworkConfig, TrainedWeights
from finlab.layout import random_layout

Array = NDArray[np.float32]


def random_state(shapes: Mapping[str, tuple[int, ...]]) -> dict[str, Array]:
    """Weights of a network that has learned nothing."""
    rng = np.random.default_rng(0)
    return {name: (0.3 * rng.normal(size=shape)).astype(np.float32) for name, shape in shapes.items()}


@pytest.fixture(scope="module", params=["random", "shipped"])
def paper(request: pytest.FixtureRequest) -> TrainedWeights:
    """The paper's networks, with random weights and with the shipped ones."""
    weights = read_checkpoint(checkpoint_path("paper"))
    if request.param == "shipped":
        return weights
    sizes, surrogate = weights.network_config, weights.surrogate_config
    assert sizes is not None and surrogate is not None
    networks = random_state(sizes.shapes()), random_state(surrogate.shapes())
    return replace(weights, network=networks[0], surrogate=networks[1])


def run(content: bytes, **inputs: NDArray[np.floating]) -> list[Array]:
    """What onnxruntime answers."""
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    return list(session.run(None, {key: value.astype(np.float32) for key, value in inputs.items()}))


@pytest.mark.parametrize("n_fins", [1, 2, 5, 8])
def test_network_of_the_paper(paper: TrainedWeights, n_fins: int) -> None:
    rng = np.random.default_rng(n_fins)
    features = rng.normal(size=(6, n_fins, 10)).astype(np.float32)
    target = rng.normal(size=(6, 6)).astype(np.float32)
    sizes = paper.check_network(NetworkConfig)
    truth = NumpyNetwork(paper.network, sizes.heads, sizes.n_components)(features, target)
    weight, mean, std = run(onnx_files(paper)[NETWORK], features=features, target=target)
    np.testing.assert_allclose(weight, truth.weight, atol=2e-5)
    np.testing.assert_allclose(mean, truth.mean, rtol=1e-4, atol=2e-4)
    np.testing.assert_allclose(std, truth.std, rtol=2e-4)


@pytest.mark.parametrize("shipped", [True, False])
@pytest.mark.parametrize("n_fins", [1, 2, 5, 12])
def test_network_over_forces(n_fins: int, shipped: bool, untrained_mdn: Path) -> None:
    weights = read_checkpoint(checkpoint_path() if shipped else untrained_mdn)
    sizes, rng = weights.check_network(ForceNetworkConfig), np.random.default_rng(n_fins)
    nodes = rng.normal(size=(6, n_fins, NODE_SIZE)).astype(np.float32)
    pairs = rng.normal(size=(6, n_fins, n_fins, PAIR_SIZE)).astype(np.float32)
    truth = NumpyForceNetwork(weights.network, sizes.heads)(nodes, pairs)
    files = onnx_files(weights)
    assert set(files) == {NETWORK}
    weight, mean, std = run(files[NETWORK], nodes=nodes, pairs=pairs)
    np.testing.assert_allclose(weight, truth.weight, atol=2e-5)
    np.testing.assert_allclose(std, truth.std, rtol=2e-4)
    np.testing.assert_allclose(mean[..., 0] + 1j * mean[..., 1], truth.mean, atol=2e-4)


@pytest.mark.parametrize("limits", ["nominal", "mixed"])
def test_surrogate_of_the_paper(paper: TrainedWeights, limits: str) -> None:
    layout = random_layout(np.random.default_rng(0), n_fins=(5, 5), limits=limits)
    draws = np.random.default_rng(1).random((40, 5, 3))
    command = layout.lower + draws * (layout.upper - layout.lower)
    force, wrench = run(
        onnx_files(paper)[SURROGATE],
        command=command,
        position=layout.position,
        mounting_angle=layout.mounting_angle,
        lower=layout.lower,
        upper=layout.upper,
    )
    truth = surrogate_on(layout, paper)
    np.testing.assert_allclose(force, truth.fins.force(command), rtol=1e-4, atol=5e-5)
    np.testing.assert_allclose(wrench, truth.wrench(command), rtol=1e-4, atol=1e-4)


def test_files_are_valid_repeatable_and_say_what_they_are(tmp_path: Path) -> None:
    weights = read_checkpoint(checkpoint_path("paper"))
    assert main(["export", "A", "-o", str(tmp_path), "--onnx", "--checkpoint", "paper"]) == 0
    files = onnx_files(weights)
    assert {path.name for path in tmp_path.iterdir()} == {NETWORK, SURROGATE}
    for name, content in files.items():
        assert (tmp_path / name).read_bytes() == content
        model = onnx.load_from_string(content)
        onnx.checker.check_model(model, full_check=True)
        about = {entry.key: entry.value for entry in model.metadata_props}
        assert about["checkpoint"] == "paper" and about["checkpoint_sha256"] == weights.sha256


def test_checkpoints_without_a_network_have_no_export() -> None:
    weights = read_checkpoint(checkpoint_path("paper"))
    with pytest.raises(CheckpointError, match="only the networks of the methods `mdn` and `paper` have an"):
        onnx_files(replace(weights, network_config=None, network={}))


def test_without_the_package_one_sentence_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "onnx", None)
    told = "the package onnx is not installed; pip install 'finlab[onnx]'"
    with pytest.raises(DataError) as caught:
        onnx_files(read_checkpoint(checkpoint_path("paper")))
    assert str(caught.value) == told
    assert main(["export", "A", "-o", str(tmp_path / "x"), "--onnx", "--checkpoint", "paper"]) == 2
    assert told in capsys.readouterr().err and not (tmp_path / "x").exists()


def test_folders_are_made_and_what_cannot_be_written_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    weights = read_checkpoint(checkpoint_path())
    folder = tmp_path / "new" / "and" / "nested"
    for _ in range(2):  # again in place of the first
        assert write_onnx(weights, folder) == [NETWORK]
        assert (folder / NETWORK).read_bytes() == onnx_files(weights)[NETWORK]
    (folder / NETWORK).unlink()
    (folder / NETWORK).mkdir()
    taken = tmp_path / "taken"
    taken.write_text("a file")
    for place, named, why in (
        (folder, folder / NETWORK, "Is a directory"),
        (taken, taken, "File exists"),
        (taken / "deeper", taken / "deeper", "Not a directory"),
    ):
        with pytest.raises(DataError) as caught:
            write_onnx(weights, place)
        assert str(caught.value) == f"{named}: cannot be written: {why}"

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(DataError) as caught:
        write_onnx(weights, tmp_path)
    assert str(caught.value) == f"{tmp_path}: cannot be written: No space left on device"
