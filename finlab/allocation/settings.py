"""What settings of methods are made of: a frozen dataclass for each method, whose fields carry
range, unit and meaning.

All that asks for settings (a call, a bundle, the app) makes such an object, which checks itself.
The settings of a method stand in the file of its class.
"""

from dataclasses import Field, dataclass, field, fields
from numbers import Integral, Real
from typing import Any, NamedTuple

from finlab.errors import AllocationError

USUAL_PERIOD_S = 0.1
"""Time between ticks of methods for which it is no setting [s]."""
MAX_CANDIDATES = 4096
"""Most candidates that may be drawn; more would keep a robot from answering."""


class Range(NamedTuple):
    """What a setting may be."""

    low: float
    """Least value; a whole number where only whole numbers are meant."""
    high: float
    """Largest value."""
    meaning: str
    """What it is, in words."""
    unit: str = ""
    """Its unit."""
    above: bool = False
    """Whether the least value itself is too little."""

    def __str__(self) -> str:
        kind = "a whole number" if isinstance(self.low, int) else "a number"
        low = f"above {self.low:g} up to" if self.above else f"from {self.low:g} to"
        return f"{kind} {low} {self.high:g} {self.unit}".rstrip()


def number(
    default: float | None,
    low: float,
    high: float,
    meaning: str,
    unit: str = "",
    *,
    above: bool = False,
) -> Any:
    """Makes a field that is a number within a range.

    Args:
        default: its usual value; where it is None, None is taken besides.
        low: least value; only whole numbers are taken where it is one.
        high: largest value.
        meaning: what it is, in words that follow its name.
        unit: of the value.
        above: whether the least value itself is too little.

    Returns:
        The field of a dataclass.
    """
    return field(default=default, metadata={"range": Range(low, high, meaning, unit, above)})


def choice(default: str, choices: tuple[str, ...], meaning: str) -> Any:
    """Makes a field that is one of some words.

    Args:
        default: its usual value.
        choices: all of them.
        meaning: what it is, in words that follow its name.

    Returns:
        The field of a dataclass.
    """
    return field(default=default, metadata={"choices": choices, "meaning": meaning})


def switch(default: bool, meaning: str) -> Any:
    """Makes a field that is true or false.

    Args:
        default: its usual value.
        meaning: what it is, in words that follow its name.

    Returns:
        The field of a dataclass.
    """
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Settings:
    """Settings of a method that has none; base of all others.

    Raises:
        AllocationError: a value is of the wrong kind, or out of its range.
    """

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, _checked(each, getattr(self, each.name)))


def _checked(setting: "Field[Any]", value: Any) -> Any:
    """Returns the value of a field, of the kind that is meant."""
    limits = setting.metadata.get("range")
    if limits is not None:
        return _within(setting, limits, value)
    choices = setting.metadata.get("choices")
    if choices is None:
        is_right = isinstance(value, bool)
        expected = "true or false"
    else:
        is_right = value in choices
        expected = f"one of {', '.join(choices)}"
    if is_right:
        return value
    raise AllocationError(f"{setting.name}: expected {expected}, got {value!r:.60}")


def _within(setting: "Field[Any]", limits: Range, value: Any) -> float | None:
    """Returns the number of a field, whole where that is meant."""
    if value is None and setting.default is None:
        return None
    is_whole = isinstance(limits.low, int)
    kind: Any = Integral if is_whole else Real
    is_number = isinstance(value, kind) and not isinstance(value, bool)
    if is_number and limits.low <= value <= limits.high:
        is_too_little = limits.above and value == limits.low
        if not is_too_little:
            return int(value) if is_whole else float(value)
    raise AllocationError(
        f"{setting.name}: expected {limits}, got {value!r:.60} ({limits.meaning})"
    )
