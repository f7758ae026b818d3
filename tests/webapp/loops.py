"""Event loops for tests without one."""

import asyncio
from collections.abc import Callable
from typing import Any

from webapp.tasks.background import EventLoop


class AtOnce(EventLoop):
    """Runs everything where it is posted from; its timers ring by hand."""

    def __init__(self) -> None:
        """Nothing is waiting."""
        self.ring: Callable[[], object] = lambda: None

    def post(self, act: Callable[[], object]) -> None:
        """Run it now."""
        act()

    def later(self, seconds: float, act: Callable[[], object]) -> Any:
        """Keep it until somebody rings."""
        self.ring = act
        return type("Timer", (), {"cancel": lambda _: None})()


def raised(error: Exception) -> None:
    """In place of a page that tells of faults."""
    raise error


def running() -> EventLoop:
    """The loop that runs, as a page uses it."""
    return EventLoop(asyncio.get_running_loop(), raised)
