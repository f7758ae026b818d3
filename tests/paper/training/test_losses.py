"""The terms of the loss: one number per sample, and on small cases the number one gets by hand."""

import math

import pytest
import torch
from torch import Tensor

from finlab.layout import FinModelSpec
from finlab.networks.normalization import to_normalized
from finlab.paper.network import Mixture
from finlab.paper.training import losses
from finlab.paper.training.sampling import Batch, fresh_batch
from finlab.physics import assemble_wrench, make_law

DRAG = make_law(FinModelSpec())

B, N, M = 6, 5, 3
STD = torch.tensor([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])
DRAW = torch.Generator().manual_seed(0)
NOISE = torch.rand((B, N, 1), generator=DRAW), torch.randn((B, N, 1, 3), generator=DRAW)


class Physics:
    """The fin physics itself in place of a surrogate, so that recorded commands give the recorded wrench."""

    def wrench(self, command: Tensor, batch: Batch) -> Tensor:
        return assemble_wrench(DRAG, command, batch.position, batch.mounting_angle, batch.mask)


physics = Physics()


@pytest.fixture
def batch() -> Batch:
    return fresh_batch(DRAG, B, seed=1)


def make_mixture(batch: Batch, exact: int | None = None) -> Mixture:
    """A random mixture; the means of component `exact` are the recorded commands."""
    draw = torch.Generator().manual_seed(3)
    mean = 1.6 * torch.rand(B, N, M, 3, generator=draw) - 0.8
    if exact is not None:
        mean[:, :, exact] = to_normalized(batch.command, batch.lower, batch.upper)
    logits = torch.randn((B, N, M), generator=draw)
    log_std = torch.randn(B, N, M, 3, generator=draw) * 0.3
    return Mixture(logits, mean, log_std)


def target_of(batch: Batch) -> Tensor:
    return batch.wrench / STD


def part(value: Batch | Mixture, rows: slice) -> Batch | Mixture:
    return type(value)(*(tensor[rows] for tensor in value))


def test_every_term_is_per_sample(batch: Batch) -> None:
    """What a sample costs does not depend on the others, so any split of a batch gives the same mean."""
    mixture = make_mixture(batch)

    def terms(m: Mixture, b: Batch) -> dict[str, Tensor]:
        return {"imitation": losses.imitation(m, b), "entropy": losses.negative_entropy(m, b.mask)}

    whole = terms(mixture, batch)
    for rows in (slice(0, 2), slice(2, B)):
        for name, value in terms(part(mixture, rows), part(batch, rows)).items():  # type: ignore[arg-type]
            assert value.shape == (B if rows is None else len(range(B)[rows]),), name
            torch.testing.assert_close(value, whole[name][rows], msg=name)


def test_imitation_is_the_negative_log_likelihood_of_what_was_done(batch: Batch) -> None:
    mixture = make_mixture(batch)
    x = to_normalized(batch.command, batch.lower, batch.upper)
    expected = -(mixture.log_prob(x[:, None])[:, 0] * batch.mask).sum(1)
    torch.testing.assert_close(losses.imitation(mixture, batch), expected)


def test_sample_guidance_of_a_sharp_mixture_is_the_squared_error_of_its_mean(batch: Batch) -> None:
    sharp = make_mixture(batch, exact=1)
    sharp = sharp._replace(
        log_std=sharp.log_std - 30.0, logits=torch.tensor([0.0, 60.0, 0.0]).expand(B, N, M)
    )
    target = target_of(batch)
    exact = losses.sample_guidance(sharp, physics, batch, target, STD, NOISE)  # type: ignore[arg-type]
    torch.testing.assert_close(exact, torch.zeros(B), atol=1e-6, rtol=0.0)
    off = losses.sample_guidance(sharp, physics, batch, target + 2.0, STD, NOISE)  # type: ignore[arg-type]
    torch.testing.assert_close(off, torch.full((B,), 6 * 4.0), atol=1e-3, rtol=0.0)


def test_sample_guidance_teaches_even_from_outside_the_limits(batch: Batch) -> None:
    mixture = make_mixture(batch)
    mixture = mixture._replace(mean=(mixture.mean + 3.0).requires_grad_(True))
    losses.sample_guidance(mixture, physics, batch, target_of(batch), STD, NOISE).sum().backward()  # type: ignore[arg-type]
    gradient = mixture.mean.grad
    assert gradient is not None and (gradient[batch.mask].abs().amax(dim=(1, 2)) > 0).any()


def test_negative_entropy_by_hand() -> None:
    mask = torch.tensor([[True, True, False], [True, False, False]])
    per_fin = torch.zeros(2, 3, 4)
    per_fin[0, 0] = torch.tensor([100.0, 0.0, 0.0, 0.0])  # certain: no entropy
    per_fin[:, 2] = torch.tensor([5.0, 0.0, 0.0, 0.0])  # padding
    empty = torch.zeros(2, 3, 4, 3)
    value = losses.negative_entropy(Mixture(per_fin, empty, empty), mask)
    torch.testing.assert_close(value, torch.tensor([-math.log(4) / 2, -math.log(4)]))
