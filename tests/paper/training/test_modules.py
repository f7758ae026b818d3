"""The networks on PyTorch's layers: robots of 2 to 5 fins in one batch, against each alone in numpy."""

import numpy as np
import pytest
import torch

from finlab.layout import Layout, random_layout
from finlab.networks.trained import Normalization, TrainedWeights, check_state
from finlab.paper.network import NetworkConfig, raw_features
from finlab.paper.surrogate import LayoutSurrogate, SurrogateConfig
from finlab.paper.training.modules import AllocatorNetwork, Surrogate, features
from finlab.paper.training.samples import N_FINS, Batch

SIZES = NetworkConfig(width=32, heads=4, transformer_layers=2, feedforward=40, n_components=6)
HIDDEN = SurrogateConfig(hidden=(24, 16))
PLACE = ("position", "mounting_angle", "lower", "upper")


@pytest.fixture(scope="module")
def robots() -> list[Layout]:
    rng = np.random.default_rng(3)
    return [random_layout(rng, n_fins=n, limits="varied") for n in (2, 5, 3, 4, 5, 2, 3, 4)]


def padded(robots: list[Layout], fill: float) -> Batch:
    """A batch of robots with random commands; `fill` stands where there is no fin."""
    rng = np.random.default_rng(4)
    parts: dict[str, list[np.ndarray]] = {name: [] for name in Batch._fields}
    for layout in robots:
        command = rng.uniform(layout.lower, layout.upper)
        own = {name: getattr(layout, name) for name in PLACE} | {"command": command}
        for name, values in own.items():
            whole = np.full((N_FINS, *values.shape[1:]), fill)
            whole[: layout.n] = values
            parts[name].append(whole)
        parts["mask"].append(np.arange(N_FINS) < layout.n)
        parts["wrench"].append(rng.normal(size=6))
    arrays = [np.stack(part) for part in parts.values()]
    return Batch(*(torch.from_numpy(a if a.dtype == bool else a.astype(np.float32)) for a in arrays))


def moved(module: torch.nn.Module) -> torch.nn.Module:
    """The module with weights of which none is zero or one, which would hide one that is misplaced."""
    draw = torch.Generator().manual_seed(2)
    with torch.no_grad():
        for parameter in module.parameters():
            parameter += 0.1 * torch.randn(parameter.shape, generator=draw)
    return module


def arrays(module: torch.nn.Module) -> dict[str, np.ndarray]:
    return {name: value.numpy() for name, value in module.state_dict().items()}


@pytest.mark.parametrize("fill", [0.0, 7.0])
def test_mixtures_of_a_padded_batch_are_those_of_each_robot_alone(robots: list[Layout], fill: float) -> None:
    module, batch = moved(AllocatorNetwork(SIZES)), padded(robots, fill)
    check_state(arrays(module), SIZES.shapes())
    with torch.no_grad():
        together = module(features(batch), batch.wrench, batch.mask)
    for row, layout in enumerate(robots):
        x = raw_features(*(getattr(layout, name) for name in PLACE)).astype(np.float32)[None]
        alone = SIZES(arrays(module), x, batch.wrench[row : row + 1].numpy())
        for got, expected in zip(together, alone, strict=True):
            np.testing.assert_allclose(got[row, : layout.n], expected[0], atol=1e-5)


@pytest.mark.parametrize("fill", [0.0, 7.0])
def test_wrenches_of_a_padded_batch_are_those_of_each_robot_alone(robots: list[Layout], fill: float) -> None:
    module, batch = moved(Surrogate(HIDDEN)), padded(robots, fill)
    check_state(arrays(module), HIDDEN.shapes())
    weights = TrainedWeights(
        "one",
        Normalization(np.zeros(6), np.ones(6)),
        surrogate_sizes={"kind": "mlp", "hidden": list(HIDDEN.hidden)},
        surrogate=arrays(module),
    )
    with torch.no_grad():
        together = module(batch.command, batch)
    for row, layout in enumerate(robots):
        command = batch.command[row, : layout.n].numpy()
        np.testing.assert_allclose(
            together[row], LayoutSurrogate(layout, weights).wrench(command[None])[0], atol=1e-5
        )


def test_no_gradient_comes_from_fins_that_do_not_exist(robots: list[Layout]) -> None:
    batch, module = padded(robots, 7.0), AllocatorNetwork(SIZES)
    x = features(batch).requires_grad_()
    mixture = module(x, batch.wrench, batch.mask)
    sum(
        (part * batch.mask[..., None, None].squeeze(-1 if part.dim() == 3 else ())).sum() for part in mixture
    ).backward()
    assert x.grad is not None and x.grad.isfinite().all()
    assert (x.grad[~batch.mask] == 0.0).all() and (x.grad[batch.mask].abs().sum(-1) > 0.0).all()
