"""Where training runs, and with how many processes."""

from __future__ import annotations

import os
import time
from functools import lru_cache

import torch
import torch.distributed as dist


def training_device() -> torch.device:
    """CUDA (the card of this process) where present, else the CPU."""
    if torch.cuda.is_available():
        return torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
    return torch.device("cpu")


def join_processes() -> tuple[int, int]:
    """Join the processes that PyTorch's `torchrun` started; answers (rank, number of processes)."""
    if "RANK" not in os.environ or int(os.environ.get("WORLD_SIZE", "1")) == 1:
        return 0, 1
    if not dist.is_initialized():
        dist.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    return dist.get_rank(), dist.get_world_size()


def leave_processes() -> None:
    """Undo `join_processes`."""
    if dist.is_initialized():
        dist.destroy_process_group()


@lru_cache
def autocast_dtype(device_type: str) -> torch.dtype | None:
    """bfloat16 where its matrix products beat float32 by half again, else None.

    CPUs with bfloat16 instructions run them several times faster; others emulate them, twenty times
    slower. Which kind this is, a few products tell at once.
    """
    if device_type == "cuda":
        return torch.bfloat16
    seconds = {dtype: _product_seconds(dtype) for dtype in (torch.float32, torch.bfloat16)}
    return torch.bfloat16 if 1.5 * seconds[torch.bfloat16] < seconds[torch.float32] else None


def _product_seconds(dtype: torch.dtype) -> float:
    a = torch.ones(256, 256, dtype=dtype)
    times = []
    for _ in range(4):
        start = time.perf_counter()
        a @ a
        times.append(time.perf_counter() - start)
    return min(times)
