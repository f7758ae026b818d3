"""Hard days that any robot can swim: those of `finlab eval swims` that need no robot of their own."""

from finlab.assets import PAPER_LAYOUTS
from finlab.evaluation.experiments.hard_days import CURRENT, HARD_DAYS, TWO, HardDay
from finlab.sim import SteadyCurrent

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
