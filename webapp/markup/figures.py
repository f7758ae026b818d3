"""Numbers and lists as people read them: fixed width, a real minus sign, three significant digits."""

import math
from collections.abc import Sequence


def listed(items: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    items = list(items)
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def small(value: float) -> str:
    """A number of any size that never changes its width: `3.10e−05`."""
    return f"{value:.2e}".replace("-", "−") if math.isfinite(value) else "–"


def three_digits(value: float) -> str:
    """Three significant digits: `2.32`, `0.0410`, `12.5`; small and large ones as `small` has them."""
    if not math.isfinite(value):
        return "–"
    if value != 0 and not 1e-3 <= abs(value) < 1e4:
        return small(value)
    whole = math.floor(math.log10(abs(value))) if value else 0
    return f"{value:.{max(2 - whole, 0)}f}".replace("-", "−")
