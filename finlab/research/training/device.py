"""Device and processes of a training: those of torchrun, and a pool for the parts of its data."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
from torch import Tensor, distributed

from finlab.errors import CommandError

CPU_BFLOAT16_WIDTH = 128
"""Width of a layer from which a processor that knows bfloat16 gains by it."""


@dataclass(frozen=True)
class Workplace:
    """A device, and the number of this process among all that train together."""

    device: torch.device
    rank: int = 0
    world: int = 1

    def share(self, size: int) -> slice:
        """The rows of a batch of `size` that are this process's."""
        rows = size // self.world
        return slice(self.rank * rows, (self.rank + 1) * rows)

    def average(self, gradient: Tensor) -> None:
        """Average a gradient over all processes, in place; every process must ask."""
        if self.world > 1:
            distributed.all_reduce(gradient)
            gradient /= self.world

    def mean(self, value: Tensor) -> float:
        """The mean of a number over all processes; every process must ask."""
        value = value.detach().clone()
        if self.world > 1:
            distributed.all_reduce(value)
        return float(value) / self.world

    def wait(self) -> None:
        """Wait until every process has come here."""
        if self.world > 1:
            distributed.barrier()

    def autocast(self, width: int, in_float32: bool = False) -> torch.autocast:
        """Matrix products in bfloat16 where the device multiplies it faster than float32.

        The processor is asked, not timed: a resumed run would go on in another precision.

        Args:
            width: of the widest layer. On a processor narrow products gain less than rounding
                their factors costs.
            in_float32: whether they stay in float32 all the same.
        """
        kind = self.device.type
        fast = kind == "cuda"
        if kind == "cpu" and width >= CPU_BFLOAT16_WIDTH:
            fast = torch.cpu._is_avx512_bf16_supported()
        return torch.autocast(kind, torch.bfloat16, enabled=fast and not in_float32)


@contextmanager
def workplace(name: str | None, batch_size: int) -> Iterator[Workplace]:
    """The workplace of this process, on a device of torch such as cpu or cuda:1, by default a
    graphics card where there is one. Raises CommandError: there is no such device, or the processes
    cannot share the batch, the samples of a step, equally."""
    world, rank = (
        int(os.environ.get(key, default)) for key, default in (("WORLD_SIZE", 1), ("RANK", 0))
    )
    if batch_size % world:
        raise CommandError(
            f"batches of {batch_size} samples cannot be shared by {world} processes equally"
        )
    device = _device(name)
    if world == 1:
        yield Workplace(device)
        return
    distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    try:
        yield Workplace(device, rank, world)
    finally:
        distributed.destroy_process_group()


def _device(name: str | None) -> torch.device:
    local = os.environ.get("LOCAL_RANK", "0")
    if name in (None, "cuda") and torch.cuda.is_available():
        name = f"cuda:{local}"
    try:
        device = torch.device(name or "cpu")
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        reason = str(error).splitlines()[0][:120]
        raise CommandError(
            f"device: {name!r:.40} cannot be used here ({reason}); take cpu"
        ) from None
    if device.type == "cuda":
        torch.cuda.set_device(device)
    return device
