"""Parts of a data set that processes write side by side, each on its own."""

import math
import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from typing import TypeVar

from tqdm import tqdm

from finlab.files.worker import end_with_parent

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
