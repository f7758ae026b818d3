"""Answers to the demands of a log, whose rows may ask for different axes."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.axes import AXES


class DemandAnswers(NamedTuple):
    """Answers to N demands."""

    command: Array
    """(N, n, 3), NaN of a lost actuator."""
    unallocated: Array
    """What is missing (N, 6) [N, N m]; 0 along axes that are not asked for."""
    err_norm: Array
    """Its size (N,) on the yardstick."""
    power: Array
    """(N,) [W]."""


def answers_to(
    allocator: Allocator, wrench: Array, lost: Sequence[str] = (), **options: Any
) -> DemandAnswers:
    """Returns answers to demands, those that ask for the same axes together.

    Args:
        allocator: of the robot.
        wrench: (N, 6) [N, N m]; NaN along axes that a demand does not ask for.
        lost: names of actuators that do not work.
        **options: of `Allocator.allocate_batch`.

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
    open_axes = np.isnan(wrench)
    patterns, group = np.unique(open_axes, axis=0, return_inverse=True)
    for k, pattern in enumerate(patterns):
        rows = np.flatnonzero(group.ravel() == k)
        free = tuple(axis for axis, is_open in zip(AXES, pattern, strict=True) if is_open)
        batch = allocator.allocate_batch(
            np.nan_to_num(wrench[rows]), lost=lost, free=free, **options
        )
        answers.command[rows] = batch.command
        answers.unallocated[rows] = batch.unallocated
        answers.err_norm[rows] = batch.err_norm
        answers.power[rows] = batch.power
    return answers
