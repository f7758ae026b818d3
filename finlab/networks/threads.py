"""Keeps the small matrix products of one answer on one thread."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any


@contextmanager
def _one_thread(libraries: list[Any]) -> Iterator[None]:
    """Libraries work on one thread in this block; costs next to nothing where they already do."""
    changed = [(library, threads) for library in libraries if (threads := library.num_threads) != 1]
    try:
        for library, _ in changed:
            library.set_num_threads(1)
        yield
    finally:
        for library, threads in changed:
            library.set_num_threads(threads)


def single_threaded_products() -> Callable[[], AbstractContextManager[object]]:
    """A context in which numpy's products run on one thread.

    Where threadpoolctl is missing, as on a robot that carries only the runtime, the context does nothing;
    there OPENBLAS_NUM_THREADS=1 in the environment has the same effect.
    """
    try:
        from threadpoolctl import ThreadpoolController
    except ImportError:
        return nullcontext
    libraries = ThreadpoolController().select(user_api="blas").lib_controllers
    return lambda: _one_thread(libraries)
