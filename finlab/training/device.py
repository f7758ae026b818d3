"""Where training runs, and with how many processes."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import torch
import torch.distributed as dist

from finlab.errors import DataError


def join_processes() -> tuple[int, int]:
    """Join the processes that PyTorch's `torchrun` started; answers (rank, number of processes)."""
    if "RANK" not in os.environ or int(os.environ.get("WORLD_SIZE", "1")) == 1:
        return 0, 1
    if not dist.is_initialized():
        dist.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    return dist.get_rank(), dist.get_world_size()


class Share(NamedTuple):
    """What one of the processes of a training does."""

    first: bool
    """Whether it is the one that writes."""
    rows: slice
    """Its rows of each batch."""
    device: torch.device
    """Where it computes."""


@contextmanager
def shared_training(batch_size: int) -> Iterator[Share]:
    """This process's share of a training that all processes of `torchrun` do together.

    Raises:
        DataError: the batches do not divide evenly among them.
    """
    rank, world = join_processes()
    if batch_size % world:
        raise DataError(f"batch size {batch_size} does not divide among {world} processes; choose a multiple")
    cuda = torch.cuda.is_available()  # then each process has a card of its own
    if cuda:
        # Matrix products of float32 in TensorFloat-32: their rounding is far below what is learned here.
        torch.set_float32_matmul_precision("high")
        # Fused attention is made for long sequences: for a few fins, plain products are twice as fast.
        torch.backends.cuda.enable_cudnn_sdp(False)
        torch.backends.cuda.enable_flash_sdp(False)
        torch.backends.cuda.enable_mem_efficient_sdp(False)
    device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0"))) if cuda else torch.device("cpu")
    rows = slice(rank * batch_size // world, (rank + 1) * batch_size // world)
    try:
        yield Share(rank == 0, rows, device)
    finally:
        if dist.is_initialized():
            dist.destroy_process_group()


def autocast_dtype(device_type: str) -> torch.dtype | None:
    """bfloat16 where the hardware multiplies it faster than float32, else None.

    CPUs with bfloat16 instructions gain several times; others emulate them, thirty times slower. The
    CPU is asked, not timed: on a loaded machine a timing misjudges now and then, and a resumed run
    would go on in another precision.
    """
    if device_type == "cuda":
        return torch.bfloat16
    return torch.bfloat16 if torch.cpu._is_avx512_bf16_supported() else None
