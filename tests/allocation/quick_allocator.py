"""Every method with settings that answer quickly, for tests of what methods have in common."""

from typing import Any

from finlab.allocation import METHODS
from finlab.allocation.methods import method_class
from tests.allocator_cache import AllocatorCache

OF_FINS = tuple(name for name in METHODS if method_class(name).takes != "thrusters")
"""Methods that take robots of fins."""

QUICK_SETTINGS: dict[str, dict[str, Any]] = {
    "paper": {"n_candidates": 4, "n_steps": 2},
    "ipopt": {"n_starts": 1},
    "sqp": {"n_starts": 1, "n_steps": 5},
    "paper_sqp": {"n_starts": 1, "n_steps": 5},
}
"""Method -> settings by which it answers quickly; all others do so by themselves."""


def quick_allocator(method: str) -> AllocatorCache:
    """The allocator of a method, with few starts and steps."""
    return AllocatorCache(method, **QUICK_SETTINGS.get(method, {}))
