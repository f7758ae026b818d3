"""The networks in torch: robots of 2 to 5 fins in one batch, against each alone in numpy; the
losses."""

import math

import numpy as np
import pytest
import torch

from finlab.files.checkpoint_config import WrenchNormalization
from finlab.layout import Layout
from finlab.research.networks.trained import TrainedWeights, to_command
from finlab.research.paper.network import Mixture, NetworkConfig, raw_features
from finlab.research.paper.surrogate import LayoutSurrogate, SurrogateConfig
from finlab.research.paper.training import modules
from finlab.research.paper.training.recipes import RECIPES
from finlab.research.paper.training.samples import (
    FIELDS,
    N_FINS,
    DataSettings,
    SampleBatch,
    SampleTable,
    fresh_batch,
)
from finlab.research.random_layouts import random_layout
from finlab.research.training.loop import first_weights
from tests.torch_weights import arrays_of

NETWORK_SIZES = NetworkConfig(
    width=32, heads=4, transformer_layers=2, feedforward=40, n_components=6
)
"""A network that is small enough to be compared quickly."""
SURROGATE_SIZES = SurrogateConfig(hidden=(24, 16))
"""A surrogate of two small layers."""
GEOMETRY_FIELDS = ("position", "mounting_angle", "lower", "upper")
"""Fields of a robot's fins that a network sees."""


@pytest.fixture(scope="module")
def robots() -> list[Layout]:
    """Eight robots of two to five fins."""
    rng = np.random.default_rng(3)
    return [random_layout(rng, n_fins=n, limits="varied") for n in (2, 5, 3, 4, 5, 2, 3, 4)]


def padded(robots: list[Layout], fill: float) -> SampleBatch:
    """A batch of robots with random commands; `fill` stands where there is no fin."""
    rng = np.random.default_rng(4)
    parts: dict[str, list[np.ndarray]] = {name: [] for name in FIELDS}
    for layout in robots:
        command = rng.uniform(layout.lower, layout.upper)
        own = {name: getattr(layout, name) for name in GEOMETRY_FIELDS} | {"command": command}
        for name, values in own.items():
            whole = np.full((N_FINS, *values.shape[1:]), fill, np.float32)
            whole[: layout.n] = values
            parts[name].append(whole)
        parts["mask"].append(np.arange(N_FINS) < layout.n)
        parts["wrench"].append(rng.normal(size=6).astype(np.float32))
    arrays = {name: torch.from_numpy(np.stack(part)) for name, part in parts.items()}
    one_each = {name: arrays[name][:, None] for name in ("command", "wrench")}
    return SampleTable.of(arrays | one_each).batch(torch.arange(len(robots)))


def commands_of(batch: SampleBatch, row: int, layout: Layout) -> np.ndarray:
    """The commands (n, 3) [rad, Hz, rad] of a robot of a batch."""
    normalized = batch.command[row, : layout.n].numpy()
    return np.asarray(to_command(normalized, layout.lower, layout.upper))


def weights_of(sizes: NetworkConfig | SurrogateConfig) -> dict[str, torch.Tensor]:
    """Weights of which none is zero or one, which would hide one that is misplaced."""
    draw = torch.Generator().manual_seed(2)
    first = first_weights(sizes.shapes(), 0)
    return {
        name: value + 0.1 * torch.randn(value.shape, generator=draw)
        for name, value in first.items()
    }


@pytest.mark.parametrize("fill", [0.0, 7.0])
def test_mixtures_of_a_padded_batch_are_those_of_each_robot_alone(
    robots: list[Layout], fill: float
) -> None:
    weights = weights_of(NETWORK_SIZES)
    batch = padded(robots, fill)
    together = NETWORK_SIZES(weights, batch.features, batch.wrench, batch.mask)
    for row, layout in enumerate(robots):
        x = raw_features(*(getattr(layout, name) for name in GEOMETRY_FIELDS)).astype(np.float32)[
            None
        ]
        alone = NETWORK_SIZES(arrays_of(weights), x, batch.wrench[row : row + 1].numpy())
        for got, expected in zip(together, alone, strict=True):
            np.testing.assert_allclose(got[row, : layout.n].detach(), expected[0], atol=1e-5)


@pytest.mark.parametrize("fill", [0.0, 7.0])
def test_wrenches_of_a_padded_batch_are_those_of_each_robot_alone(
    robots: list[Layout], fill: float
) -> None:
    tensors = weights_of(SURROGATE_SIZES)
    batch = padded(robots, fill)
    weights = TrainedWeights(
        "one",
        WrenchNormalization(np.zeros(6), np.ones(6)),
        surrogate_sizes={"kind": "mlp", "hidden": list(SURROGATE_SIZES.hidden)},
        surrogate=arrays_of(tensors),
    )
    together = modules.surrogate_wrench(SURROGATE_SIZES, tensors, batch.command, batch).detach()
    for row, layout in enumerate(robots):
        command = commands_of(batch, row, layout)
        np.testing.assert_allclose(
            together[row], LayoutSurrogate(layout, weights).wrench(command[None])[0], atol=1e-5
        )


@pytest.mark.parametrize("fill", [0.0, 7.0])
def test_padding_has_no_influence_on_wrenches_and_their_gradients(
    robots: list[Layout], fill: float
) -> None:
    weights = weights_of(SURROGATE_SIZES)

    def answer(batch: SampleBatch) -> list[torch.Tensor]:
        command = batch.command.clone().requires_grad_()
        wrench = modules.surrogate_wrench(SURROGATE_SIZES, weights, command, batch)
        slopes = torch.autograd.grad(wrench.square().sum(), [*weights.values(), command])
        assert (slopes[-1][~batch.mask] == 0.0).all()
        return [wrench, *slopes[:-1], slopes[-1][batch.mask]]

    for found, expected in zip(
        answer(padded(robots, fill)), answer(padded(robots, 3.0)), strict=True
    ):
        torch.testing.assert_close(found, expected, rtol=0.0, atol=0.0)


def test_no_gradient_comes_from_fins_that_do_not_exist(robots: list[Layout]) -> None:
    batch = padded(robots, 7.0)
    weights = weights_of(NETWORK_SIZES)
    x = batch.features.requires_grad_()
    mixture = NETWORK_SIZES(weights, x, batch.wrench, batch.mask)
    sum(
        (part * batch.mask[..., None, None].squeeze(-1 if part.dim() == 3 else ())).sum()
        for part in mixture
    ).backward()
    assert x.grad is not None and x.grad.isfinite().all()
    assert (x.grad[~batch.mask] == 0.0).all() and (x.grad[batch.mask].abs().sum(-1) > 0.0).all()


N_COMPONENTS = 3
"""Components of a mixture."""


@pytest.fixture(scope="module")
def batch() -> SampleBatch:
    """Samples of twelve robots, two of each."""
    return fresh_batch(DataSettings(layouts=12, commands=2, seed=5))


def mixture_of(batch: SampleBatch, log_std: float) -> Mixture:
    """A mixture whose components stand in the middle of the limits."""
    draw = torch.Generator().manual_seed(1)
    shape = (*batch.mask.shape, N_COMPONENTS)
    flat = torch.full((*shape, 3), log_std)
    return Mixture(torch.randn(shape, generator=draw), torch.zeros(*shape, 3), flat)


def test_imitation_is_the_negative_log_likelihood_of_the_fins_that_exist(
    batch: SampleBatch,
) -> None:
    mixture = mixture_of(batch, -0.5)
    found = modules.imitation(mixture, batch).numpy()
    for row in range(len(found)):
        expected = 0.0
        for i in range(int(batch.mask[row].sum())):
            x = batch.command[row, i].numpy()
            # All components are alike, so their weights cancel.
            expected -= float(
                np.sum(-0.5 * (x / math.exp(-0.5)) ** 2 + 0.5 - 0.5 * math.log(2 * math.pi))
            )
        assert found[row] == pytest.approx(expected, rel=1e-4)


def test_guidance_is_the_squared_error_of_a_sample_inside_the_limits(batch: SampleBatch) -> None:
    mixture = mixture_of(batch, 1.0)
    mixture.mean.requires_grad_()
    seen: list[torch.Tensor] = []

    def surrogate(command: torch.Tensor, batch: SampleBatch) -> torch.Tensor:
        seen.append(command)
        return (command * batch.mask[..., None]).sum(1).repeat(1, 2)

    draw = torch.Generator().manual_seed(2)
    std = torch.tensor([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    noise = torch.rand((*batch.mask.shape, 1), generator=draw)
    normal = torch.randn((*noise.shape, 3), generator=draw)
    found = modules.guidance(mixture, surrogate, batch, std, (noise, normal))
    (command,) = seen
    inside = command.abs() <= 1.0
    assert inside.all() and (command == 1.0)[batch.mask].any()
    wrench = (command * batch.mask[..., None]).sum(1).repeat(1, 2)
    torch.testing.assert_close(found, (((wrench - batch.wrench) / std) ** 2).sum(1))
    found.sum().backward()
    assert mixture.mean.grad is not None
    clamped = (command == 1.0) & batch.mask[..., None]
    assert (
        mixture.mean.grad.sum(2)[clamped] != 0.0
    ).all()  # a sample outside its limits teaches, too


def test_entropy_is_that_of_the_weights_over_the_fins_that_exist(batch: SampleBatch) -> None:
    mixture = mixture_of(batch, 0.0)
    found = modules.negative_entropy(mixture, batch.mask)
    entropy = torch.distributions.Categorical(logits=mixture.logits).entropy()
    for row, n in enumerate(batch.mask.sum(1)):
        assert float(found[row]) == pytest.approx(-float(entropy[row, :n].mean()), rel=1e-5)


def test_the_guidance_weight_rises_linearly_and_stays() -> None:
    training = RECIPES["paper"].allocator_training
    end = training.ramp * training.steps
    assert training.beta(0) == training.guidance_start
    middle = 0.5 * (training.guidance_start + training.guidance)
    assert training.beta(round(end / 2)) == pytest.approx(middle, rel=1e-3)
    assert training.beta(training.steps) == training.guidance


def test_the_paper_recipe_has_the_printed_numbers() -> None:
    paper = RECIPES["paper"]
    assert (paper.data.layouts, paper.data.commands) == (1000, 5000)
    training = paper.allocator_training
    network = paper.network
    assert (training.batch_size, training.learning_rate, training.cosine) == (16_384, 1e-4, False)
    assert training.steps == 115 * (5_000_000 // 16_384) and paper.surrogate_training.one_layout
    assert (network.width, network.heads, network.graph_layers) == (128, 4, 2)
    assert (network.transformer_layers, network.n_components) == (3, 8)
    assert paper.surrogate.hidden[0] == 512
