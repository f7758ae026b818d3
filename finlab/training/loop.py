"""The plain training loop shared by surrogate and allocator."""

import csv
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import torch.distributed as dist
from torch import Tensor, nn
from tqdm import tqdm

from finlab.errors import DataError
from finlab.inference.weights import State
from finlab.training.saving import load_state, save_state, state_of
from finlab.whole_file import write_whole

LOG_FILE = "log.csv"
"""One row per logged step: the columns below and every loss term."""
_FIXED = ("step", "samples", "seconds", "learning_rate")

Terms = Callable[[nn.Module, int], dict[str, Tensor]]
"""Loss terms of a step of training, `loss` among them, as means over this process's share of the batch."""


@dataclass(frozen=True)
class LoopSettings:
    """What every training has to say, whatever it learns."""

    steps: int
    """Optimizer steps in all."""
    batch_size: int
    """Samples per step, over all processes."""
    learning_rate: float
    """Peak learning rate of Adam."""
    warmup: int = 0
    """Steps over which it rises linearly, if there are as many."""
    cosine: bool = True
    """Whether it falls to a hundredth along a cosine (True) or stays (the paper prints one rate)."""
    ema: float = 0.0
    """Decay of the running average of the weights that is shipped; 0 ships the last weights."""
    seconds: float | None = None
    """Time after which the run ends whatever step it has come to, all its parts together."""


CLIP = 1.0
"""Largest norm of the gradient."""
LOG_EVERY = 20
"""Steps between rows of the log."""
SAVE_EVERY_S = 60.0
"""Seconds between saved states."""


def learning_rate(settings: LoopSettings, step: int, elapsed: float = 0.0) -> float:
    """Learning rate of a step, a function of the step alone so that a resumed run goes on exactly; of the
    seconds gone by where the run's time is limited."""
    rise = min(1.0, (step + 1) / max(min(settings.warmup, settings.steps), 1))
    if not settings.cosine:
        return settings.learning_rate * rise
    done = step / max(settings.steps, 1)
    if settings.seconds is not None:
        done = min(1.0, max(done, elapsed / settings.seconds))
    fall = 0.5 * (1 + math.cos(math.pi * done))
    return settings.learning_rate * rise * (0.01 + 0.99 * fall)


def train(
    model: nn.Module,
    terms_of_step: Terms,
    settings: LoopSettings,
    folder: Path,
    identity: dict[str, Any],
    *,
    stop_after: int | None = None,
    on_save: Callable[[State, dict[str, Any]], None] | None = None,
) -> dict[str, Tensor]:
    """Minimize the term `loss` of `terms_of_step(model, step)`; resume from `folder` where it holds a state.

    Args:
        model: what is trained, already on its device.
        terms_of_step: see `Terms`.
        settings: see `LoopSettings`.
        folder: where log and state are written (by the first process only).
        identity: settings that a resumed run must share.
        stop_after: stop (resumable) once this many steps are done in all.
        on_save: called at each save with the shipped weights, and with `identity` and how far the run is.

    Returns:
        The weights to ship: the running average, or the last ones where none is kept.
    """
    folder.mkdir(parents=True, exist_ok=True)
    first = not dist.is_initialized() or dist.get_rank() == 0
    fused = next(model.parameters()).is_cuda  # one kernel for all parameters, where there is such a kernel
    optimizer = torch.optim.Adam(model.parameters(), lr=settings.learning_rate, fused=fused)
    average = {k: v.detach().clone() for k, v in model.named_parameters()} if settings.ema else {}
    done, before = load_state(folder, model, optimizer, average, identity)
    _share_weights(model)
    log = _Log(folder / LOG_FILE, done) if first else None
    limit = math.inf if settings.seconds is None else settings.seconds
    end = min(settings.steps, stop_after or settings.steps)
    bar = tqdm(
        total=settings.steps,
        initial=done,
        disable=not (first and sys.stderr.isatty()),
        unit="step",
        smoothing=0.05,
    )
    started = saved = time.monotonic()
    for step in range(done, end):
        elapsed = before + time.monotonic() - started
        last = step == end - 1 or elapsed >= limit
        rate = learning_rate(settings, step, elapsed)
        for group in optimizer.param_groups:
            group["lr"] = rate
        optimizer.zero_grad(set_to_none=True)
        terms = terms_of_step(model, step)
        terms["loss"].backward()
        _share_gradients(model)
        nn.utils.clip_grad_norm_(model.parameters(), CLIP)
        optimizer.step()
        if average:
            # The average starts short and grows, so that early weights are soon forgotten.
            decay = min(settings.ema, (1 + step) / (10 + step))
            with torch.no_grad():
                for name, parameter in model.named_parameters():
                    average[name].lerp_(parameter, 1 - decay)
        bar.update()
        if step % LOG_EVERY == 0 or last:
            values = _mean_over_processes(terms)
            if log is not None:
                seconds, samples = time.monotonic() - started, (step + 1) * settings.batch_size
                speed = (step + 1 - done) * settings.batch_size / seconds
                log.write(step, samples, before + seconds, rate, values)
                bar.set_postfix_str(f"loss {values['loss']:.4g}, {speed / 1e3:.1f} k samples/s")
        if first and (time.monotonic() - saved > SAVE_EVERY_S or last):
            # The state comes last: a run killed in between repeats a few steps and ships them after all.
            if on_save is not None:
                progress = {"steps_done": step + 1, "samples": (step + 1) * settings.batch_size}
                on_save(state_of(average or _weights(model)), identity | progress)
            plot_log(folder)
            saved = time.monotonic()
            save_state(folder, (step + 1, before + saved - started), model, optimizer, average, identity)
        if last:
            break
    bar.close()
    return average or _weights(model)


def _weights(model: nn.Module) -> dict[str, Tensor]:
    return {k: v.detach().clone() for k, v in model.named_parameters()}


# PyTorch's DistributedDataParallel would do these two, but it keeps the threads of the group alive beyond its
# end, and those abort the process now and then when the interpreter leaves.


def _share_weights(model: nn.Module) -> None:
    """Those of the first process, for all."""
    if dist.is_initialized():
        for values in (*model.parameters(), *model.buffers()):
            dist.broadcast(values.data, 0)


def _share_gradients(model: nn.Module) -> None:
    """Their mean over all processes, in one message."""
    if dist.is_initialized():
        gradients = [values.grad for values in model.parameters() if values.grad is not None]
        flat = nn.utils.parameters_to_vector(gradients)
        dist.all_reduce(flat)
        nn.utils.vector_to_parameters(flat / dist.get_world_size(), gradients)


def _mean_over_processes(terms: dict[str, Tensor]) -> dict[str, float]:
    stacked = torch.stack([value.detach().float() for value in terms.values()])
    if dist.is_initialized():
        dist.all_reduce(stacked)
        stacked /= dist.get_world_size()
    return dict(zip(terms, stacked.tolist(), strict=True))


class _Log:
    """The CSV log; a resumed run drops the rows after its saved state and goes on."""

    def __init__(self, path: Path, done: int) -> None:
        self.path = path
        lines = path.read_text().splitlines(keepends=True) if done and path.exists() else []
        kept = [line for line in lines[1:] if int(line.split(",")[0]) < done]
        write_whole(path, "".join(lines[:1] + kept), DataError)

    def write(self, step: int, samples: int, seconds: float, rate: float, values: dict[str, float]) -> None:
        fixed = (step, samples, f"{seconds:.1f}", f"{rate:.6g}")
        row = dict(zip(_FIXED, fixed, strict=True)) | {name: f"{x:.8g}" for name, x in values.items()}
        with self.path.open("a", newline="") as file:
            writer = csv.DictWriter(file, list(row), lineterminator="\n")
            if file.tell() == 0:
                writer.writeheader()
            writer.writerow(row)


CURVES_FILE = "curves.png"
"""Name of the picture beside the log."""


def plot_log(folder: Path) -> Path | None:
    """Draw every loss term of `folder/log.csv` against samples seen; None without matplotlib."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return None
    with (folder / LOG_FILE).open(newline="") as file:
        rows = list(csv.DictReader(file))
    terms = [name for name in rows[0] if name not in _FIXED]
    samples = np.array([float(row["samples"]) for row in rows]) / 1e6
    figure = Figure(figsize=(3.4 * len(terms), 2.8), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    for axis, name in zip(np.atleast_1d(figure.subplots(1, len(terms))), terms, strict=True):
        values = np.array([float(row[name]) for row in rows])
        window = max(1, len(values) // 100)
        smooth = np.convolve(values, np.ones(window) / window, mode="valid")
        axis.plot(samples, values, color="#56B4E9", linewidth=0.5, alpha=0.5)
        axis.plot(samples[window - 1 :], smooth, color="#0072B2", linewidth=1.5)
        axis.set(title=name.replace("_", " "), xlabel="samples seen [million]")
        axis.grid(alpha=0.3)
        if (values > 0).all():
            axis.set_yscale("log")
    path = folder / CURVES_FILE
    figure.savefig(path)
    return path
