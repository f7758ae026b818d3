"""Device and processes of a training: those of torchrun, and a pool for the parts of its data."""

import gc
import math
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

import torch
from torch import Tensor, distributed, nn
from torch.nn.parallel import DistributedDataParallel
from tqdm import tqdm

from finlab.errors import CommandError
from finlab.files.worker import end_with_parent


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

    def shared(self, module: nn.Module) -> nn.Module:
        """A module whose gradients are averaged over all processes."""
        return DistributedDataParallel(module) if self.world > 1 else module

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

    def autocast(self) -> torch.autocast:
        """Matrix products in bfloat16 where the device multiplies it faster than float32.

        The CPU is asked, not timed: a timing may differ from run to run, and a resumed run would go on in
        another precision.
        """
        kind = self.device.type
        fast = kind == "cuda" or (kind == "cpu" and torch.cpu._is_avx512_bf16_supported())
        return torch.autocast(kind, torch.bfloat16, enabled=fast)


@contextmanager
def workplace(name: str | None, batch_size: int) -> Iterator[Workplace]:
    """The workplace of this process.

    Args:
        name: a device of torch such as cpu or cuda:1; by default a graphics card where there is one.
        batch_size: samples of a step, which all processes share.

    Raises:
        CommandError: there is no such device, or the batch cannot be shared equally.
    """
    world, rank = (int(os.environ.get(key, default)) for key, default in (("WORLD_SIZE", 1), ("RANK", 0)))
    if batch_size % world:
        raise CommandError(f"batches of {batch_size} samples cannot be shared by {world} processes equally")
    device = _device(name)
    if world == 1:
        yield Workplace(device)
        return
    distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    try:
        yield Workplace(device, rank, world)
    finally:
        gc.collect()  # modules that are shared hold threads of the group, which must end before it
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
        raise CommandError(f"device: {name!r:.40} cannot be used here ({reason}); take cpu") from None
    if device.type == "cuda":
        torch.cuda.set_device(device)
    return device


Made = TypeVar("Made")


def parts_by_processes(
    write: Callable[[int], Made], count: int, what: str, until: float = math.inf, least: int = 1
) -> list[Made]:
    """What `write` answers for the numbers from 0, in order, worked on by all cores.

    Args:
        write: writes a part; sent to the processes, so it must be importable.
        count: how many parts.
        what: what the progress bar is called.
        until: time of `time.monotonic` after which no further part is waited for.
        least: parts that are waited for at any rate.
    """
    made, silent = list[Made](), not sys.stderr.isatty()
    if count == 1:
        return [write(0)]
    context, cores = multiprocessing.get_context("spawn"), min(count, os.cpu_count() or 1)
    with context.Pool(cores, initializer=end_with_parent) as pool:
        for part in tqdm(pool.imap(write, range(count)), what, count, unit="part", disable=silent):
            made.append(part)
            if len(made) >= least and time.monotonic() > until:
                break
    return made
