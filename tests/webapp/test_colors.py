"""Reserved hues that no fin comes near, and marks on sliders that do not lie on each other."""

import math
import re
from importlib.resources import files

import numpy as np
import pytest

from webapp.panels.wrench_tab import reach_marks
from webapp.theme import ASKED, DELIVERED, FIN_COLORS, MISSING, Rgb, ink

LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
OKLAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def linear(color: Rgb) -> np.ndarray:
    """Red, green and blue as light (3,)."""
    share = np.array(color) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def oklab(color: Rgb) -> np.ndarray:
    """Lightness and two opponent axes (3,), in which distances are as the eye sees them."""
    return OKLAB @ np.cbrt(LMS @ linear(color))


def reserved() -> dict[str, Rgb]:
    """The three hues on light, and on dark as the style has them."""
    style = files("webapp.markup").joinpath("style.css").read_text("utf-8")
    dark = re.findall(r"--fl-(asked|delivered|missing): rgb\((\d+),(\d+),(\d+)\)", style)
    found = {f"{word}, dark": (int(r), int(g), int(b)) for word, r, g, b in dark}
    assert len(found) == 3
    return {"asked": ASKED, "delivered": DELIVERED, "missing": MISSING, **found}


@pytest.mark.parametrize("fin", FIN_COLORS)
def test_no_fin_comes_near_a_reserved_hue(fin: Rgb) -> None:
    seen = oklab(fin)
    for word, color in reserved().items():
        other = oklab(color)
        turn = math.degrees(math.atan2(seen[2], seen[1]) - math.atan2(other[2], other[1]))
        assert abs((turn + 180.0) % 360.0 - 180.0) > 40.0, f"hue of {fin} and {word}"
        assert np.linalg.norm(seen - other) > 0.12, f"{fin} and {word}"


def test_fins_differ_and_their_numbers_can_be_read() -> None:
    for k, fin in enumerate(FIN_COLORS):
        for other in FIN_COLORS[:k]:
            assert np.linalg.norm(oklab(fin) - oklab(other)) > 0.08
        light, number = (float(linear(c) @ (0.2126, 0.7152, 0.0722)) for c in (fin, _rgb(ink(fin))))
        bright, dim = max(light, number) + 0.05, min(light, number) + 0.05
        assert bright / dim > 3.9, f"the number on {fin}"


def _rgb(color: str) -> Rgb:
    digit = int(color[1], 16) * 17
    return digit, digit, digit


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
