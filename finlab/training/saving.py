"""What runs leave on disk: the state to go on from, as plain tensors, and checkpoints."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import torch
from safetensors import safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from finlab.errors import DataError
from finlab.inference.checkpoint import checkpoint_files, read_checkpoint
from finlab.inference.weights import NetworkConfig, State, SurrogateConfig, TrainedWeights
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.networks.surrogate import Surrogate

STATE_FILE = "resume.safetensors"
"""Weights, optimizer moments, running average of the weights and step; in its header, the run's settings."""


def save_state(
    folder: Path,
    done: tuple[int, float],
    model: nn.Module,
    optimizer: torch.optim.Adam,
    average: dict[str, Tensor],
    settings: dict[str, Any],
) -> None:
    """Write the state after so many steps and seconds; a kill at any moment leaves the old or the new one
    whole."""
    tensors = {"done": torch.tensor(done, dtype=torch.float64)}
    tensors |= {f"average.{name}": value for name, value in average.items()}
    for name, parameter in model.named_parameters():
        tensors[f"weight.{name}"] = parameter.detach()
        moments = optimizer.state.get(parameter, {})
        tensors |= {f"optimizer.{key}.{name}": value for key, value in moments.items()}
    temporary = folder / (STATE_FILE + ".new")
    copies = {name: value.contiguous().clone() for name, value in tensors.items()}
    save_file(copies, temporary, {"settings": json.dumps(settings)})
    os.replace(temporary, folder / STATE_FILE)


def load_state(
    folder: Path,
    model: nn.Module,
    optimizer: torch.optim.Adam,
    average: dict[str, Tensor],
    settings: dict[str, Any],
) -> tuple[int, float]:
    """Restore a run into `model`, `optimizer` and `average`; returns the steps already done and their
    seconds.

    Raises:
        DataError: the state was written with other settings.
    """
    path = folder / STATE_FILE
    if not path.exists():
        return 0, 0.0
    with safe_open(path, "pt") as file:
        saved = json.loads((file.metadata() or {}).get("settings", "{}"))
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (not a mapping)
    changed = [k for k in settings if saved.get(k) != json.loads(json.dumps(settings[k]))]
    if changed:
        raise DataError(
            f"{folder}: holds a run with other settings ({', '.join(changed)}); "
            "resume with the same ones, or train into an empty folder"
        )
    with torch.no_grad():
        for name, parameter in model.named_parameters():
            parameter.copy_(tensors[f"weight.{name}"])
            moments = {k: tensors.get(f"optimizer.{k}.{name}") for k in ("step", "exp_avg", "exp_avg_sq")}
            if all(value is not None for value in moments.values()):
                optimizer.state[parameter] = moments
        for name in average:
            average[name].copy_(tensors[f"average.{name}"])
    steps, seconds = tensors["done"].tolist()
    return int(steps), seconds


Module = TypeVar("Module", bound=nn.Module)


def surrogate_of(weights: TrainedWeights) -> Surrogate:
    """The surrogate as a module, frozen."""
    return _filled(Surrogate(weights.surrogate_config or SurrogateConfig()), weights.surrogate)


def network_of(weights: TrainedWeights) -> AllocatorNetwork:
    """The paper's network as a module, frozen.

    Raises:
        CheckpointError: the checkpoint holds another, or none.
    """
    return _filled(AllocatorNetwork(weights.check_network(NetworkConfig)), weights.network)


def state_of(tensors: Mapping[str, Tensor]) -> State:
    """The state of a module, or what was trained of it, as arrays."""
    return {key: value.detach().cpu().numpy() for key, value in tensors.items()}


def save_checkpoint(folder: Path, weights: TrainedWeights) -> TrainedWeights:
    """Write a checkpoint folder, and answer what is in it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in checkpoint_files(weights).items():
        (folder / name).write_bytes(content)
    return read_checkpoint(folder)


def _filled(module: Module, state: State) -> Module:
    module.load_state_dict({key: torch.tensor(value) for key, value in state.items()}, strict=True)
    return module.eval().requires_grad_(False)
