"""Training of the networks of a learned interaction, from forward data of many robots.

What the laws of the actuators leave of each measured wrench, over the robot's wrench scale, is the
sum of the messages. Their features and vectors do not depend on the weights, so they are made once;
a step of training is two small networks on the rows of some samples.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from finlab.arrays import AnyArray, Array
from finlab.errors import DataError
from finlab.fit.interaction.constants import parts_of_error
from finlab.fit.interaction.samples import Samples, left_by_laws
from finlab.interaction.interaction import JetGeometry, lever_of
from finlab.interaction.learned import LAYERS, MEMBERS
from finlab.interaction.messages import ROW_SIZES, Messages, unpack_rows
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.research.networks.trained import ArraysByName
from finlab.research.training.device import workplace
from finlab.research.training.loop import LoopSettings, Training, seeded_generator
from finlab.whole_file import write_whole

WIDTH = 64
"""Of the hidden layers."""
MESSAGE_MIN = 1e-4
"""Size of a message's vectors, as a share of the wrench scale, below which it is left out."""
HELD_OUT_SHARE = 0.1
"""Share of the robots by which the networks are told how far to trust them."""
WEIGHTS_FILE = "interaction.safetensors"
"""File of the networks in the folder of a training."""


def recipe(steps: int = 1800, batch: int = 512, minutes: float | None = None) -> LoopSettings:
    """Returns how long, and how fast: steps of so many samples, for at most so many minutes."""
    seconds = None if minutes is None else 60.0 * minutes
    return LoopSettings(steps, batch, 3e-3, warmup=100, ema=0.995, seconds=seconds)


class Rows(NamedTuple):
    """Rows of messages of many samples, ready to be gathered."""

    features: Tensor
    """(R, m)."""
    vectors: Tensor
    """What each vector of a message adds to the wrench over the wrench scale (R, k, 6)."""
    starts: Tensor
    """First row (N + 1,) of each sample."""

    def of(self, samples: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Features and vectors of some samples (B,), and to which of these each row belongs."""
        first = self.starts[samples]
        count = self.starts[samples + 1] - self.starts[samples]
        owner = torch.repeat_interleave(torch.arange(len(samples)), count)
        before = torch.cumsum(count, 0) - count
        number = torch.arange(len(owner)) - torch.repeat_interleave(before, count)
        rows = torch.repeat_interleave(first, count) + number
        return self.features.index_select(0, rows), self.vectors.index_select(0, rows), owner


class InteractionSamples(NamedTuple):
    """Samples of many robots."""

    rows: dict[str, Rows]
    """Of `pair` and `hull`."""
    residual: Tensor
    """What the laws leave of the wrenches (N, 6), over the wrench scales."""
    size: Tensor
    """Root mean squares (N, 6) of the wrenches of their robots, over the wrench scales."""
    robot: Tensor
    """The robot (N,) of each sample."""


def data_set(samples: Sequence[Samples]) -> InteractionSamples:
    """Returns samples as they are learned from. Raises DataError: there are fewer than ten robots,
    or none with a jet."""
    parts: dict[str, list[tuple[AnyArray, AnyArray, AnyArray]]] = {name: [] for name in ROW_SIZES}
    residuals = []
    sizes = []
    robots = []
    for k, of_robot in enumerate(samples):
        force, residual, scale, _ = left_by_laws(of_robot)
        residuals.append(residual)
        size = np.sqrt((of_robot.wrench**2).mean(axis=0)) / scale
        sizes.append(np.broadcast_to(size, residual.shape))
        robots.append(np.full(len(residual), k))
        geometry = jet_geometry_of(of_robot.layout)
        for name, made in messages_of(geometry, force, scale).items():
            parts[name].append(made)
    if len(samples) < 10 or not sum(len(part[0]) for part in parts["pair"]):
        raise DataError(
            f"expected samples of at least 10 robots with jets that meet others, got {len(samples)}"
        )
    rows = {}
    for name, several in parts.items():
        features, vectors, counts = (np.concatenate(each) for each in zip(*several, strict=True))
        starts = torch.from_numpy(np.concatenate([[0], np.cumsum(counts)]))
        rows[name] = Rows(_tensor(features), _tensor(vectors), starts)
    return InteractionSamples(
        rows=rows,
        residual=_tensor(np.concatenate(residuals)),
        size=_tensor(np.concatenate(sizes)),
        robot=torch.from_numpy(np.concatenate(robots)),
    )


def messages_of(
    geometry: JetGeometry, force: Array, scale: Array
) -> dict[str, tuple[AnyArray, AnyArray, AnyArray]]:
    """Returns for `pair` and `hull` the features (R, m), the vectors as wrenches over the scale (R,
    k, 6), and how many rows each of forces (K, n, 3) [N] has (K,)."""
    messages = Messages(geometry)
    lever = lever_of(geometry.position) / scale
    levers = {"pair": lever[messages.receiver], "hull": lever[: messages.counts["hull"]]}
    result = {}
    for name, packed in messages.rows(force).items():
        features, vectors = unpack_rows(name, packed)
        wrenches = np.einsum("kpvb,pbw->kpvw", vectors, levers[name])
        counts = np.abs(wrenches).max(axis=(2, 3), initial=0.0) > MESSAGE_MIN
        result[name] = (
            features[counts].astype(np.float32),
            wrenches[counts].astype(np.float32),
            counts.sum(axis=1),
        )
    return result


def train(
    samples: Sequence[Samples],
    folder: Path,
    settings: LoopSettings,
    seed: int = 0,
    resume: bool = False,
) -> float:
    """Trains three networks, writes their file, and log and state, into a folder, and returns the
    root mean square error on robots that were held out, over the wrench scale."""
    data = data_set(samples)
    robots = torch.from_numpy(np.random.default_rng(seed).permutation(len(samples)))
    held = torch.isin(data.robot, robots[: max(1, int(HELD_OUT_SHARE * len(samples)))])
    known = torch.nonzero(~held)[:, 0]
    unknown = torch.nonzero(held)[:, 0]
    weights = {name: value.requires_grad_() for name, value in first_weights(seed).items()}
    identity = {"recipe": str(settings), "seed": seed, "samples": len(data.residual)}

    def terms_of(step: int) -> dict[str, Tensor]:
        total = torch.zeros(())
        for member in range(MEMBERS):
            generator = seeded_generator(seed, step * MEMBERS + member, torch.device("cpu"))
            batch = known[torch.randint(len(known), (settings.batch_size,), generator=generator)]
            error = predicted(weights, member, data, batch) - data.residual[batch]
            total = total + (error**2).mean()
        return {"loss": total / MEMBERS}

    def save(shipped: ArraysByName, made: dict[str, Any]) -> None:
        write_network(folder / WEIGHTS_FILE, shipped, 1.0)

    with workplace("cpu", settings.batch_size) as place:
        run = Training(weights, settings, folder, identity, place)
        if resume:
            run.resume()
        run.run(terms_of, save)
    with torch.no_grad():
        shipped = {name: torch.from_numpy(np.asarray(value)) for name, value in run.shipped.items()}
        each = torch.stack([predicted(shipped, member, data, unknown) for member in range(MEMBERS)])
    error = (each.mean(dim=0) - data.residual[unknown]).double().numpy()
    trust, _ = parts_of_error(
        error, each.std(dim=0).double().numpy(), data.size[unknown].double().numpy()
    )
    write_network(folder / WEIGHTS_FILE, run.shipped, trust)
    return float(np.sqrt((error**2).sum(axis=1).mean()))


def predicted(
    weights: dict[str, Any], member: int, data: InteractionSamples, samples: Tensor
) -> Tensor:
    """What one network says that the laws leave of the wrenches of some samples (B, 6)."""
    result = torch.zeros((len(samples), 6))
    for name in ROW_SIZES:
        features, vectors, owner = data.rows[name].of(samples)
        messages = shares(weights, member, name, features)
        wrenches = torch.bmm(messages[:, None], vectors)[:, 0]
        result = result.index_add(0, owner, wrenches)
    return result


def shares(weights: dict[str, Any], member: int, name: str, features: Tensor) -> Tensor:
    """What one perceptron gives for rows (R, m): the share (R, k) of each vector of a message.

    Its activation tanh z is taken as 2 s(2 z) - 1 with the logistic function s, which torch
    computes six times as quickly. The factors 2 and the shift -1 go into the weights: a hidden
    layer is s(2 W x + 2 b), the next one 2 W s + b - W 1.
    """
    values = features
    for layer in range(LAYERS):
        weight = weights[f"{name}.{layer}.weight"][member]
        bias = weights[f"{name}.{layer}.bias"][member]
        if layer > 0:
            bias = bias - weight.sum(dim=0)
            weight = 2.0 * weight
        if layer + 1 < LAYERS:
            values = torch.addmm(2.0 * bias, values, 2.0 * weight).sigmoid()
        else:
            values = torch.addmm(bias, values, weight)
    return values


def first_weights(seed: int) -> dict[str, Tensor]:
    """Weights to begin with."""
    draw = seeded_generator(seed, 1 << 40, torch.device("cpu"))
    weights = {}
    for name, form in ROW_SIZES.items():
        sizes = (form.features, *(WIDTH,) * (LAYERS - 1), form.vectors)
        for layer, (into, out) in enumerate(zip(sizes[:-1], sizes[1:], strict=True)):
            scale = (0.1 if layer + 1 == LAYERS else 1.0) / into**0.5
            weights[f"{name}.{layer}.weight"] = scale * torch.randn(
                (MEMBERS, into, out), generator=draw
            )
            weights[f"{name}.{layer}.bias"] = torch.zeros((MEMBERS, 1, out))
    return weights


def write_network(path: Path, weights: ArraysByName, trust: float) -> None:
    """Writes the file of a learned interaction; a `DataError` where it cannot be written."""
    from safetensors.numpy import save

    arrays = {name: np.ascontiguousarray(value, np.float32) for name, value in weights.items()}
    write_whole(path, save({**arrays, "trust": np.array([trust], np.float32)}), DataError)


def _tensor(values: AnyArray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, np.float32))
