"""The loop of every training: Adam or SOAP, a rate that may fall, a log, and a state from which a
run goes on.

All that a step depends on is a function of its number: the batch, the noise, the rate. So a run
that was killed and goes on from its last state ends with the weights of one that was not.
"""

from __future__ import annotations

import csv
import io
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from finlab.display.figures import figure_bytes, panels
from finlab.errors import DataError
from finlab.research.networks.trained import ArraysByName, Shapes
from finlab.research.training.device import Workplace
from finlab.research.training.soap import Soap
from finlab.whole_file import make_folder, remove_temporary_files, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOG_FILE = "log.csv"
"""One row per logged step: step, samples, seconds, learning rate and every loss term."""
STATE_FILE = "resume.pt"
"""What a run goes on from."""
CURVES_FILE = "curves.png"
"""A picture of the log."""
NO_CURVES = ("step", "samples", "seconds")
"""Columns of the log that are no curves."""
LOG_EVERY = 20
"""Steps after which a row is logged."""
SAVE_EVERY_S = 60.0
"""Time after which state, log and checkpoint are written [s]."""
GRADIENT_MAX = 1.0
"""Norm to which a longer gradient is clipped."""

Terms = Callable[[int], dict[str, Tensor]]
"""Loss terms of a step of training, `loss` among them, as means over the batch."""
Weights = dict[str, Tensor]


@dataclass(frozen=True)
class LoopSettings:
    """What every training has to say, whatever it learns."""

    steps: int
    batch_size: int
    learning_rate: float
    warmup: int = 0
    """Steps over which it rises linearly, if there are as many."""
    cosine: bool = True
    """Whether it falls to a hundredth along a cosine, or stays."""
    ema: float = 0.0
    """Decay of the running average of the weights that is shipped; 0 ships the last weights."""
    optimizer: Literal["adam", "soap"] = "adam"
    """What takes the steps: Adam, or Adam in the eigenbasis of `soap.py`."""
    seconds: float | None = None
    """Time after which the run ends whatever step it has come to, and by which the rate falls if
    that is sooner."""


def learning_rate(settings: LoopSettings, step: int, share: float = 0.0) -> float:
    """Learning rate of a step, after a share of the time that the run may take: it rises, then
    falls."""
    rise = min(1.0, (step + 1) / max(min(settings.warmup, settings.steps), 1))
    done = min(1.0, max(step / settings.steps, share)) if settings.cosine else 0.0
    return settings.learning_rate * rise * (0.01 + 0.99 * 0.5 * (1.0 + math.cos(math.pi * done)))


def seeded_generator(seed: int, stream: int, device: torch.device) -> torch.Generator:
    """A generator whose numbers depend on seed and stream alone, unrelated between streams."""
    state = np.random.SeedSequence([seed, stream]).generate_state(1, np.uint64)[0]
    return torch.Generator(device=device).manual_seed(int(state >> np.uint64(1)))


ZERO = ("in_proj_bias", "out_proj.bias")
"""Ends of the names of arrays that start at zero, as in PyTorch's attention."""


def first_weights(shapes: Shapes, seed: int, device: torch.device | None = None) -> Weights:
    """Weights by name, by default on the processor, drawn as PyTorch draws those of its own layers
    (Glorot and Bengio, 2010, for attention, uniform over one over the root of the inputs for linear
    layers); they depend on the seed alone."""
    generator = torch.Generator().manual_seed(seed)
    drawn = {name: _drawn(name, shape, shapes, generator) for name, shape in shapes.items()}
    return {name: values.to(device).requires_grad_() for name, values in drawn.items()}


def _drawn(name: str, shape: tuple[int, ...], shapes: Shapes, generator: torch.Generator) -> Tensor:
    layer, _, part = name.rpartition(".")
    weight = shapes.get(f"{layer}.weight", ())
    if len(weight) == 1:  # a normalization
        return torch.ones(shape) if part == "weight" else torch.zeros(shape)
    if name.endswith(ZERO) or (part == "bias" and not weight):
        return torch.zeros(shape)
    if part in ("attention", "in_proj_weight"):
        bound = math.sqrt(6.0 / sum(shape))
    else:
        bound = 1.0 / math.sqrt(weight[1])
    return (2.0 * torch.rand(shape, generator=generator) - 1.0) * bound


def joined(weights: Weights) -> Tensor:
    """Returns one vector (P,) with all weights in their order, which from now on are views of it:
    what changes the vector changes them, in one operation instead of one for each."""
    vector = torch.cat([weight.detach().reshape(-1) for weight in weights.values()])
    sizes = [weight.numel() for weight in weights.values()]
    for weight, part in zip(weights.values(), vector.split(sizes), strict=True):
        weight.data = part.view_as(weight)
    return vector


class Training:
    """A run: its weights, their running average, its optimizer and its log."""

    def __init__(
        self,
        weights: Weights,
        settings: LoopSettings,
        folder: Path,
        identity: dict[str, Any],
        place: Workplace,
    ) -> None:
        """Takes weights by name, which are moved into one vector and changed in place; a folder,
        made if need be, for log, curves and state; and the settings that a resumed run must share,
        as plain values."""
        self.weights = weights
        self.settings = settings
        self.place = place
        self.folder = make_folder(folder)
        self.identity = identity
        self.vector = joined(weights)
        self.average = self.vector.clone() if settings.ema else None
        self.optimizer = self._first_optimizer()
        self.done, self.seconds = 0, 0.0
        """Steps, and the time that they took, with all that went before them."""
        self.rows = list[dict[str, float]]()
        if place.rank == 0:
            remove_temporary_files(folder)

    def _first_optimizer(self) -> torch.optim.Optimizer:
        """The optimizer of the settings, before its first step."""
        rate = self.settings.learning_rate
        if self.settings.optimizer == "soap":
            shapes = [weight.shape for weight in self.weights.values()]
            return Soap(self.vector, shapes, rate)
        return torch.optim.Adam([self.vector], lr=rate, fused=True)

    @property
    def shipped(self) -> ArraysByName:
        """The weights to ship, as arrays."""
        vector = self.vector if self.average is None else self.average
        sizes = [weight.numel() for weight in self.weights.values()]
        parts = vector.cpu().split(sizes)
        return {
            name: part.view(weight.shape).numpy()
            for (name, weight), part in zip(self.weights.items(), parts, strict=True)
        }

    def resume(self) -> None:
        """Go on from the state in the folder, if there is one. Raises DataError: it belongs to a
        run with other settings, or cannot be read."""
        path = self.folder / STATE_FILE
        if not path.exists():
            return
        try:  # plain values and tensors only: reading never runs code
            state = torch.load(path, map_location="cpu", weights_only=True)
            changed = [
                key for key, value in self.identity.items() if state["identity"].get(key) != value
            ]
            if not changed:
                self._take(state)
        except Exception as error:  # whatever torch's reader meets in a damaged file
            reason = (str(error).splitlines() or [type(error).__name__])[0][:120]
            raise DataError(
                f"{path}: no state to go on from ({reason}); train without --resume"
            ) from error
        if changed:
            raise DataError(
                f"{self.folder}: holds a run with other settings ({', '.join(changed)}); resume "
                "with the same"
                " ones, or train without --resume"
            )

    def run(
        self,
        terms_of: Terms,
        save: Callable[[ArraysByName, dict[str, Any]], None],
        spent: float = 0.0,
    ) -> None:
        """Minimize the term `loss` to the end of the run. `save` takes the weights to ship and how
        far it is, now and then and at the end; `spent` are seconds that this call took so far, on
        other work."""
        settings = self.settings
        first = self.done
        limit = math.inf if settings.seconds is None else settings.seconds
        started = time.monotonic() - self.seconds - spent
        saved = time.monotonic()
        silent = self.place.rank > 0 or not sys.stderr.isatty()
        with tqdm(
            total=settings.steps, initial=first, unit="step", smoothing=0.05, disable=silent
        ) as bar:
            terms: dict[str, Tensor] = {}
            while self.done < settings.steps and (self.done == first == 0 or self.seconds < limit):
                step = self.done
                rate = learning_rate(settings, step, self.seconds / limit)
                terms = self.step(terms_of, step, rate)
                self.done = step + 1
                self.seconds = time.monotonic() - started
                bar.update()
                if step % LOG_EVERY == 0:
                    bar.set_postfix_str(f"loss {self._log(terms, rate):.4g}")
                if time.monotonic() - saved > SAVE_EVERY_S:
                    saved = self._write(save)
        if terms and (self.done - 1) % LOG_EVERY:
            self._log(terms, rate)
        self._write(save)
        if self.place.rank == 0 and (picture := curves(self.rows)):
            write_whole(self.folder / CURVES_FILE, picture, DataError)
        self.place.wait()

    def step(self, terms_of: Terms, step: int, rate: float) -> dict[str, Tensor]:
        """Takes step number `step` with a learning rate, and returns its loss terms."""
        self.optimizer.param_groups[0]["lr"] = rate
        terms = terms_of(step)
        self._set_gradient(terms["loss"])
        self.optimizer.step()
        if self.average is not None:
            # The average starts short and grows, so that early weights are soon forgotten.
            decay = min(self.settings.ema, (1 + step) / (10 + step))
            self.average.lerp_(self.vector, 1 - decay)
        return terms

    def _set_gradient(self, loss: Tensor) -> None:
        """Set the gradient of the vector of weights: averaged over all processes, clipped."""
        weights = list(self.weights.values())
        slopes = torch.autograd.grad(loss, weights, allow_unused=True, materialize_grads=True)
        gradient = torch.cat([slope.reshape(-1) for slope in slopes])
        self.place.average(gradient)
        norm = torch.linalg.vector_norm(gradient)
        self.vector.grad = gradient.mul_((GRADIENT_MAX / norm).clamp(max=1.0))

    def _log(self, terms: dict[str, Tensor], rate: float) -> float:
        """Add a row for the last step; its loss."""
        about = {"step": self.done - 1, "samples": self.done * self.settings.batch_size}
        values = {name: self.place.mean(value) for name, value in terms.items()}
        self.rows.append(about | {"seconds": self.seconds, "learning_rate": rate} | values)
        return values["loss"]

    def _write(self, save: Callable[[ArraysByName, dict[str, Any]], None]) -> float:
        """Write all that the run leaves, the state last, as it may be killed in between; the time
        of it."""
        if self.place.rank == 0:
            samples = self.done * self.settings.batch_size
            made = {"steps_done": self.done, "samples": samples, "processes": self.place.world}
            save(self.shipped, made)
            if self.rows:
                write_whole(self.folder / LOG_FILE, _table(self.rows), DataError)
            state = {name: getattr(self, name) for name in _KEPT} | {
                "optimizer": self.optimizer.state_dict()
            }
            content = io.BytesIO()
            torch.save(state, content)
            write_whole(self.folder / STATE_FILE, content.getvalue(), DataError)
        return time.monotonic()

    def _take(self, state: dict[str, Any]) -> None:
        self.optimizer.load_state_dict(state["optimizer"])
        self.vector.copy_(state["vector"])
        if self.average is not None:
            self.average.copy_(state["average"])
        self.done = state["done"]
        self.seconds = state["seconds"]
        self.rows = state["rows"]


_KEPT = ("identity", "vector", "average", "done", "seconds", "rows")
"""Parts of a run that its state holds, beside the optimizer's."""


def _table(rows: list[dict[str, float]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: f"{value:.8g}" for name, value in row.items()} for row in rows)
    return text.getvalue()


def curves(rows: list[dict[str, float]]) -> bytes | None:
    """A PNG of a log's columns over its steps; None without matplotlib, and of an empty log."""
    names = [name for name in rows[0] if name not in NO_CURVES] if rows else []
    if not names:
        return None
    try:
        return figure_bytes(lambda: _curves_picture(rows, names), "png")
    except ImportError:
        return None


def _curves_picture(rows: list[dict[str, float]], names: list[str]) -> Figure:
    """A panel for each of the named columns."""
    figure, axes = panels((8.0, 2.0 * len(names)), len(names), sharex=True)
    steps = [row["step"] for row in rows]
    for panel, name in zip(axes[:, 0], names, strict=True):
        values = [row[name] for row in rows]
        panel.plot(steps, values, linewidth=1.0)
        panel.set_yscale("log" if min(values) > 0.0 else "linear")
        panel.set_ylabel(name.replace("_", " "))
    axes[-1, 0].set_xlabel("step")
    return figure
