"""Keeps the small matrix products of one answer on one thread."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any


class _OneThread:
    """Lets libraries work on one thread in a `with` block; costs next to nothing where they already do."""

    def __init__(self, libraries: list[Any]) -> None:
        """Take the controllers of threadpoolctl."""
        self._libraries = libraries
        self._changed: list[tuple[Any, int]] = []

    def __enter__(self) -> None:
        for library in self._libraries:
            threads = library.num_threads
            if threads != 1:
                self._changed.append((library, threads))
                library.set_num_threads(1)

    def __exit__(self, *error: object) -> None:
        for library, threads in self._changed:
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
    return lambda: _OneThread(libraries)
