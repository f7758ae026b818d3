"""How much of everything a report measures: `quick` in minutes, `full` in an hour."""

from dataclasses import dataclass
from typing import Any

Settings = dict[str, Any]

SEED = 6143
"""Of a report, unless another one is given; kept apart from those of development, as far as the section on
what is shown says."""
RERUN = 1000
"""Added to the seed for the rerun that stands beside the wrench tables."""


def cases(layouts: int, targets: int, **more: Any) -> Settings:
    """So many layouts, and targets on each."""
    return {"layouts": layouts, "targets": targets, **more}


@dataclass(frozen=True)
class Sizes:
    """Numbers of cases of a report."""

    name: str
    """`quick` or `full`."""
    of_table: dict[str, Settings]
    """Table -> settings of its jobs, as the functions of `work` take them; tables without any are left out.
    `wrench` has the splits that the paper has, `wrench-other` the others; methods of tenths of a second per
    target solve one on each layout of the former, and `wrench-slow` of the latter."""

    def of_split(self, *, main: bool, slow: bool) -> Settings:
        """Layouts and targets of a split for a quick or a slow method."""
        if main:
            return self.of_table["wrench"] | ({"targets": 1} if slow else {})
        return self.of_table["wrench-slow" if slow else "wrench-other"]


SHIPPED = ["A", "B", "C", "D", "ucat", "asymmetric", "penta", "hexa", "octo", "restricted", "pair"]
"""Layouts that follow smooth paths in a full report."""
SIZES = {
    "quick": Sizes(
        "quick",
        {
            "wrench": cases(16, 40),
            "wrench-other": cases(12, 10),
            "wrench-slow": cases(3, 1),
            "rerun": cases(6, 10),
            "cost": cases(3, 1),
            "network": cases(4, 4, fins=[4, 8, 12]),
            "modes": cases(6, 1, starts=32),
            "unreachable": {"layouts": 8},
            "beyond": cases(4, 2),
            "steadiness": {"layouts": ["A", "hexa"], "paths": 1, "ticks": 100},
            "sequences": {"layouts": ["A"], "paths": 1, "ticks": 60},
            "latency": {"calls": 40, "budget_s": 1.0},
            "first_answers": {"robots": 1},
            "trajectory": {"runs": 1},
            "faults": {"runs": 1, "pairs": False},
            "velocity": {"runs": 1},
            "swims": {"scenarios": "square,restricted,saturated", "seeds": 1},
            "ablation": cases(20, 10),
            "temperature": cases(15, 2),
            "training": cases(20, 10, preset="smoke", steps=160, batch_size=128),
        },
    ),
    "full": Sizes(
        "full",
        {
            "wrench": cases(100, 1000),
            "wrench-other": cases(100, 50),
            "wrench-slow": cases(25, 1),
            "rerun": cases(25, 40),
            "cost": cases(20, 2),
            "network": cases(20, 15, fins=[3, 4, 5, 6, 8, 10, 12]),
            "modes": cases(20, 2, starts=256),
            "unreachable": {"layouts": 50},
            "beyond": cases(25, 4),
            "steadiness": {"layouts": SHIPPED, "paths": 3, "ticks": 600},
            "sequences": {"layouts": ["A", "hexa", "restricted"], "paths": 2, "ticks": 300},
            "latency": {"calls": 200, "budget_s": 20.0},
            "first_answers": {"robots": 5},
            "trajectory": {"runs": 2},
            "faults": {"runs": 1, "pairs": True},
            "velocity": {"runs": 5},
            "swims": {"scenarios": "all", "seeds": 5},
            "ablation": cases(60, 20),
            "temperature": cases(100, 2),
            "training": cases(40, 25, preset="paper", steps=300, batch_size=256),
        },
    ),
}
"""Name -> sizes."""
