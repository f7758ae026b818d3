"""Control allocation: a target wrench in, one command per actuator out.

Names are imported on first use: an answer that comes from elsewhere needs no allocator.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from finlab.allocation.allocation import Allocation as Allocation
    from finlab.allocation.allocation import BatchAllocation as BatchAllocation
    from finlab.allocation.allocator import Allocator as Allocator
    from finlab.allocation.methods import METHODS as METHODS
    from finlab.allocation.policy import Policy as Policy
    from finlab.allocation.solution import Candidates as Candidates
    from finlab.allocation.solution import Solution as Solution
    from finlab.layout.damage import Health as Health

_HOME = {
    "Allocation": "finlab.allocation.allocation",
    "BatchAllocation": "finlab.allocation.allocation",
    "Allocator": "finlab.allocation.allocator",
    "METHODS": "finlab.allocation.methods",
    "Policy": "finlab.allocation.policy",
    "Candidates": "finlab.allocation.solution",
    "Solution": "finlab.allocation.solution",
    "Health": "finlab.layout.damage",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'finlab.allocation' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
