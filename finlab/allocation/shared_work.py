"""Work that several threads share."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


@cache
def _pool(size: int) -> ThreadPoolExecutor:
    """Threads that wait for work: to start some for each batch takes as long as a hundred
    answers."""
    return ThreadPoolExecutor(size, "finlab-batch")


if hasattr(os, "register_at_fork"):  # a child has none of the threads of its parent
    os.register_at_fork(after_in_child=_pool.cache_clear)


def in_threads(
    function: Callable[[Item], Result], items: Sequence[Item], threads: int
) -> list[Result]:
    """Calls a function with each of some items, the calls shared by threads.

    Each thread has a run of items, this one the first run: so no thread waits for another but at
    the end.

    Args:
        function: is called with an item; calls in several threads do not disturb each other.
        items: in any number.
        threads: how many share the calls, this one included.

    Returns:
        The results, in the order of the items.
    """

    def results_of(run: Sequence[Item]) -> list[Result]:
        return [function(item) for item in run]

    count = min(threads, len(items))
    if count <= 1:
        return results_of(items)
    ends = [len(items) * k // count for k in range(count + 1)]
    runs = [items[ends[k] : ends[k + 1]] for k in range(count)]
    others = [_pool(count - 1).submit(results_of, run) for run in runs[1:]]
    try:
        results = results_of(runs[0])
    finally:
        wait(others)  # nobody writes to the arrays of the caller afterwards
    for other in others:
        results += other.result()
    return results
