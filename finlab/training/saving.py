"""What runs leave on disk: the state to go on from, and checkpoints."""

import io
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from finlab.errors import DataError
from finlab.networks.checkpoint import checkpoint_files, read_checkpoint
from finlab.networks.trained import State, TrainedWeights
from finlab.whole_file import write_whole

STATE_FILE = "resume.pt"
"""Steps and seconds done, the run's settings, weights, optimizer and running average of the weights."""

Tensors = dict[str, Tensor]


def save_state(
    folder: Path,
    done: tuple[int, float],
    weights: Tensors,
    optimizer: torch.optim.Adam,
    average: Tensors,
    settings: dict[str, Any],
) -> None:
    """Write the state after so many steps and seconds; a kill at any moment leaves the old or the new one
    whole."""
    state = {"done": done, "settings": settings, "average": average}
    state |= {"weights": weights, "optimizer": optimizer.state_dict()}
    content = io.BytesIO()
    torch.save(state, content)
    write_whole(folder / STATE_FILE, content.getvalue(), DataError)


def load_state(
    folder: Path,
    weights: Tensors,
    optimizer: torch.optim.Adam,
    average: Tensors,
    settings: dict[str, Any],
) -> tuple[int, float]:
    """Restore a run into `weights`, `optimizer` and `average`; returns the steps already done and their
    seconds.

    Raises:
        DataError: the state was written with other settings, or cannot be read.
    """
    path = folder / STATE_FILE
    if not path.exists():
        return 0, 0.0
    try:
        # Plain values and tensors only: reading never runs code.
        state = torch.load(path, map_location="cpu", weights_only=True)
        changed = [key for key in settings if state["settings"].get(key) != settings[key]]
        if not changed:
            optimizer.load_state_dict(state["optimizer"])
            with torch.no_grad():
                for ours, read in ((weights, state["weights"]), (average, state["average"])):
                    for name, value in ours.items():
                        value.copy_(read[name])
        steps, seconds = state["done"]
    except Exception as error:  # whatever torch's reader meets in a damaged file
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise DataError(
            f"{path}: holds no state that this finlab can go on from ({reason}); train into an empty folder"
        ) from error
    if changed:
        raise DataError(
            f"{folder}: holds a run with other settings ({', '.join(changed)}); "
            "resume with the same ones, or train into an empty folder"
        )
    return steps, seconds


def tensors_of(state: State) -> Tensors:
    """Trained weights as tensors."""
    return {name: torch.tensor(value) for name, value in state.items()}


def arrays_of(weights: Tensors) -> State:
    """Weights as arrays."""
    return {name: value.detach().cpu().numpy() for name, value in weights.items()}


def save_checkpoint(folder: Path, weights: TrainedWeights) -> TrainedWeights:
    """Write a checkpoint folder, and answer what is in it; a `DataError` where it cannot be written."""
    make_folder(folder)
    for name, content in checkpoint_files(weights).items():
        write_whole(folder / name, content, DataError)
    return read_checkpoint(folder)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it; a `DataError` where that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"{folder}: cannot be made: {error.strerror}") from None
