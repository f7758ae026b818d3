"""Text typed into the number boxes of one page. `habits.js` sends it as it was typed; here it is
read, so that no sign of it is dropped on the way."""

import re
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import viser

from finlab.errors import FinlabError
from webapp.handles import Presses
from webapp.viser_internals import uuid_of

NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?", re.IGNORECASE | re.ASCII)
"""A number in decimal or scientific notation; point and comma both separate its decimals."""
MINUS = "−–"
"""Signs that people use as a minus, beside the hyphen."""
KINDS = (
    viser.GuiSliderHandle,
    viser.GuiNumberHandle,
    viser.GuiVector2Handle,
    viser.GuiVector3Handle,
)
"""Handles with number boxes."""
STEP_DIGITS = 9
"""Decimals to which a number is rounded after a step: 0.1 + 0.2 is 0.3."""
JUMPS = {"PageUp": (10, 0), "PageDown": (-10, 0), "Home": (0, -1), "End": (0, 1)}
"""Key -> steps of the handle that it goes, or to which end of its slider."""

Act = Callable[[Any], object]
"""Carries out what a value of a handle means, or raises a `FinlabError`."""


def number_of(text: str, label: str) -> float:
    """The number that a text says: `0,5` is 0.5, `1e3` is 1000.

    Args:
        text: as it was typed.
        label: of its box, for the sentence.

    Raises:
        FinlabError: it says none; a fraction is none, nor is an empty text.
    """
    plain = "".join(text.split())
    for sign in MINUS:
        plain = plain.replace(sign, "-")
    if not plain:
        raise FinlabError(f"{label}: the box was left empty; it needs a number, so nothing changed")
    if NUMBER.fullmatch(plain) is None:
        raise FinlabError(f"{label}: {text!r:.60} is no number; write 0.5, 0,5 or 5e-1")
    return float(plain.replace(",", "."))


class Owner(NamedTuple):
    """A handle with number boxes, and what a value of it does."""

    handle: Any
    act: Act
    may_be_empty: bool
    """Whether an empty box means None; its handle holds a single number."""
    widens: bool
    """Whether a number beyond the ends of the slider is asked as well."""


class NumberBoxes:
    """All of one page."""

    def __init__(
        self, presses: Presses, do: Callable[[Callable[[], object], Any], None], end: Act
    ) -> None:
        """Listen to the page.

        Args:
            presses: words of the page.
            do: carries out an act, by a handle.
            end: called before and after each: what is typed is a step of undo of its own.
        """
        self._do = do
        self._end = end
        self._owners: dict[str, Owner] = {}
        self.taken = 0
        """How many texts have been read."""
        presses.on("number", self._take)
        presses.on("jump", self._jump)

    def add(self, handle: Any, act: Act, may_be_empty: bool = False, widens: bool = False) -> None:
        """Let what is typed into the boxes of a handle do `act(value)`; arguments as in `Owner`.
        Handles without number boxes are left alone."""
        if isinstance(handle, KINDS):
            self._owners[uuid_of(handle)] = Owner(handle, act, may_be_empty, widens)

    def _take(self, key: str, text: str) -> None:
        """A text that was typed.

        Args:
            key: uuid of the handle, place of the box among its boxes, and steps of the handle to
                go on from the number.
            text: as it was typed.
        """
        uuid, place, steps = (*key.split(" "), "", "")[:3]
        owner = self._owners.get(uuid)
        if owner is None or not re.fullmatch(r"\d", place) or steps not in ("-1", "0", "1"):
            return  # not from our page
        self._do(partial(self._ask, owner, int(place), int(steps), text), owner.handle)
        self.taken += 1

    def _jump(self, key: str, text: str) -> None:
        """A key that moves a number by more than a step: ten steps, or to an end of its slider.

        Args:
            key: uuid of the handle, and place of the box among its boxes.
            text: name of the key, one of `JUMPS`.
        """
        uuid, place = (*key.split(" "), "")[:2]
        owner = self._owners.get(uuid)
        if owner is None or not re.fullmatch(r"\d", place) or text not in JUMPS:
            return  # not from our page
        self._do(partial(_jump_to, owner, int(place), text), owner.handle)

    def _ask(self, owner: Owner, place: int, steps: int, text: str) -> None:
        """Asks for what a text says."""
        handle = owner.handle
        old = handle.value
        self._end(None)
        if owner.may_be_empty and not text.strip():
            owner.act(None)
        elif isinstance(old, (tuple, list)):
            if place >= len(old):
                return
            values = list(old)
            label = f"{handle.label}, {place + 1} of {len(old)}"
            values[place] = _checked(owner, text, label, steps, place)
            owner.act(tuple(values))
        else:
            value = _checked(owner, text, handle.label, steps, None)
            owner.act(int(value) if isinstance(old, int) else value)
        self._end(None)


def _jump_to(owner: Owner, place: int, key: str) -> None:
    """Asks for the number that a key of `JUMPS` leads to from what is asked."""
    handle = owner.handle
    old = handle.value
    if not isinstance(old, (tuple, list)):
        value = _jumped(handle, old, key, None)
        new: Any = int(value) if isinstance(old, int) else value
    elif place < len(old):
        values = list(old)
        values[place] = _jumped(handle, old[place], key, place)
        new = tuple(values)
    else:
        return
    owner.act(new)
    handle.value = new  # a key that repeats goes on from here, before the page is written


def _jumped(handle: Any, old: float, key: str, place: int | None) -> float:
    """The number that a key leads to from another one, within the limits of its box."""
    low, high = _limits(handle, place)
    steps, end = JUMPS[key]
    value = old
    if end < 0 and low is not None:
        value = low
    elif end > 0 and high is not None:
        value = high
    elif steps:
        value = round(old + steps * (handle.step or 0.0), STEP_DIGITS)
    if low is not None:
        value = max(value, min(low, old))
    if high is not None:
        value = min(value, max(high, old))
    return float(value)


def _limits(handle: Any, place: int | None) -> tuple[Any, Any]:
    """Least and largest number of a handle, of several numbers that of a place; None for none."""
    low, high = (getattr(handle, name, None) for name in ("min", "max"))
    if place is not None:
        low, high = (None if end is None else end[place] for end in (low, high))
    return low, high


def _checked(owner: Owner, text: str, label: str, steps: int, place: int | None) -> float:
    """The number of a text, within the limits of its box, of several that of a place."""
    handle = owner.handle
    value = number_of(text, label)
    if steps:
        value = round(value + steps * (handle.step or 0.0), STEP_DIGITS)
    if isinstance(handle.value, int) and value != round(value):
        raise FinlabError(f"{label}: expected a whole number, got {text!r:.60}")
    low, high = _limits(handle, place)
    is_low = low is not None and value < low
    is_high = high is not None and value > high
    if (is_low or is_high) and not owner.widens:
        ends = f"at least {low:g}" if high is None else f"a number from {low:g} to {high:g}"
        raise FinlabError(f"{label}: expected {ends}, got {value:g}")
    return value
