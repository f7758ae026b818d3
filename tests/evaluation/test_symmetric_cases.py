"""Symmetric cases hold what they promise."""

import numpy as np
import pytest

from finlab.analysis import authority
from finlab.evaluation.symmetric_cases import LAYOUTS, SETS, SHARES, symmetric_cases
from tests.any_robot import AnyRobot


@pytest.mark.parametrize("name", SETS)
def test_all_targets_can_be_delivered_and_runs_can_be_repeated(name: str) -> None:
    search = AnyRobot()
    for case, again in zip(symmetric_cases(name, 3, 6, 4), symmetric_cases(name, 3, 6, 4), strict=True):
        assert case.layout == again.layout
        np.testing.assert_array_equal(case.targets, again.targets)
        assert search.allocate_batch(case.layout, case.targets).reachable.all()


def test_axes_are_pure_and_of_known_sizes() -> None:
    cases = symmetric_cases("axes", 9, 99, 0)
    assert [case.layout.name for case in cases] == list(LAYOUTS)
    for case in cases:
        held = authority(case.layout)
        largest = np.minimum(held.largest, held.most_negative)
        assert ((case.targets != 0.0).sum(axis=1) == 1).all()
        share = np.abs(case.targets / np.where(largest > 0.0, largest, 1.0)).max(axis=1)
        assert len(share) == 2 * len(SHARES) * len(held.reachable)
        assert np.sort(share) == pytest.approx(np.repeat(SHARES, 2 * len(held.reachable)))


def test_mixes_ask_for_two_or_three_axes() -> None:
    for case in symmetric_cases("axes-mixed", 5, 99, 0):
        assert set((case.targets != 0.0).sum(axis=1)) == {2, 3}
