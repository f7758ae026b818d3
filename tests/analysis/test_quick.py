"""What can be told while one moves a fin, against the whole analysis."""

from collections.abc import Callable

import pytest

from finlab.analysis import authority, losses
from finlab.analysis.score_card import quick_check
from finlab.layout import Layout

Layouts = Callable[[str], Layout]


@pytest.mark.parametrize("name", ["A", "B", "ucat", "pair", "no_yaw", "hexa", "asymmetric"])
def test_quick_check_agrees_with_the_whole_analysis(shipped: Layouts, name: str) -> None:
    layout = shipped(name)
    quick, whole = quick_check(layout), authority(layout)
    assert (quick.rank, quick.without_authority, quick.coupled) == (
        whole.rank,
        whole.without_authority,
        whole.coupled,
    )
    assert quick.condition == pytest.approx(whole.condition)
    assert dict(quick.lost) == {loss.actuator: loss.lost for loss in losses(layout) if loss.lost}
