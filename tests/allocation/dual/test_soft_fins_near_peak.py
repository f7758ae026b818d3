"""Wrenches that take the last share of a soft fin's force, whose price has no end."""

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.research.evaluation.splits import make_case


@pytest.mark.parametrize(("split", "layout", "target"), [("fins-mixed", 5, 6), ("any-shaft", 1, 7)])
@pytest.mark.parametrize("previous", [False, True])
def test_the_last_share_of_a_force_is_given(
    split: str, layout: int, target: int, previous: bool
) -> None:
    case = make_case(split, 10, 11, layout)
    allocator = Allocator(case.layout)
    wrench = case.targets[target]
    free = allocator.allocate(wrench)
    result = allocator.allocate(wrench, previous=free.command) if previous else free
    missing = np.abs(result.wrench - wrench) / np.abs(wrench).max()
    assert result.reachable and missing.max() < 1e-6
    assert 0.9 * result.power < result.bound <= result.power
    assert allocator.allocate_batch(wrench[None]).power[0] == pytest.approx(free.power, rel=1e-9)
