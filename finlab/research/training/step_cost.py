"""Cost of a step of a training, beside the matrix products that it cannot do without."""

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode

WARM_UP = 20
"""Steps that are taken before the first one is timed."""


@dataclass(frozen=True)
class StepCost:
    """Processor time of the steps of a training, on one thread."""

    samples: int
    """Samples of a step."""
    step_s: float
    """Least time of a step [s]."""
    median_s: float
    """Median time of a step [s]."""
    products: int
    """Number of matrix products of a step, forward and backward."""
    products_s: float
    """Time of these products alone [s]: the sum of the least time of each."""
    flops: int
    """Their multiplications and additions."""

    @property
    def ratio(self) -> float:
        """A step over its products."""
        return self.step_s / self.products_s

    @property
    def samples_per_second(self) -> float:
        """Samples that a thread learns from in a second."""
        return self.samples / self.step_s


def step_cost(step: Callable[[int], object], samples: int, steps: int = 60) -> StepCost:
    """Measures a training on one thread of the processor.

    The products are recorded while a step is taken, then repeated alone: the same factors, with
    their shapes, types and strides. Steps and products take turns, so that both meet the same
    machine.

    Args:
        step: takes the step of a number.
        samples: of a step.
        steps: how many are timed.
    """
    with _one_thread():
        for number in range(WARM_UP):
            step(number)
        record = _RecordedProducts()
        with record:
            step(WARM_UP)
        least = [float("inf")] * len(record.factors)
        times = []
        for number in range(WARM_UP + 1, WARM_UP + 1 + steps):
            times.append(_time_of(step, number))
            for k, (a, b) in enumerate(record.factors):
                least[k] = min(least[k], _time_of(torch.matmul, a, b))
    flops = sum(2 * a.numel() * b.shape[-1] for a, b in record.factors)
    return StepCost(samples, min(times), statistics.median(times), len(least), sum(least), flops)


class _RecordedProducts(TorchDispatchMode):
    """Records the factors of all matrix products that torch is asked for, gradients included."""

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self.factors: list[tuple[Tensor, Tensor]] = []

    def __torch_dispatch__(
        self, operator: Any, types: Any, arguments: Any = (), options: Any = None
    ) -> Any:
        name = operator.name()
        if name in ("aten::mm", "aten::bmm"):
            first, second = arguments
            self.factors.append((first, second))
        elif name in ("aten::addmm", "aten::baddbmm"):
            _, first, second = arguments
            self.factors.append((first, second))
        return operator(*arguments, **(options or {}))


def _time_of(function: Callable[..., object], *arguments: Any) -> float:
    """Processor time of this thread for a call [s]."""
    started = time.thread_time_ns()
    function(*arguments)
    return 1e-9 * (time.thread_time_ns() - started)


@contextmanager
def _one_thread() -> Iterator[None]:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
