"""viser's event loop as one page uses it: once the page has gone, nothing of it runs any more."""

import asyncio
from collections.abc import Callable


class EventLoop:
    """Brings calls to the event loop that all sessions and widgets belong to."""

    def __init__(self, loop: asyncio.AbstractEventLoop, fault: Callable[[Exception], None]) -> None:
        """`fault` is called there with what a call has raised: the page must go on."""
        self._loop, self._fault = loop, fault
        self._closed = False

    def post(self, act: Callable[[], object]) -> None:
        """Run `act` on the loop soon; called from any thread."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._run, act)

    def later(self, seconds: float, act: Callable[[], object]) -> asyncio.TimerHandle:
        """Run `act` after some time; called on the loop."""
        return self._loop.call_later(seconds, self._run, act)

    def close(self) -> None:
        """The page has gone."""
        self._closed = True

    def _run(self, act: Callable[[], object]) -> None:
        if self._closed:
            return
        try:
            act()
        except Exception as error:
            self._fault(error)
