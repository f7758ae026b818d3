"""The plain training loop that all networks share: Adam on the weights of a function."""

import csv
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
from finlab.training.saving import Tensors, arrays_of, load_state, make_folder, save_state
from finlab.whole_file import write_whole

LOG_FILE = "log.csv"
"""One row per logged step: the columns below and every loss term."""
_FIXED = ("step", "samples", "seconds", "learning_rate")

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
    """Time after which the run ends whatever step it has come to, all its parts together."""


CLIP = 1.0
LOG_EVERY = 20
SAVE_EVERY_S = 60.0


def learning_rate(settings: LoopSettings, step: int, elapsed: float = 0.0) -> float:
    """Learning rate of a step, a function of the step alone so that a resumed run goes on exactly; of the
    seconds gone by where the run's time is limited."""
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
    identity: dict[str, Any],
    *,
    stop_after: int | None = None,
    on_save: Callable[[State, dict[str, Any]], None] | None = None,
) -> State:
    """Minimize the term `loss` of `terms_of_step(weights, step)`; go on from the state in `folder`, if any.

    Args:
        weights: what is trained, already on its device; changed in place.
        terms_of_step: see `Terms`.
        settings: see `LoopSettings`.
        folder: where log and state are written.
        identity: settings that a resumed run must share.
        stop_after: stop (resumable) once this many steps are done in all.
        on_save: called at each save with the shipped weights, and with `identity` and how far the run is.

    Returns:
        The weights to ship: the running average, or the last ones where none is kept.

    Raises:
        DataError: a file cannot be written, or the folder holds a run with other settings.
    """
    make_folder(folder)
    fused = next(iter(weights.values())).is_cuda  # one kernel for all weights, where there is such a kernel
    optimizer = torch.optim.Adam(weights.values(), lr=settings.learning_rate, fused=fused)
    average = {k: v.detach().clone() for k, v in weights.items()} if settings.ema else {}
    done, before = load_state(folder, weights, optimizer, average, identity)
    log = _Log(folder / LOG_FILE, done)
    limit = math.inf if settings.seconds is None else settings.seconds
    end = min(settings.steps, stop_after or settings.steps)
    shipped = average or weights
    bar = tqdm(
        total=settings.steps, initial=done, disable=not sys.stderr.isatty(), unit="step", smoothing=0.05
    )
    started = saved = time.monotonic()
    for step in range(done, end):
        elapsed = before + time.monotonic() - started
        last = step == end - 1 or elapsed >= limit
        for group in optimizer.param_groups:
            group["lr"] = rate = learning_rate(settings, step, elapsed)
        optimizer.zero_grad(set_to_none=True)
        terms = terms_of_step(weights, step)
        terms["loss"].backward()
        nn.utils.clip_grad_norm_(weights.values(), CLIP)
        optimizer.step()
        _follow(average, weights, settings.ema, step)
        bar.update()
        if step % LOG_EVERY == 0 or last:
            values = {name: float(value.detach()) for name, value in terms.items()}
            seconds, samples = time.monotonic() - started, (step + 1) * settings.batch_size
            log.write(step, samples, before + seconds, rate, values)
            speed = (step + 1 - done) * settings.batch_size / seconds
            bar.set_postfix_str(f"loss {values['loss']:.4g}, {speed / 1e3:.1f} k samples/s")
        if time.monotonic() - saved > SAVE_EVERY_S or last:
            # The state comes last: a run killed in between repeats a few steps and ships them after all.
            if on_save is not None:
                progress = {"steps_done": step + 1, "samples": (step + 1) * settings.batch_size}
                on_save(arrays_of(shipped), identity | progress)
            saved = time.monotonic()
            save_state(folder, (step + 1, before + saved - started), weights, optimizer, average, identity)
        if last:
            break
    bar.close()
    return arrays_of(shipped)


def _follow(average: Tensors, weights: Tensors, decay: float, step: int) -> None:
    """Move the running average; it starts short and grows, so that early weights are soon forgotten."""
    decay = min(decay, (1 + step) / (10 + step))
    with torch.no_grad():
        for name, value in average.items():
            value.lerp_(weights[name], 1 - decay)


class _Log:
    """The CSV log; a resumed run drops the rows after its saved state and goes on."""

    def __init__(self, path: Path, done: int) -> None:
        self.path = path
        lines = path.read_text().splitlines(keepends=True) if done and path.exists() else []
        kept = [line for line in lines[1:] if int(line.split(",")[0]) < done]
        write_whole(path, "".join(lines[:1] + kept), DataError)

    def write(self, step: int, samples: int, seconds: float, rate: float, values: dict[str, float]) -> None:
        """Add a row."""
        fixed = (step, samples, f"{seconds:.1f}", f"{rate:.6g}")
        row = dict(zip(_FIXED, fixed, strict=True)) | {name: f"{x:.8g}" for name, x in values.items()}
        try:
            with self.path.open("a", newline="") as file:
                writer = csv.DictWriter(file, list(row), lineterminator="\n")
                if file.tell() == 0:
                    writer.writeheader()
                writer.writerow(row)
        except OSError as error:
            raise DataError(f"{self.path}: cannot be written: {error.strerror}") from None
