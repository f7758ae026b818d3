"""Keeps the small matrix products of one answer on one thread."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import partial


def single_threaded_products() -> Callable[[], AbstractContextManager[object]]:
    """A context in which numpy's products run on one thread.

    Where threadpoolctl is missing, as on a robot that carries only the runtime, the context does nothing;
    there OPENBLAS_NUM_THREADS=1 in the environment has the same effect.
    """
    try:
        from threadpoolctl import ThreadpoolController
    except ImportError:
        return nullcontext
    return partial(ThreadpoolController().select(user_api="blas").limit, limits=1)
