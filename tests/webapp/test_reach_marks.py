"""The marks on the sliders of the target: where the reach ends, in words that do not lie on each other."""

import math

import pytest

from webapp.panels.wrench_tab import reach_marks


@pytest.mark.parametrize(
    ("low", "high", "marks"),
    [
        (-12.04, 11.0, ((-12.04, "−12"), (11.0, "11"))),
        (-1.9, 1.9, ((-1.9, ""), (1.9, "±1.9"))),
        (3.1234, 5.0, ((3.123, ""), (5.0, "3.1 … 5.0"))),
        (-0.04, 2.0, ((-0.04, ""), (2.0, "0 … 2.0"))),
        (2.0, 2.0, ((2.0, "2.0"),)),
        (math.nan, math.nan, ()),
    ],
)
def test_marks_of_a_slider_that_is_forty_long(
    low: float, high: float, marks: tuple[tuple[float, str], ...]
) -> None:
    assert reach_marks(low, high, 40.0) == marks


def test_marks_of_a_short_slider_have_more_digits() -> None:
    assert reach_marks(-0.04, 0.06, 0.15) == ((-0.04, "−0.040"), (0.06, "0.060"))
