"""Six bars: what was asked of each axis, and what is delivered."""

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation.policy import AXES
from webapp.session.state import AXIS_UNITS, AXIS_WORDS
from webapp.session.targets import nice_limit


def wrench_bars(asked: ArrayLike, given: ArrayLike | None, sentence: str) -> str:
    """The bars of all six axes.

    Args:
        asked: target wrench (6,) [N, N m].
        given: delivered wrench (6,), None while there is none.
        sentence: what is left undone, in words.
    """
    asked = np.asarray(asked, dtype=float)
    given = None if given is None else np.asarray(given, dtype=float)
    values = np.array([asked, asked if given is None else given])
    # One scale for the forces and one for the torques, so that bars compare; it moves in coarse steps only.
    scales = [
        max(nice_limit(np.abs(values[:, part]).max()), least)
        for part, least in ((slice(0, 3), 2), (slice(3, 6), 0.5))
    ]
    rows = [_header(scales)]
    for k in range(6):
        scale = scales[k // 3]
        rows.append(f"<span>{AXIS_WORDS[k]} <span class='dim'>{AXES[k]}</span></span>")
        rows.append(_track(asked[k] / scale, None if given is None else given[k] / scale))
        rows.append(f"<span class='right asked'>{_value(asked[k], k)}</span>")
        rows.append(f"<span class='right given'>{'–' if given is None else _value(given[k], k)}</span>")
    return f"<div class='fl'><div class='bars'>{''.join(rows)}</div><div class='said'>{sentence}</div></div>"


def _header(scales: list[float]) -> str:
    scale = f"±{scales[0]:g} {AXIS_UNITS[0]}, ±{scales[1]:g} {AXIS_UNITS[3]}"
    return (
        f"<span></span><span class='dim' style='text-align:center'>{scale}</span>"
        "<b class='right asked'>asked</b><b class='right given'>delivered</b>"
    )


def _value(value: float, axis: int) -> str:
    digits = 2 if axis < 3 else 3
    rounded = round(value, digits)
    return f"{rounded:+.{digits}f}".replace("-", "−") if rounded else f"{0:.{digits}f}"


def _track(asked: float, given: float | None) -> str:
    parts = ["<i style='left:50%;top:0;width:1px;height:14px;background:rgba(128,128,128,.55)'></i>"]
    parts.append(_bar(0.0, asked, 1, 5, "var(--fl-asked)"))
    if given is not None:
        parts.append(_bar(0.0, given, 8, 5, "var(--fl-delivered)"))
        if abs(asked - given) > 0.02:
            parts.append(_bar(given, asked, 8, 5, "var(--fl-missing)"))
    return f"<div class='track'>{''.join(parts)}</div>"


def _bar(start: float, end: float, top: int, height: int, color: str) -> str:
    low, high = sorted((float(np.clip(start, -1, 1)), float(np.clip(end, -1, 1))))
    return (
        f"<i style='left:{50 + 50 * low:.2f}%;width:{50 * (high - low):.2f}%;"
        f"top:{top}px;height:{height}px;background:{color}'></i>"
    )
