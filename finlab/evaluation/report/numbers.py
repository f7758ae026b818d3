"""Numbers as people read them."""

import math
from collections.abc import Callable
from typing import Any


def error(value: float) -> str:
    """Two significant digits: 0.00029, 0.086, 1.8, 3.1e-7."""
    if 0 < abs(value) < 9.5e-5:
        mantissa, _, power = f"{value:.1e}".partition("e")
        return f"{mantissa}e{int(power)}"
    return three(value, 2)


def three(value: float, count: int = 3) -> str:
    """Three significant digits, or another number of them: 2.86, 0.0857, 178."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "–"
    digits = max(0, count - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}" if digits < 7 else f"{value:.2e}"


def share(value: float) -> str:
    """As a percentage, with more digits the nearer it is to 100: 48.8 %, 99.97 %, 100 %."""
    if value >= 1.0:
        return "100 %"
    missing = 100 * (1 - value)
    digits = 1 if missing >= 1 else min(4, -math.floor(math.log10(missing)))
    return f"{100 * value:.{digits}f} %"


FORMATS: dict[str, Callable[[Any], str]] = {
    "error": error,
    "three": three,
    "share": share,
    "count": "{:,}".format,
    "ratio": "{:.3f}".format,
    "metres": "{:.4f}".format,
    "text": str,
    "code": "`{}`".format,
}
"""Name -> how a value is shown."""
