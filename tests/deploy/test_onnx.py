"""Our ONNX files: true to the networks, readable by others, and strictly read."""

from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from onnx import TensorProto, helper

from finlab.deploy.onnx.model import Model, model_bytes
from finlab.deploy.onnx.network import network_model, network_weights
from finlab.deploy.onnx.reading import OPERATORS, read_model
from finlab.deploy.onnx.surrogate import surrogate_model, surrogate_weights
from finlab.errors import DataError, FinlabError
from finlab.inference.learned_fin import FORCE_UNIT, REFERENCE
from finlab.inference.network import NumpyNetwork
from finlab.layout import random_layouts
from finlab.training.networks.checkpoint import Checkpoint, load_checkpoint


@pytest.fixture(scope="module", params=["untrained", "default"])
def checkpoint(request: pytest.FixtureRequest, untrained_checkpoint: Path) -> Checkpoint:
    """A small network with random weights, and the shipped one."""
    from finlab.assets import checkpoint_path

    return load_checkpoint(untrained_checkpoint if request.param == "untrained" else checkpoint_path())


def state(module: torch.nn.Module) -> dict[str, np.ndarray]:
    return {key: value.numpy() for key, value in module.state_dict().items()}


def network_of(checkpoint: Checkpoint) -> Model:
    assert checkpoint.network is not None
    config = checkpoint.network.config
    return network_model(state(checkpoint.network), config.heads, config.n_components, {"who": "a test"})


def surrogate_of(checkpoint: Checkpoint) -> Model:
    return surrogate_model(state(checkpoint.surrogate), REFERENCE, FORCE_UNIT, {})


def run(model: Model, **inputs: np.ndarray) -> list[np.ndarray]:
    """What onnxruntime answers."""
    session = onnxruntime.InferenceSession(model_bytes(model), providers=["CPUExecutionProvider"])
    return list(session.run(None, {key: value.astype(np.float32) for key, value in inputs.items()}))


@pytest.mark.parametrize("n_fins", [1, 2, 5, 8])
@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_network_answers_as_the_trained_one(checkpoint: Checkpoint, n_fins: int, limits: str) -> None:
    assert checkpoint.network is not None
    rng = np.random.default_rng(n_fins)
    arrays = random_layouts(rng, 1, n_fins, limits=limits)  # type: ignore[arg-type]
    lower, upper = arrays.lower[0], arrays.upper[0]
    features = rng.normal(size=(6, n_fins, 25)).astype(np.float32)
    target = rng.normal(size=(6, 6)).astype(np.float32)
    weight, mean, std = run(
        network_of(checkpoint), features=features, target=target, lower=lower, upper=upper
    )
    ends = (torch.tensor(end, dtype=torch.float32).expand(6, -1, -1) for end in (lower, upper))
    with torch.inference_mode():
        truth = checkpoint.network(torch.tensor(features), torch.tensor(target), *ends)
    np.testing.assert_allclose(weight, truth.logits.softmax(-1).numpy(), atol=1e-5)
    np.testing.assert_allclose(std, truth.log_std.exp().numpy(), rtol=1e-4, atol=1e-5)
    wrong = np.abs(mean - truth.mean.numpy())
    wrong[..., 2] = np.minimum(wrong[..., 2], np.abs(2.0 - wrong[..., 2]))  # +-1 is one direction
    assert wrong.max() < 1e-4
    config = checkpoint.network.config
    numpy = NumpyNetwork(state(checkpoint.network), config.heads, config.n_components)
    np.testing.assert_allclose(weight, numpy(features, target, lower, upper).weight, atol=1e-5)


def test_surrogate_answers_as_the_trained_one(checkpoint: Checkpoint) -> None:
    rng = np.random.default_rng(0)
    arrays = random_layouts(rng, 1, 5, limits="varied")
    lower, upper = arrays.lower[0], arrays.upper[0]
    command = (lower + rng.random((40, 5, 3)) * (upper - lower)).astype(np.float32)
    position, angle = arrays.position[0], arrays.mounting_angle[0]
    force, wrench = run(surrogate_of(checkpoint), command=command, position=position, mounting_angle=angle)
    given = [torch.tensor(a, dtype=torch.float32) for a in (position, angle, lower, upper)]
    with torch.inference_mode():
        truth = checkpoint.surrogate(torch.tensor(command), *given)
        by_fin = checkpoint.surrogate.fin_force(torch.tensor(command))
    np.testing.assert_allclose(wrench, truth.numpy(), atol=2e-5)
    np.testing.assert_allclose(force, by_fin.numpy(), atol=2e-5)


def test_weights_come_back_to_the_last_bit(checkpoint: Checkpoint) -> None:
    assert checkpoint.network is not None
    for model, weights_of, module in (
        (network_of(checkpoint), network_weights, checkpoint.network),
        (surrogate_of(checkpoint), surrogate_weights, checkpoint.surrogate),
    ):
        back, truth = weights_of(read_model(model_bytes(model))), state(module)
        assert set(back) == set(truth)
        for name, array in truth.items():
            np.testing.assert_array_equal(back[name], array, err_msg=name)


def test_the_onnx_package_agrees_and_reads_the_metadata(checkpoint: Checkpoint) -> None:
    for model in (network_of(checkpoint), surrogate_of(checkpoint)):
        content = model_bytes(model)
        seen = onnx.load_model_from_string(content)
        onnx.checker.check_model(seen, full_check=True)
        assert {entry.key: entry.value for entry in seen.metadata_props} == dict(model.metadata)
        assert {node.op_type for node in seen.graph.node} <= OPERATORS
        assert model_bytes(read_model(content)) == content, "nothing is lost on the way"


def test_same_weights_same_bytes(checkpoint: Checkpoint) -> None:
    assert model_bytes(network_of(checkpoint)) == model_bytes(network_of(checkpoint))


def foreign(node: onnx.NodeProto, weights: list[onnx.TensorProto] | None = None) -> onnx.ModelProto:
    """A model of one operator, as another exporter might write it."""
    x, y = (helper.make_tensor_value_info(name, TensorProto.FLOAT, [1]) for name in "xy")
    graph = helper.make_graph([node], "foreign", [x], [y], weights or [])
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)


def outside_weights() -> onnx.ModelProto:
    tensor = helper.make_tensor("w", TensorProto.FLOAT, [1], [1.0])
    tensor.ClearField("float_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="/etc/passwd")
    return foreign(helper.make_node("Add", ["x", "w"], ["y"]), [tensor])


def with_subgraph() -> onnx.ModelProto:
    branch = foreign(helper.make_node("Relu", ["x"], ["y"])).graph
    return foreign(helper.make_node("Relu", ["x"], ["y"], then_branch=branch))


def of_another_domain() -> onnx.ModelProto:
    return foreign(helper.make_node("Relu", ["x"], ["y"], domain="com.stranger"))


def not_finite() -> onnx.ModelProto:
    tensor = onnx.numpy_helper.from_array(np.array([np.nan], dtype=np.float32), "w")
    return foreign(helper.make_node("Add", ["x", "w"], ["y"]), [tensor])


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (outside_weights(), "x.onnx: keeps weights outside the file, which is refused"),
        (with_subgraph(), "a subgraph or another foreign setting"),
        (of_another_domain(), "an operator of a foreign kind"),
        (foreign(helper.make_node("Loop", ["x"], ["y"])), "uses the operator 'Loop'"),
        (not_finite(), "a value that is not finite"),
    ],
)
def test_what_reaches_beyond_the_file_is_refused(model: onnx.ModelProto, message: str) -> None:
    with pytest.raises(DataError, match=message):
        read_model(model.SerializeToString(), "x.onnx")


@given(data=st.binary(max_size=200))
def test_any_bytes_end_in_an_error_of_ours(data: bytes) -> None:
    with pytest.raises(FinlabError):
        read_model(data)


def test_changed_bytes_end_in_a_model_or_an_error_of_ours(checkpoint: Checkpoint) -> None:
    content = model_bytes(surrogate_of(checkpoint))
    rng = np.random.default_rng(0)
    for _ in range(500):
        changed = bytearray(content)
        for place in rng.integers(0, len(content), 3):
            changed[place] = rng.integers(0, 256)
        try:
            read_model(bytes(changed[: rng.integers(1, len(content) + 1)]))
        except FinlabError:
            continue
