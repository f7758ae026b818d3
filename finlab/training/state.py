"""Everything a training run needs to go on after it was stopped, as plain tensors and JSON."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from finlab.errors import DataError

STATE_FILE = "resume.safetensors"
"""Weights, optimizer moments and running average of the weights."""
PROGRESS_FILE = "resume.json"
"""Step and settings they belong to."""


def save_state(
    folder: Path,
    step: int,
    model: nn.Module,
    optimizer: torch.optim.Adam,
    average: dict[str, Tensor],
    settings: dict[str, Any],
) -> None:
    """Write the state after `step` steps; a kill at any moment leaves the old or the new one whole."""
    tensors: dict[str, Tensor] = {}
    for name, parameter in model.named_parameters():
        tensors[f"weight.{name}"] = parameter.detach()
        for key, value in optimizer.state.get(parameter, {}).items():
            tensors[f"optimizer.{key}.{name}"] = value
    for name, value in average.items():
        tensors[f"average.{name}"] = value
    tensors["step"] = torch.tensor(step)
    temporary = folder / (STATE_FILE + ".new")
    save_file({k: v.contiguous().clone() for k, v in tensors.items()}, temporary)
    write_json(folder / PROGRESS_FILE, settings)
    os.replace(temporary, folder / STATE_FILE)


def load_state(
    folder: Path,
    model: nn.Module,
    optimizer: torch.optim.Adam,
    average: dict[str, Tensor],
    settings: dict[str, Any],
) -> int:
    """Restore a run into `model`, `optimizer` and `average`; returns the number of steps already done.

    Raises:
        DataError: the state was written with other settings.
    """
    path = folder / STATE_FILE
    if not path.exists():
        return 0
    saved = json.loads((folder / PROGRESS_FILE).read_text())
    changed = [k for k in settings if saved.get(k) != json.loads(json.dumps(settings[k]))]
    if changed:
        raise DataError(
            f"{folder}: holds a run with other settings ({', '.join(changed)}); "
            "resume with the same ones, or train into an empty folder"
        )
    tensors = load_file(path)
    with torch.no_grad():
        for name, parameter in model.named_parameters():
            parameter.copy_(tensors[f"weight.{name}"])
            moments = {k: tensors.get(f"optimizer.{k}.{name}") for k in ("step", "exp_avg", "exp_avg_sq")}
            if all(value is not None for value in moments.values()):
                optimizer.state[parameter] = moments
        for name in average:
            average[name].copy_(tensors[f"average.{name}"])
    return int(tensors["step"])


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write JSON in one piece."""
    temporary = path.with_suffix(path.suffix + ".new")
    temporary.write_text(json.dumps(content, indent=2, sort_keys=True) + "\n")
    os.replace(temporary, path)
