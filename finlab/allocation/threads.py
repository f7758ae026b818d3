"""Keeps the small matrix products of one answer on one thread."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext


def single_threaded_products() -> Callable[[], AbstractContextManager[object]]:
    """A context in which numpy's products run on one thread.

    Where threadpoolctl is missing, as on a robot that carries only the runtime, the context does nothing;
    there OPENBLAS_NUM_THREADS=1 in the environment has the same effect.
    """
    try:
        from threadpoolctl import ThreadpoolController
    except ImportError:
        return nullcontext
    controller = ThreadpoolController()
    return lambda: controller.limit(limits=1, user_api="blas")
