"""The way from a raw candidate to an exact one: the steps of the learned method's own refinement."""

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.learned.levenberg_marquardt import refine
from finlab.errors import AllocationError

STEPS = 6
"""Steps of Levenberg-Marquardt that are shown; the error has long vanished by then."""


def refinement(allocator: Allocator, answer: Allocation) -> tuple[Allocation, ...]:
    """The best raw candidate of an answer, then what each step makes of it, and the answer itself at the end.

    Raises:
        AllocationError: the method draws no candidates and refines none.
    """
    from finlab.allocation.learned.learned_allocator import LearnedAllocator

    if not isinstance(allocator, LearnedAllocator) or answer.samples is None:
        raise AllocationError("only the method learned refines candidates; choose it to see how")
    layout = answer.layout.without(answer.failed) if answer.failed else answer.layout
    alive = np.isfinite(answer.command[:, 0])
    problem = allocator.pipeline.prepare(layout).commands
    target = (answer.target / allocator.normalization.std)[None]
    raw = answer.samples.command[0][alive]
    frames = []
    for steps in range(STEPS + 1):
        command = np.full_like(answer.command, np.nan)
        command[alive] = refine(problem, target, raw[None], steps).command[0]
        frames.append(answer.with_command(command))
    return (*frames, answer)
