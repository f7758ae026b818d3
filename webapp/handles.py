"""Writing to viser's handles, and hearing from them."""

from collections.abc import Callable
from typing import Any

import numpy as np
import viser
from markupsafe import escape


def add_html(gui: viser.GuiApi, content: str) -> viser.GuiHtmlHandle:
    """Markup in the page; what is not marked as such is text."""
    return gui.add_html(str(escape(content)))


def put(handle: Any, **values: Any) -> None:
    """Set properties of a handle, but only those that differ, so that an unchanged page gets no message.

    Content that is not marked as markup is text.
    """
    for key, value in values.items():
        if key == "content":
            value = str(escape(value))
        if not _same(getattr(handle, key), value):
            setattr(handle, key, value)


def _same(old: Any, new: Any) -> bool:
    if isinstance(old, np.ndarray) or isinstance(new, np.ndarray):
        return np.array_equal(np.asarray(old), np.asarray(new))
    return bool(old == new)


def on_user_change(handle: Any, act: Callable[[Any], None]) -> None:
    """Call `act(value)` on the event loop when the user changes an input; our own writes are not heard.

    Values of another kind than the input's own are not from our page: the input goes back to what it held.
    Whether a number makes sense is for the session to say.
    """
    honest = handle.value
    buttons = isinstance(handle, viser.GuiButtonGroupHandle)

    async def changed(event: Any) -> None:
        nonlocal honest
        if event.client is None:
            return
        value = event.target.value
        if _alike(honest, value):
            act(value)
            honest = event.target.value  # what the session has refused is corrected by now
        elif not buttons:
            handle.value = honest

    # A group of buttons is an input whose value is the button that was pressed last.
    listen = handle.on_click if buttons else handle.on_update
    listen(changed)


def _alike(known: Any, value: Any) -> bool:
    """Whether two values are of the same kind: texts, switches, numbers, or as many numbers."""
    if isinstance(known, (tuple, list)):
        listed = isinstance(value, (tuple, list)) and len(value) == len(known)
        return listed and all(_alike(a, b) for a, b in zip(known, value, strict=True))
    if isinstance(known, bool) or isinstance(value, bool):
        return isinstance(known, bool) and isinstance(value, bool)
    kind = (int, float) if isinstance(known, (int, float)) else str
    return isinstance(value, kind)


def numbered(button: str, count: int) -> int | None:
    """Place that a numbered button stands for (`3`, `3 ✕`: 2), of `count`; None for any other text."""
    number, numbers = button.split(" ")[0], [str(k + 1) for k in range(count)]
    return numbers.index(number) if number in numbers else None
