"""Work that several threads share."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


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
    with ThreadPoolExecutor(count - 1) as pool:
        others = [pool.submit(results_of, run) for run in runs[1:]]
        results = results_of(runs[0])
        for other in others:
            results += other.result()
    return results
