"""Marks of what is within reach on the sliders of the target (`panels/wrench_tab.py`)."""

import numpy as np
from markupsafe import Markup

from finlab.display import LARGEST_PLAIN
from finlab.forces.reach import Ranges
from finlab.layout import Layout
from webapp.markup.words import prefixed

CLOSE = 0.28
"""Share of a slider below which the texts of two marks would lie on each other."""
POINT_RANGE = 1e-3
"""Width [N or N m] up to which a range counts as a single value."""


def reach_marks(low: float, high: float, width: float) -> tuple[tuple[float, str], ...]:
    """The marks at the ends of a range.

    Args:
        low: lower end [N or N m]; not finite where there is no range.
        high: upper end [N or N m].
        width: what the whole slider stands for [N or N m].

    Returns:
        Value and text at both ends, or one for both where they meet.
    """
    if not np.isfinite(low):
        return ()
    texts = list[str]()
    for value in (low, high):
        # As many digits as the slider's width needs.
        if abs(value) >= 9.95:
            digits = 0
        elif width >= 2.0:
            digits = 1
        elif width >= 0.2:
            digits = 2
        else:
            digits = 3
        rounded = round(value, digits)
        text = f"{rounded:.{digits}f}" if rounded else "0"
        if abs(value) >= LARGEST_PLAIN:
            text = "".join(prefixed(value))
        texts.append(text.replace("-", "−"))
    low_text, high_text = texts
    if high - low <= POINT_RANGE:
        return ((round(low, 3), low_text),)
    if high - low < CLOSE * width:
        # Both texts stand at the upper end.
        is_symmetric = low_text == f"−{high_text}"
        high_text = f"±{high_text}" if is_symmetric else f"{low_text} … {high_text}"
        low_text = ""
    return (round(low, 3), low_text), (round(high, 3), high_text)


def reach_style(ranges: Ranges | None, able: Layout, *slider_ends: float) -> Markup:
    """A style that tells the sliders of all axes their marks.

    Args:
        ranges: what is within reach on each axis; None while it is not known.
        able: the robot as it is damaged; a free axis has no marks.
        slider_ends: value up to which each slider goes either way [N or N m].
    """
    rules = []
    for k, slider_end in enumerate(slider_ends):
        if ranges is None or not able.commanded[k]:
            continue
        marks = reach_marks(float(ranges.low[k]), float(ranges.high[k]), 2.0 * slider_end)
        properties = ""
        # A single mark is the last one.
        for name, (value, text) in zip(("last", "first"), reversed(marks), strict=False):
            share = min(max(value / slider_end, -1.0), 1.0)
            position = 50.0 + 50.0 * share
            properties += f"--{name}: {position:.1f}%; --{name}-words: '{text}'; "
        rules.append(f"[data-fl~=axis-{k}] + div {{ {properties}}}")
    return Markup(f"<style>{' '.join(rules)}</style>")
