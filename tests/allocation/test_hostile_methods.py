"""Valid but hostile robots: every method answers in finite numbers within the limits, or refuses in words."""

import warnings

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.errors import FinlabError
from tests.hostile_robots import hostile_robot, hostile_targets


@pytest.mark.parametrize("method", ["search", "mdn", "paper", "qp", "analytic", "sqp"])
def test_answers_are_finite_and_within_limits(method: str) -> None:
    allocator = load_allocator(method)
    for number in range(6):
        layout = hostile_robot(number, 1)
        targets = hostile_targets(layout, 12, number, 1)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            commands = [*allocator.allocate_batch(layout, targets).command]
            previous = None
            for target in targets[:3]:
                try:
                    previous = allocator.allocate(layout, target, previous=previous).command
                except FinlabError as error:
                    assert str(error).count("\n") == 0
                else:
                    commands.append(previous)
        for command in commands:
            assert np.isfinite(command).all(), layout.name
            assert ((command >= layout.lower) & (command <= layout.upper)).all(), layout.name
