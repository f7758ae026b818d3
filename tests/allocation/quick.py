"""Every method with settings that answer quickly, for tests of what methods have in common."""

from typing import Any

from tests.any_robot import AnyRobot

QUICK: dict[str, dict[str, Any]] = {
    "paper": {"n_candidates": 4, "n_steps": 2},
    "ipopt": {"n_starts": 1},
    "sqp": {"n_starts": 1, "n_steps": 5},
}


def quick_allocator(method: str) -> AnyRobot:
    """The allocator of a method, with few starts and steps."""
    return AnyRobot(method, **QUICK.get(method, {}))
