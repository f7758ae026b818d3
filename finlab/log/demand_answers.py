"""Allocates the demands of a log, each of which may leave other axes free.

`judging` asks it what an autopilot would have given, and `replay` what other methods would.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.axes import axes_in


class DemandAnswers(NamedTuple):
    """Answers to N demands."""

    command: Array
    """(N, n, 3), NaN of a lost actuator."""
    unallocated: Array
    """The missing wrench (N, 6) [N, N m]; 0 along free axes."""
    err_norm: Array
    """Its norm (N,), normalized by the wrench scale."""
    power: Array
    """Power (N,) [W]."""


def answers_to(
    allocator: Allocator, wrench: Array, lost: Sequence[str] = (), **options: Any
) -> DemandAnswers:
    """Returns answers to demands; those that leave the same axes free are one batch.

    Args:
        allocator: allocator of the robot.
        wrench: demands (N, 6) [N, N m]; NaN along axes that a demand leaves free.
        lost: names of actuators that do not work.
        **options: further arguments of `Allocator.allocate_batch`.

    Raises:
        CommandError: a demand asks for no axis.
    """
    count = len(wrench)
    answers = DemandAnswers(
        np.empty((count, allocator.layout.n, 3)),
        np.empty((count, 6)),
        np.empty(count),
        np.empty(count),
    )
    patterns, group = np.unique(np.isnan(wrench), axis=0, return_inverse=True)
    for k, is_free in enumerate(patterns):
        rows = np.flatnonzero(group.ravel() == k)
        free = axes_in(is_free)
        batch = allocator.allocate_batch(
            np.nan_to_num(wrench[rows]), lost=lost, free=free, **options
        )
        answers.command[rows] = batch.command
        answers.unallocated[rows] = batch.unallocated
        answers.err_norm[rows] = batch.err_norm
        answers.power[rows] = batch.power
    return answers
