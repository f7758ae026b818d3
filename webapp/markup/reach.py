"""Marks of what is within reach on the sliders of the target."""

import numpy as np
from markupsafe import Markup

from finlab.forces.reach import Ranges
from finlab.layout import Layout

CLOSE = 0.28
"""Share of a slider below which the texts of two marks would lie on each other."""


def reach_marks(low: float, high: float, width: float) -> tuple[tuple[float, str], ...]:
    """Value and text at both ends of a range on a slider `width` long, or one for both where they
    meet."""
    if not np.isfinite(low):
        return ()
    fine = 1 if width >= 2.0 else 2 if width >= 0.2 else 3
    ends = []
    for value in (low, high):
        digits = 0 if abs(value) >= 9.95 else fine
        rounded = round(value, digits)
        ends.append(f"{rounded:.{digits}f}".replace("-", "−") if rounded else "0")
    first, last = ends
    if high - low <= 1e-3:
        return ((round(low, 3), first),)
    if high - low < CLOSE * width:
        first, last = "", f"±{last}" if first == f"−{last}" else f"{first} … {last}"
    return (round(low, 3), first), (round(high, 3), last)


def reach_style(ranges: Ranges | None, able: Layout, *ends: float) -> Markup:
    """A style that tells the sliders of all axes, which go up to `ends` either way, their marks."""
    rules = []
    for k, end in enumerate(ends):
        if ranges is None or not able.commanded[k]:
            continue
        marks = reach_marks(float(ranges.low[k]), float(ranges.high[k]), 2.0 * end)
        properties = ""
        for name, (value, words) in zip(("last", "first"), reversed(marks), strict=False):
            properties += f"--{name}: {50.0 + 50.0 * value / end:.1f}%; --{name}-words: '{words}'; "
        rules.append(f"[data-fl~=axis-{k}] + div {{ {properties}}}")
    return Markup(f"<style>{' '.join(rules)}</style>")
