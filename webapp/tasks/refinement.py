"""The way from a raw candidate to an exact one: the steps of the learned method's own refinement."""

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.errors import AllocationError

STEPS = 6
"""Steps of Levenberg-Marquardt that are shown; the error has long vanished by then."""


def refinement(allocator: Allocator, answer: Allocation) -> tuple[Allocation, ...]:
    """The best raw candidate of an answer, then what each step makes of it, and the answer itself at the end.

    Raises:
        AllocationError: the method draws no candidates and refines none.
    """
    if answer.samples is None:
        raise AllocationError(f"method {allocator.name!r} draws no candidates; use method 'learned'")
    layout = answer.layout.without(answer.failed) if answer.failed else answer.layout
    alive = np.isfinite(answer.command[:, 0])
    raw = answer.samples.command[0][alive]
    frames = []
    for steps in range(STEPS + 1):
        command = np.full_like(answer.command, np.nan)
        command[alive] = allocator.refined(layout, answer.target, raw, steps)
        frames.append(answer.with_command(command))
    return (*frames, answer)
