"""Hard days that any robot can swim: those of `finlab eval swims` that need no robot of their own."""

import math
from typing import Any

from finlab.assets import PAPER_LAYOUTS
from finlab.evaluation.experiments.hard_days import CURRENT, HARD_DAYS, TWO, HardDay
from finlab.sim import Changing, SteadyCurrent, Water, Waves

LOST_IN_CURRENT = HardDay(
    "lost-in-current",
    "In a current of 7 cm/s a fin is lost half-way, and a monitor has to find out.",
    water=SteadyCurrent(CURRENT),
    lost=1,
    announced=False,
)
SCENARIOS: dict[str, HardDay] = {
    day.name: day
    for day in (*HARD_DAYS, LOST_IN_CURRENT)
    if not day.mixed_fins and day.layouts in (PAPER_LAYOUTS, TWO, PAPER_LAYOUTS[:1])
}
"""Scenarios by name."""


def conditions(day: HardDay) -> dict[str, Any]:
    """What a day says of all that the page can change while robots swim, as fields of `SwimSettings`."""
    x, y, _ = _velocity(day.water)
    speed = math.hypot(x, y)
    return {
        "current_cm_s": round(100.0 * speed, 1),
        "heading_deg": round(math.degrees(math.atan2(y, x))) if speed else 0.0,
        "waves_cm": round(100.0 * day.water.height_m) if isinstance(day.water, Waves) else 0.0,
        "buoyancy_percent": round(100.0 * (day.truth.get("buoyancy", 1.0) - 1.0), 2),
    }


def _velocity(water: Water) -> tuple[float, ...]:
    """Velocity (3,) of a current at the start [m/s]."""
    if isinstance(water, Changing):
        return _velocity(water.before)
    if isinstance(water, Waves):
        return tuple(water.current)
    return tuple(water.velocity) if isinstance(water, SteadyCurrent) else (0.0, 0.0, 0.0)
