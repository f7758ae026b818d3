"""The terms of the paper's loss, each against a direct reading of its equation."""

import math

import numpy as np
import pytest
import torch

from finlab.paper.network import Mixture
from finlab.paper.training.modules import guidance, imitation, negative_entropy
from finlab.paper.training.recipes import RECIPES
from finlab.paper.training.samples import Batch, DataSettings, fresh_batch

M = 3


@pytest.fixture(scope="module")
def batch() -> Batch:
    return fresh_batch(DataSettings(layouts=12, commands=2, seed=5))


def mixture_of(batch: Batch, log_std: float) -> Mixture:
    """A mixture whose components stand in the middle of the limits."""
    draw = torch.Generator().manual_seed(1)
    shape = (*batch.mask.shape, M)
    flat = torch.full((*shape, 3), log_std)
    return Mixture(torch.randn(shape, generator=draw), torch.zeros(*shape, 3), flat)


def test_imitation_is_the_negative_log_likelihood_of_the_fins_that_exist(batch: Batch) -> None:
    mixture = mixture_of(batch, -0.5)
    found = imitation(mixture, batch).numpy()
    for row in range(len(found)):
        expected = 0.0
        for i in range(int(batch.mask[row].sum())):
            low, high = batch.lower[row, i].numpy(), batch.upper[row, i].numpy()
            x = (2.0 * batch.command[row, i].numpy() - low - high) / (high - low)
            # All components are alike, so their weights cancel.
            expected -= float(np.sum(-0.5 * (x / math.exp(-0.5)) ** 2 + 0.5 - 0.5 * math.log(2 * math.pi)))
        assert found[row] == pytest.approx(expected, rel=1e-4)


def test_guidance_is_the_squared_error_of_a_sample_inside_the_limits(batch: Batch) -> None:
    mixture = mixture_of(batch, 1.0)
    mixture.mean.requires_grad_()
    seen: list[torch.Tensor] = []

    def surrogate(command: torch.Tensor, batch: Batch) -> torch.Tensor:
        seen.append(command)
        return (command * batch.mask[..., None]).sum(1).repeat(1, 2)

    draw, std = torch.Generator().manual_seed(2), torch.tensor([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    noise = torch.rand((*batch.mask.shape, 1), generator=draw)
    normal = torch.randn((*noise.shape, 3), generator=draw)
    found = guidance(mixture, surrogate, batch, std, (noise, normal))
    (command,) = seen
    inside = (command >= batch.lower - 1e-6) & (command <= batch.upper + 1e-6)
    assert inside.all() and (command == batch.upper)[batch.mask].any()
    wrench = (command * batch.mask[..., None]).sum(1).repeat(1, 2)
    torch.testing.assert_close(found, (((wrench - batch.wrench) / std) ** 2).sum(1))
    found.sum().backward()
    assert mixture.mean.grad is not None
    clamped = (command == batch.upper) & batch.mask[..., None]
    assert (mixture.mean.grad.sum(2)[clamped] != 0.0).all()  # a sample outside its limits teaches, too


def test_entropy_is_that_of_the_weights_over_the_fins_that_exist(batch: Batch) -> None:
    mixture = mixture_of(batch, 0.0)
    found = negative_entropy(mixture, batch.mask)
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
    training, network = paper.allocator_training, paper.network
    assert (training.batch_size, training.learning_rate, training.cosine) == (16_384, 1e-4, False)
    assert training.steps == 115 * (5_000_000 // 16_384) and paper.surrogate_training.one_layout
    assert (network.width, network.heads, network.graph_layers) == (128, 4, 2)
    assert (network.transformer_layers, network.n_components) == (3, 8)
    assert paper.surrogate.hidden[0] == 512
