"""Control allocation: a target wrench in, one command per actuator out.

Names are imported on first use: an answer that comes from elsewhere needs no allocator.
"""

from pkgutil import resolve_name
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from finlab.allocation.allocation import Allocation as Allocation
    from finlab.allocation.allocation import BatchAllocation as BatchAllocation
    from finlab.allocation.allocator import Allocator as Allocator
    from finlab.allocation.methods import METHODS as METHODS
    from finlab.allocation.methods import MethodName as MethodName
    from finlab.allocation.policy import Policy as Policy
    from finlab.allocation.policy import PolicyName as PolicyName
    from finlab.allocation.solution import Candidates as Candidates
    from finlab.allocation.solution import Solution as Solution

_MODULE_OF_NAME = {
    "METHODS": "methods",
    "Allocation": "allocation",
    "Allocator": "allocator",
    "BatchAllocation": "allocation",
    "Candidates": "solution",
    "MethodName": "methods",
    "Policy": "policy",
    "PolicyName": "policy",
    "Solution": "solution",
}
"""Where each public name stands."""

__all__ = [
    "METHODS",
    "Allocation",
    "Allocator",
    "BatchAllocation",
    "Candidates",
    "MethodName",
    "Policy",
    "PolicyName",
    "Solution",
]


def __getattr__(name: str) -> object:
    if name not in _MODULE_OF_NAME:
        raise AttributeError(f"module 'finlab.allocation' has no attribute {name!r}")
    return resolve_name(f"finlab.allocation.{_MODULE_OF_NAME[name]}:{name}")
