"""The exported ONNX files answer, in onnxruntime, as the numpy networks do."""

from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
from numpy.typing import NDArray

from finlab.assets import checkpoint_path
from finlab.cli import main
from finlab.deploy.onnx_export import FAST, NETWORK, SURROGATE, onnx_files
from finlab.errors import CheckpointError
from finlab.inference.checkpoint import read_checkpoint
from finlab.inference.fast_network import NumpyFastNetwork
from finlab.inference.learned_fin import LearnedFin
from finlab.inference.network import NumpyNetwork
from finlab.inference.surrogate import surrogate_on
from finlab.inference.weights import TrainedWeights
from finlab.layout import random_layout

Array = NDArray[np.float32]


@pytest.fixture(scope="module", params=["untrained", "default"])
def weights(request: pytest.FixtureRequest, untrained_checkpoint: Path) -> TrainedWeights:
    """A small network with random weights, and the shipped one."""
    return read_checkpoint(untrained_checkpoint if request.param == "untrained" else checkpoint_path())


def run(content: bytes, **inputs: NDArray[np.floating]) -> list[Array]:
    """What onnxruntime answers."""
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    return list(session.run(None, {key: value.astype(np.float32) for key, value in inputs.items()}))


@pytest.mark.parametrize("n_fins", [1, 2, 5, 8])
@pytest.mark.parametrize("limits", ["nominal", "mixed"])
def test_network(weights: TrainedWeights, n_fins: int, limits: str) -> None:
    rng = np.random.default_rng(n_fins)
    layout = random_layout(rng, n_fins=(n_fins, n_fins), limits=limits)  # type: ignore[arg-type]
    features = rng.normal(size=(6, n_fins, 25)).astype(np.float32)
    target = rng.normal(size=(6, 6)).astype(np.float32)
    sizes = weights.check_network()
    truth = NumpyNetwork(weights.network, sizes.heads, sizes.n_components)(
        features, target, layout.lower, layout.upper
    )
    weight, mean, std = run(
        onnx_files(weights)[NETWORK], features=features, target=target, lower=layout.lower, upper=layout.upper
    )
    np.testing.assert_allclose(weight, truth.weight, atol=2e-5)
    np.testing.assert_allclose(std, truth.std, rtol=2e-4)
    apart = np.abs(mean - truth.mean)
    apart[..., 2] = np.minimum(apart[..., 2], np.abs(2.0 - apart[..., 2]))  # an angle: -1 is 1
    assert apart.max() < 2e-4


def test_surrogate(weights: TrainedWeights) -> None:
    layout = random_layout(np.random.default_rng(0), n_fins=(5, 5))
    draws = np.random.default_rng(1).random((40, 5, 3))
    command = layout.lower + draws * (layout.upper - layout.lower)
    force, wrench = run(
        onnx_files(weights)[SURROGATE],
        command=command,
        position=layout.position,
        mounting_angle=layout.mounting_angle,
    )
    np.testing.assert_allclose(force, LearnedFin(weights.surrogate).force(command), atol=2e-5)
    np.testing.assert_allclose(wrench, surrogate_on(layout, weights).wrench(command), atol=5e-5)


def test_fast_network() -> None:
    weights = read_checkpoint(checkpoint_path())
    assert weights.fast is not None
    features = np.random.default_rng(0).normal(size=(7, 4, 25)).astype(np.float32)
    (share,) = run(onnx_files(weights)[FAST], features=features)
    np.testing.assert_allclose(share, NumpyFastNetwork(weights.fast)(features), atol=1e-5)


def test_files_are_valid_repeatable_and_say_what_they_are(tmp_path: Path) -> None:
    weights = read_checkpoint(checkpoint_path())
    assert main(["export", "A", "-o", str(tmp_path), "--onnx"]) == 0
    files = onnx_files(weights)
    assert {path.name for path in tmp_path.iterdir()} == {NETWORK, SURROGATE, FAST}
    for name, content in files.items():
        assert (tmp_path / name).read_bytes() == content
        model = onnx.load_from_string(content)
        onnx.checker.check_model(model, full_check=True)
        about = {entry.key: entry.value for entry in model.metadata_props}
        assert about["checkpoint"] == "default" and about["checkpoint_sha256"] == weights.sha256


def test_networks_of_the_paper_have_no_export() -> None:
    with pytest.raises(CheckpointError, match="only the networks of method `learned` have an export"):
        onnx_files(read_checkpoint(checkpoint_path("paper")))
