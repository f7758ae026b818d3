"""The terms of the loss: one number per sample, and on small cases the number one gets by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from finlab.inference.normalization import to_normalized
from finlab.layout import FinModelSpec
from finlab.layout.angles import is_full_turn
from finlab.physics import assemble_wrench, make_law
from finlab.physics.energy import command_energy
from finlab.training import losses
from finlab.training.networks.allocator_network import Mixture
from finlab.training.presets import get_preset
from finlab.training.sampling import Batch, ForwardSampler

DRAG = make_law(FinModelSpec())

B, N, M = 6, 4, 3
STD = torch.tensor([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])


def physics(
    command: Tensor, position: Tensor, mounting_angle: Tensor, lower: Tensor, upper: Tensor, mask: Tensor
) -> Tensor:
    """The fin physics itself in place of a surrogate, so that recorded commands give the recorded wrench."""
    return assemble_wrench(DRAG, command, position, mounting_angle, mask)


@pytest.fixture
def batch() -> Batch:
    return ForwardSampler(seed=1, batch_size=B, n_fins=(2, N)).batch(0)


def make_mixture(batch: Batch, joint: bool = True, exact: int | None = None) -> Mixture:
    """A random mixture; the means of component `exact` are the recorded commands."""
    draw = torch.Generator().manual_seed(3)
    mean = 1.6 * torch.rand(B, N, M, 3, generator=draw) - 0.8
    if exact is not None:
        mean[:, :, exact] = to_normalized(batch.command, batch.lower, batch.upper)
    logits = torch.randn((B, M) if joint else (B, N, M), generator=draw)
    log_std = torch.randn(B, N, M, 3, generator=draw) * 0.3
    return Mixture(logits, mean, log_std, is_full_turn(batch.upper[..., 2] - batch.lower[..., 2]))


def target_of(batch: Batch) -> Tensor:
    return batch.wrench / STD


def guidance(mixture: Mixture, batch: Batch, every_mode: float = 0.0) -> tuple[Tensor, Tensor]:
    weights = replace(
        get_preset("default").allocator_training, energy=0.05, softness=0.02, every_mode=every_mode
    )
    return losses.mode_guidance(mixture, physics, batch, target_of(batch), STD, weights)  # type: ignore[arg-type]


def part(value: Batch | Mixture, rows: slice) -> Batch | Mixture:
    return type(value)(*(tensor[rows] for tensor in value))


@pytest.mark.parametrize("joint", [True, False])
def test_every_term_is_per_sample(joint: bool, batch: Batch) -> None:
    """What a sample costs does not depend on the others, so any split of a batch gives the same mean."""
    mixture = make_mixture(batch, joint)

    def terms(m: Mixture, b: Batch) -> dict[str, Tensor]:
        found = {
            "imitation": losses.imitation(m, b, spread_only=False),
            "entropy": losses.negative_entropy(m, b.mask),
        }
        if joint:
            found["guidance"], found["best"] = guidance(m, b, every_mode=0.1)
        return found

    whole = terms(mixture, batch)
    for rows in (slice(0, 2), slice(2, B)):
        for name, value in terms(part(mixture, rows), part(batch, rows)).items():  # type: ignore[arg-type]
            assert value.shape == (B if rows is None else len(range(B)[rows]),), name
            torch.testing.assert_close(value, whole[name][rows], msg=name)


def test_imitation_is_the_negative_log_likelihood_of_what_was_done(batch: Batch) -> None:
    mixture = make_mixture(batch)
    x = to_normalized(batch.command, batch.lower, batch.upper)
    expected = -mixture.log_prob(x, batch.mask)
    torch.testing.assert_close(losses.imitation(mixture, batch, spread_only=False), expected)


def test_imitation_of_the_spread_moves_nothing_else(batch: Batch) -> None:
    mixture = Mixture(*(v.requires_grad_(True) if v.is_floating_point() else v for v in make_mixture(batch)))
    losses.imitation(mixture, batch, spread_only=True).sum().backward()
    assert mixture.mean.grad is None and mixture.logits.grad is None
    assert mixture.log_std.grad is not None and mixture.log_std.grad.abs().sum() > 0
    losses.imitation(mixture, batch, spread_only=False).sum().backward()
    assert mixture.mean.grad is not None and mixture.logits.grad is not None


def test_tracking_error_is_nothing_for_what_was_done_and_the_wrench_for_rest(batch: Batch) -> None:
    command = torch.stack([batch.command, torch.zeros_like(batch.command)], dim=1)
    error = losses.tracking_error(physics, command, batch, target_of(batch), STD)  # type: ignore[arg-type]
    torch.testing.assert_close(error[:, 0], torch.zeros(B, 6), atol=1e-5, rtol=0.0)
    torch.testing.assert_close(error[:, 1], -target_of(batch))


def test_energy_is_the_one_that_answers_are_judged_by(batch: Batch) -> None:
    command = torch.stack([batch.command, 0.5 * batch.command], dim=1)
    masked = np.where(batch.mask[:, None, :, None].numpy(), command.numpy(), np.nan)
    expected = command_energy(masked, batch.upper[:, None].numpy())
    np.testing.assert_allclose(losses.energy(command, batch).numpy(), expected, rtol=1e-4)


def test_sample_guidance_of_a_sharp_mixture_is_the_squared_error_of_its_mean(batch: Batch) -> None:
    sharp = make_mixture(batch, exact=1)
    sharp = sharp._replace(log_std=sharp.log_std - 30.0, logits=torch.tensor([0.0, 60.0, 0.0]).expand(B, M))
    seeded = torch.Generator().manual_seed(0)
    target = target_of(batch)
    exact = losses.sample_guidance(sharp, physics, batch, target, STD, seeded)  # type: ignore[arg-type]
    torch.testing.assert_close(exact, torch.zeros(B), atol=1e-6, rtol=0.0)
    off = losses.sample_guidance(sharp, physics, batch, target + 2.0, STD, seeded)  # type: ignore[arg-type]
    torch.testing.assert_close(off, torch.full((B,), 6 * 4.0), atol=1e-3, rtol=0.0)


def test_sample_guidance_teaches_even_from_outside_the_limits(batch: Batch) -> None:
    mixture = make_mixture(batch)
    mixture = mixture._replace(mean=(mixture.mean + 3.0).requires_grad_(True))
    seeded = torch.Generator().manual_seed(0)
    losses.sample_guidance(mixture, physics, batch, target_of(batch), STD, seeded).sum().backward()  # type: ignore[arg-type]
    gradient = mixture.mean.grad
    assert gradient is not None and (gradient[batch.mask].abs().amax(dim=(1, 2)) > 0).any()


def test_mode_guidance_by_hand(batch: Batch) -> None:
    mixture = make_mixture(batch, exact=2)
    soft, best = guidance(mixture, batch, every_mode=0.1)
    torch.testing.assert_close(best, torch.zeros(B), atol=1e-5, rtol=0.0)
    half = 0.5 * (batch.upper - batch.lower)
    for row in range(B):
        loss = []
        for k in range(M):
            command = (batch.lower + half + mixture.mean[:, :, k] * half)[row]
            wrench = assemble_wrench(
                DRAG, command, batch.position[row], batch.mounting_angle[row], batch.mask[row]
            )
            squared = float(((wrench - batch.wrench[row]) / STD).square().sum())
            real = batch.mask[row].numpy()
            used = float(command_energy(command.numpy()[real], batch.upper[row].numpy()[real]))
            loss.append(math.sqrt(squared + losses.HUBER**2) - losses.HUBER + 0.05 * used)
        share = mixture.logits[row].softmax(-1).tolist()
        terms = [math.log(p) - value / 0.02 for p, value in zip(share, loss, strict=True)]
        peak = max(terms)
        expected = -0.02 * (peak + math.log(sum(math.exp(t - peak) for t in terms))) + 0.1 * sum(loss) / M
        assert float(soft[row]) == pytest.approx(expected, abs=2e-4)


def test_mode_guidance_rewards_weight_on_the_good_component(batch: Batch) -> None:
    mixture = make_mixture(batch, exact=0)
    logits = torch.zeros(B, M, requires_grad=True)
    guidance(mixture._replace(logits=logits), batch)[0].sum().backward()
    assert logits.grad is not None
    # A step against the gradient raises the weight of the component that tracks exactly.
    assert (logits.grad[:, 0] < 0).float().mean() > 0.6


def test_guidance_keeps_finite_gradients_at_a_perfect_answer(batch: Batch) -> None:
    mixture = make_mixture(batch, exact=0)
    mean = mixture.mean.clone().requires_grad_(True)
    guidance(mixture._replace(mean=mean), batch)[0].sum().backward()
    assert mean.grad is not None and mean.grad.isfinite().all()


def test_negative_entropy_by_hand() -> None:
    mask = torch.tensor([[True, True, False], [True, False, False]])
    per_fin = torch.zeros(2, 3, 4)
    per_fin[0, 0] = torch.tensor([100.0, 0.0, 0.0, 0.0])  # certain: no entropy
    per_fin[:, 2] = torch.tensor([5.0, 0.0, 0.0, 0.0])  # padding
    empty = torch.zeros(2, 3, 4, 3)
    value = losses.negative_entropy(Mixture(per_fin, empty, empty, mask), mask)
    torch.testing.assert_close(value, torch.tensor([-math.log(4) / 2, -math.log(4)]))
    joint = Mixture(torch.tensor([[0.0, math.log(3.0)], [0.0, 0.0]]), empty, empty, mask)
    expected = torch.tensor([0.25 * math.log(0.25) + 0.75 * math.log(0.75), -math.log(2)])
    torch.testing.assert_close(losses.negative_entropy(joint, mask), expected)
