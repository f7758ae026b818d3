"""The plain training loop that all networks share: Adam on the weights of a function."""

import csv
import io
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn
from tqdm import tqdm

from finlab.errors import DataError
from finlab.networks.trained import State
from finlab.whole_file import write_whole

LOG_FILE = "log.csv"
"""One row per logged step: step, samples, seconds, learning rate and every loss term."""

Tensors = dict[str, Tensor]
Terms = Callable[[Tensors, int], dict[str, Tensor]]
"""Loss terms of a step of training with some weights, `loss` among them, as means over the batch."""


@dataclass(frozen=True)
class LoopSettings:
    """What every training has to say, whatever it learns."""

    steps: int
    batch_size: int
    learning_rate: float
    warmup: int = 0
    """Steps over which it rises linearly, if there are as many."""
    ema: float = 0.0
    """Decay of the running average of the weights that is shipped; 0 ships the last weights."""
    seconds: float | None = None
    """Time after which the run ends whatever step it has come to."""


CLIP = 1.0
LOG_EVERY = 20
SAVE_EVERY_S = 60.0


def learning_rate(settings: LoopSettings, step: int, elapsed: float = 0.0) -> float:
    """Learning rate of a step, and of the seconds gone by where the run's time is limited."""
    rise = min(1.0, (step + 1) / max(min(settings.warmup, settings.steps), 1))
    done = step / max(settings.steps, 1)
    if settings.seconds is not None:
        done = min(1.0, max(done, elapsed / settings.seconds))
    fall = 0.5 * (1 + math.cos(math.pi * done))
    return settings.learning_rate * rise * (0.01 + 0.99 * fall)


def train(
    weights: Tensors,
    terms_of_step: Terms,
    settings: LoopSettings,
    folder: Path,
    on_save: Callable[[State, dict[str, Any]], None],
) -> None:
    """Minimize the term `loss` of `terms_of_step(weights, step)`.

    Args:
        weights: what is trained, already on its device; changed in place.
        terms_of_step: see `Terms`.
        settings: see `LoopSettings`.
        folder: where the log is written.
        on_save: called once a minute and at the end with the weights to ship, the running average or the last
            ones where none is kept, and with how far the run is.

    Raises:
        DataError: a file cannot be written.
    """
    fused = next(iter(weights.values())).is_cuda  # one kernel for all weights, where there is such a kernel
    optimizer = torch.optim.Adam(weights.values(), lr=settings.learning_rate, fused=fused)
    average = {k: v.detach().clone() for k, v in weights.items()} if settings.ema else {}
    shipped, rows = average or weights, list[dict[str, Any]]()
    limit = math.inf if settings.seconds is None else settings.seconds
    bar = tqdm(total=settings.steps, disable=not sys.stderr.isatty(), unit="step", smoothing=0.05)
    started = saved = time.monotonic()
    for step in range(settings.steps):
        elapsed = time.monotonic() - started
        last = step == settings.steps - 1 or elapsed >= limit
        for group in optimizer.param_groups:
            group["lr"] = rate = learning_rate(settings, step, elapsed)
        optimizer.zero_grad(set_to_none=True)
        terms = terms_of_step(weights, step)
        terms["loss"].backward()
        nn.utils.clip_grad_norm_(weights.values(), CLIP)
        optimizer.step()
        _follow(average, weights, settings.ema, step)
        bar.update()
        samples = (step + 1) * settings.batch_size
        if step % LOG_EVERY == 0 or last:
            values = {name: float(value.detach()) for name, value in terms.items()}
            rows.append(
                {"step": step, "samples": samples, "seconds": elapsed, "learning_rate": rate} | values
            )
            bar.set_postfix_str(f"loss {values['loss']:.4g}")
        if time.monotonic() - saved > SAVE_EVERY_S or last:
            saved = time.monotonic()
            _write_log(folder / LOG_FILE, rows)
            arrays = {name: value.detach().cpu().numpy() for name, value in shipped.items()}
            on_save(arrays, {"steps_done": step + 1, "samples": samples})
        if last:
            break
    bar.close()


def _follow(average: Tensors, weights: Tensors, decay: float, step: int) -> None:
    """Move the running average; it starts short and grows, so that early weights are soon forgotten."""
    decay = min(decay, (1 + step) / (10 + step))
    with torch.no_grad():
        for name, value in average.items():
            value.lerp_(weights[name], 1 - decay)


def _write_log(path: Path, rows: list[dict[str, Any]]) -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: f"{value:.8g}" for name, value in row.items()} for row in rows)
    write_whole(path, text.getvalue(), DataError)
