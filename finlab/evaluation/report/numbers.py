"""Numbers as people read them."""

import math
from collections.abc import Callable
from typing import Any


def error(value: float) -> str:
    """Two significant digits: 0.00029, 0.086, 1.8, 3.1e-7."""
    if value == 0:
        return "0"
    if not math.isfinite(value):
        return "–"
    if abs(value) < 9.5e-5:
        mantissa, _, power = f"{value:.1e}".partition("e")
        return f"{mantissa}e{int(power)}"
    digits = max(0, 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def three(value: float) -> str:
    """Three significant digits: 2.86, 0.0857, 178."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "–"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}" if digits < 7 else f"{value:.2e}"


def near(value: float) -> str:
    """Three decimals where values lie near one, so that 1.000 and 1.016 differ, else as an error."""
    return f"{value:.3f}" if 0.1 <= abs(value) < 10.0 else error(value)


def share(value: float) -> str:
    """As a percentage, with more digits the nearer it is to 100: 48.8 %, 99.97 %, 100 %."""
    if value >= 1.0:
        return "100 %"
    missing = 100 * (1 - value)
    digits = 1 if missing >= 1 else min(4, -math.floor(math.log10(missing)))
    return f"{100 * value:.{digits}f} %"


def change(value: float) -> str:
    """A ratio less one as a percentage: +82.0 %, 0.0 %."""
    percent = round(100.0 * value, 1)
    return f"{percent:+.1f} %" if percent else "0.0 %"


FORMATS: dict[str, Callable[[Any], str]] = {
    "error": error,
    "near": near,
    "three": three,
    "share": share,
    "count": "{:,}".format,
    "ratio": "{:.3f}".format,
    "metres": "{:.4f}".format,
    "change": change,
    "text": str,
    "code": "`{}`".format,
}
"""Name -> how a value is shown."""
