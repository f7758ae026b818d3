"""The paper's network against PyTorch Geometric and PyTorch's own layers, and in numpy against
itself."""

import math
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
import torch
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal
from torch_geometric.nn import GATv2Conv

from finlab.layout import Fin, Layout, Limits
from finlab.research.networks.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.research.networks.layers import graph_attention
from finlab.research.networks.trained import ArraysByName
from finlab.research.paper.network import RAW_SIZE, Mixture, NetworkConfig, raw_features
from finlab.research.random_layouts import random_layout

CONFIG = NetworkConfig(width=32, heads=4, transformer_layers=2, feedforward=40, n_components=6)
"""A network that is small enough to be compared quickly."""
N_ROBOTS = 4
"""Robots of a batch."""
N_FINS = 3
"""Fins of a robot."""
N_COMPONENTS = 5
"""Components of a mixture."""


def random_weights(config: NetworkConfig = CONFIG) -> dict[str, torch.Tensor]:
    """Weights of which none is zero or one, which would hide one that is misplaced."""
    draw = torch.Generator().manual_seed(2)
    return {
        name: 0.3 * torch.randn(shape, generator=draw) for name, shape in config.shapes().items()
    }


def arrays_of(weights: dict[str, torch.Tensor]) -> dict[str, np.ndarray]:
    """Weights as arrays."""
    return {name: value.numpy() for name, value in weights.items()}


def tensors(weights: ArraysByName) -> dict[str, torch.Tensor]:
    """Weights as tensors."""
    return {name: torch.tensor(value) for name, value in weights.items()}


def random_robots() -> tuple[torch.Tensor, torch.Tensor]:
    """Features of 12 robots of 5 fins, and targets."""
    rng = np.random.default_rng(5)
    layouts = [random_layout(rng, n_fins=5, limits="varied") for _ in range(12)]
    parts = ("position", "mounting_angle", "lower", "upper")
    drawn = [
        torch.tensor(np.array([getattr(layout, part) for layout in layouts])) for part in parts
    ]
    target = torch.randn(12, 6, generator=torch.Generator().manual_seed(5))
    return raw_features(*drawn).float(), target


@pytest.mark.parametrize("n", [2, 5])
def test_graph_attention_is_that_of_pytorch_geometric(n: int) -> None:
    weights = random_weights()
    reference = GATv2Conv(CONFIG.width, CONFIG.width // CONFIG.heads, heads=CONFIG.heads)
    with torch.no_grad():
        for ours, theirs in (("source", reference.lin_l), ("target", reference.lin_r)):
            theirs.weight.copy_(weights[f"graph.0.{ours}.weight"])
            theirs.bias.copy_(weights[f"graph.0.{ours}.bias"])
        reference.att.copy_(weights["graph.0.attention"][None])
        reference.bias.copy_(weights["graph.0.bias"])
    edges = torch.tensor(list(permutations(range(n), 2))).T
    x = torch.randn(3, n, CONFIG.width)
    found = graph_attention(weights, "graph.0", x)
    for row in range(3):
        torch.testing.assert_close(
            found[row], reference(x[row], edges).detach(), atol=1e-4, rtol=1e-4
        )


def test_numpy_and_torch_agree_with_the_shipped_weights() -> None:
    weights = read_checkpoint(resolve_checkpoint("paper"))
    config = weights.network_of(NetworkConfig)
    x, target = random_robots()
    got = config(weights.network, x.numpy(), target.numpy())
    expected = config(
        tensors(weights.network), x, target, torch.ones(x.shape[:2], dtype=torch.bool)
    )
    for a, b in zip(got, expected, strict=True):
        assert a.dtype == np.float32
        np.testing.assert_allclose(a, b.numpy(), atol=2e-3, rtol=1e-3)


def test_transformer_is_that_of_pytorch() -> None:
    """Without graph layers, of robots of 2 to 5 fins."""
    config = replace(CONFIG, graph_layers=0)
    x, target = random_robots()
    weights = random_weights()
    mask = torch.arange(5) < torch.arange(12)[:, None] % 4 + 2
    sizes = config.width, config.heads, config.feedforward
    layer = torch.nn.TransformerEncoderLayer(*sizes, dropout=0.0, batch_first=True, norm_first=True)
    reference = torch.nn.TransformerEncoder(
        layer, config.transformer_layers, enable_nested_tensor=False
    )
    named = {name: value for name, value in weights.items() if name.startswith("transformer.")}
    reference.load_state_dict(
        {name.removeprefix("transformer."): value for name, value in named.items()}
    )
    linear = torch.nn.functional.linear
    wrench = target[:, None].expand(-1, 5, -1)
    parts = ("enter", x), ("wrench", wrench)
    both = [
        linear(part, weights[f"{name}.weight"], weights[f"{name}.bias"]) for name, part in parts
    ]
    joined = linear(torch.cat(both, -1), weights["join.weight"], weights["join.bias"])
    ends = weights["norm.weight"], weights["norm.bias"]
    hidden = reference(joined, src_key_padding_mask=~mask)
    expected = torch.nn.functional.layer_norm(hidden, (config.width,), *ends).detach()
    found = config.encoded(weights, x, target, mask)
    torch.testing.assert_close(found[mask], expected[mask], atol=1e-4, rtol=1e-4)


def test_fins_may_come_in_any_order() -> None:
    weights = random_weights()
    x, target = random_robots()
    order = torch.tensor([3, 0, 4, 1, 2])
    for got, expected in zip(
        CONFIG(weights, x[:, order], target), CONFIG(weights, x, target), strict=True
    ):
        torch.testing.assert_close(got, expected[:, order], atol=1e-4, rtol=1e-4)


def test_huge_inputs_are_no_warning(recwarn: pytest.WarningsRecorder) -> None:
    x = np.full((2, 3, RAW_SIZE), 1e4, dtype=np.float32)
    target = np.array([[1e6] * 6, [-1e6] * 6], dtype=np.float32)
    assert all(np.isfinite(part).all() for part in CONFIG(arrays_of(random_weights()), x, target))
    assert not recwarn.list


def test_documented_meaning_of_the_features() -> None:
    limits = Limits((0.06, 0.3), (0.21, 2.1), (-1.0, 2.0))
    layout = Layout("one", (Fin("bow", (0.3, -0.15, 0.06), math.pi / 2, limits),))
    expected = [1.0, -0.5, 0.2, 0.5, 0.1, 0.5, 0.1, 1.0, -1.0 / math.pi, 2.0 / math.pi]
    np.testing.assert_allclose(
        raw_features(layout.position, layout.mounting_angle, layout.lower, layout.upper)[0],
        expected,
    )


def random_mixture() -> Mixture:
    """A mixture of each fin of each robot."""
    draw = np.random.default_rng(11)
    mean = 1.8 * draw.random((N_ROBOTS, N_FINS, N_COMPONENTS, 3)) - 0.9
    return Mixture(
        2.0 * draw.normal(size=(N_ROBOTS, N_FINS, N_COMPONENTS)),
        mean,
        0.3 * draw.normal(size=(N_ROBOTS, N_FINS, N_COMPONENTS, 3)) - 1.0,
    )


def drawn(mixture: Mixture, count: int, temperature: float = 1.0) -> np.ndarray:
    """Samples (robots, fins, count, 3) of a mixture."""
    rng = np.random.default_rng(0)
    uniform = rng.random((N_ROBOTS, N_FINS, count))
    normal = rng.standard_normal((N_ROBOTS, N_FINS, count, 3))
    return np.asarray(mixture.sample(uniform, normal, temperature))


def torch_distribution(mixture: Mixture, temperature: float = 1.0) -> MixtureSameFamily:
    """The same mixture by torch's own classes."""
    logits, mean, log_std = map(torch.from_numpy, mixture)
    return MixtureSameFamily(
        Categorical(logits=logits / temperature), Independent(Normal(mean, log_std.exp()), 1)
    )


def test_likelihoods_are_those_of_torchs_distributions() -> None:
    mixture = random_mixture()
    x = np.random.default_rng(2).uniform(-1.2, 1.2, (N_ROBOTS, 7, N_FINS, 3))
    expected = (
        torch_distribution(mixture).log_prob(torch.from_numpy(x).transpose(0, 1)).transpose(0, 1)
    )
    np.testing.assert_allclose(mixture.log_prob(x), expected.numpy(), rtol=1e-9)
    tensors = Mixture(*map(torch.from_numpy, mixture))
    np.testing.assert_allclose(
        tensors.log_prob(torch.from_numpy(x)).numpy(), expected.numpy(), rtol=1e-9
    )


@pytest.mark.parametrize("temperature", [1.0, 0.3])
def test_samples_have_the_moments_of_the_mixture_and_a_temperature_sharpens_weights_alone(
    temperature: float,
) -> None:
    mixture = random_mixture()
    x = drawn(mixture, 40_000, temperature)
    expected = torch_distribution(mixture, temperature)
    np.testing.assert_allclose(x.mean(1), expected.mean.numpy(), atol=0.03)
    np.testing.assert_allclose(x.std(1), expected.stddev.numpy(), atol=0.03)
    if temperature == 1.0:
        np.testing.assert_allclose(mixture.expected(), expected.mean.numpy(), rtol=1e-9)


def test_no_temperature_takes_the_likeliest_component(recwarn: pytest.WarningsRecorder) -> None:
    mixture = random_mixture()
    mixture = mixture._replace(log_std=np.full_like(mixture.log_std, -30.0))
    best = mixture.logits.argmax(-1)[..., None, None]
    expected = np.take_along_axis(mixture.mean, best, axis=2)[:, :, 0]
    for temperature in (0.0, 1e-12):
        got = drawn(mixture, 7, temperature)
        np.testing.assert_allclose(got, np.repeat(expected[:, None], 7, axis=1), atol=1e-5)
    assert not recwarn.list
