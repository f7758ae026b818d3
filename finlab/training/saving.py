"""What runs leave on disk: the state to go on from, and checkpoints."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from finlab.errors import DataError
from finlab.inference.checkpoint import checkpoint_files, read_checkpoint
from finlab.inference.weights import State, SurrogateConfig, TrainedWeights
from finlab.training.networks.surrogate import Surrogate

STATE_FILE = "resume.pt"
"""Steps and seconds done, the run's settings, weights, optimizer and running average of the weights."""


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
    state = {"done": done, "settings": settings, "average": average}
    state |= {"model": model.state_dict(), "optimizer": optimizer.state_dict()}
    temporary = folder / (STATE_FILE + ".new")
    torch.save(state, temporary)
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
    if not (folder / STATE_FILE).exists():
        return 0, 0.0
    # Plain values and tensors only: reading never runs code.
    state = torch.load(folder / STATE_FILE, map_location="cpu", weights_only=True)
    changed = [key for key in settings if state["settings"].get(key) != settings[key]]
    if changed:
        raise DataError(
            f"{folder}: holds a run with other settings ({', '.join(changed)}); "
            "resume with the same ones, or train into an empty folder"
        )
    model.load_state_dict(state["model"])
    optimizer.load_state_dict(state["optimizer"])
    for name, value in average.items():
        value.copy_(state["average"][name])
    steps, seconds = state["done"]
    return steps, seconds


def surrogate_of(weights: TrainedWeights) -> Surrogate:
    """The surrogate as a module, frozen."""
    surrogate = Surrogate(weights.surrogate_config or SurrogateConfig())
    surrogate.load_state_dict({key: torch.tensor(value) for key, value in weights.surrogate.items()})
    return surrogate.eval().requires_grad_(False)


def load_network(model: nn.Module, weights: TrainedWeights) -> None:
    """Put trained weights into a network; a `DataError` where their sizes differ."""
    state = {key: torch.tensor(value) for key, value in weights.network.items()}
    sizes = {key: value.shape for key, value in model.state_dict().items()}
    if sizes != {key: value.shape for key, value in state.items()}:
        raise DataError(
            f"checkpoint {weights.name!r}: its network has other sizes; start from one of the same sizes"
        )
    model.load_state_dict(state)


def state_of(tensors: Mapping[str, Tensor]) -> State:
    """The state of a module, or what was trained of it, as arrays."""
    return {key: value.detach().cpu().numpy() for key, value in tensors.items()}


def save_checkpoint(folder: Path, weights: TrainedWeights) -> TrainedWeights:
    """Write a checkpoint folder, and answer what is in it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in checkpoint_files(weights).items():
        (folder / name).write_bytes(content)
    return read_checkpoint(folder)
