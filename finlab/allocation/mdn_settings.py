"""What can be set of method `mdn`."""

from dataclasses import dataclass
from typing import ClassVar

from finlab.allocation.settings import MOST_CANDIDATES, Settings, number
from finlab.physics.objective import Name


@dataclass(frozen=True)
class MdnSettings(Settings):
    """How many ways the mixture proposes, and how many of them are refined."""

    objective: ClassVar[Name] = "effort"
    """What is kept least."""
    n_candidates: int = number(
        48, 1, MOST_CANDIDATES, "proposals K: the components' means by falling weight, then samples"
    )
    n_refined: int = number(6, 1, 256, "proposals that are refined and offered as candidates")
    temperature: float = number(1.0, 0.0, 100.0, "what the variances of the samples are multiplied by")
    period_s: float = number(0.1, 0.0, 1000.0, "time between ticks", "s", above=True)
