"""Priorities where an axis is driven badly: what a weak axis costs takes nothing from those before it."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation import Allocator, Policy
from finlab.allocation.baselines.px4 import ORDER
from finlab.evaluation.experiments.thrusters import _draws, misses_more, missing_by_group
from finlab.layout import load_layout
from finlab.layout.axes import AXES


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_on_a_surveyed_frame_a_priority_misses_no_more_than_px4(lost: int) -> None:
    policy = Policy("priority", order=ORDER)
    for layout, edge in _draws("surveyed", lost, 3, 6, 3):
        for share in (1.2, 2.0):
            ours, theirs = (
                Allocator(layout, name).allocate_batch(share * edge, **how)
                for name, how in (("dual", {"policy": policy}), ("px4", {}))
            )
            mine, own = (missing_by_group(each.unallocated / each.scale, ORDER) for each in (ours, theirs))
            assert not misses_more(mine, own).any(), np.stack([mine, own], 1)[misses_more(mine, own)]


@pytest.mark.parametrize(
    "order", [Policy.order, (("Tz",), ("Fx", "Fz")), (("Fx", "Tz"), ("Fz",)), (("Fz", "Fx"), ("Tz",))]
)
def test_an_axis_that_nothing_drives_holds_up_no_other(order: tuple[tuple[str, ...], ...]) -> None:
    allocator = Allocator(replace(load_layout("no_yaw"), axes=AXES))
    answer = allocator.allocate([1.0, 0.0, 0.5, 0.0, 0.0, 0.2], policy=Policy("priority", order=order))
    np.testing.assert_allclose(answer.unallocated, [0.0, 0.0, 0.0, 0.0, 0.0, 0.2], atol=1e-4)
