"""Settings of methods: one frozen dataclass for each, whose fields carry range, unit and meaning.

All that asks for settings (a call, a bundle, the app) makes such an object, which checks itself.
"""

from dataclasses import Field, dataclass, field, fields
from numbers import Integral, Real
from typing import Any, ClassVar, NamedTuple

from finlab.errors import AllocationError
from finlab.physics.objective import Name

USUAL_PERIOD_S = 0.1
"""Time between ticks of methods for which it is no setting [s]."""
MOST_CANDIDATES = 4096
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
        first, then = ("above", "up to") if self.above else ("from", "to")
        return f"{kind} {first} {self.low:g} {then} {self.high:g} {self.unit}".rstrip()


def number(
    default: float | None,
    low: float,
    high: float,
    meaning: str,
    unit: str = "",
    *,
    above: bool = False,
) -> Any:
    """A field that is a number within a range, a whole one where `low` is; None only as the
    default."""
    return field(default=default, metadata={"range": Range(low, high, meaning, unit, above)})


def choice(default: str, choices: tuple[str, ...], meaning: str) -> Any:
    """A field that is one of some words."""
    return field(default=default, metadata={"choices": choices, "meaning": meaning})


def switch(default: bool, meaning: str) -> Any:
    """A field that is true or false."""
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Settings:
    """Settings of a method that has none; base of all others. Raises AllocationError: a value of
    the wrong kind, or out of its range."""

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, _checked(each, getattr(self, each.name)))


def _checked(setting: "Field[Any]", value: Any) -> Any:
    """The value of a field, of the kind that is meant."""
    choices = setting.metadata.get("choices")
    limits = setting.metadata.get("range")
    if limits is not None:
        return _within(setting, limits, value)
    if isinstance(value, bool) if choices is None else value in choices:
        return value
    expected = "true or false" if choices is None else f"one of {', '.join(choices)}"
    raise AllocationError(f"{setting.name}: expected {expected}, got {value!r:.60}")


def _within(setting: "Field[Any]", limits: Range, value: Any) -> float | None:
    if value is None and setting.default is None:
        return None
    integer = isinstance(limits.low, int)
    kind: Any = Integral if integer else Real
    right = isinstance(value, kind) and not isinstance(value, bool)
    if right and limits.low <= value <= limits.high and not (limits.above and value == limits.low):
        return int(value) if integer else float(value)
    raise AllocationError(
        f"{setting.name}: expected {limits}, got {value!r:.60} ({limits.meaning})"
    )


@dataclass(frozen=True)
class MdnSettings(Settings):
    """Settings of method `mdn`: how many ways the mixture proposes, and how many of them are
    refined."""

    objective: ClassVar[Name] = "effort"
    """What is kept least."""
    n_candidates: int = number(
        48, 1, MOST_CANDIDATES, "proposals K: the components' means by falling weight, then samples"
    )
    n_refined: int = number(6, 1, 256, "proposals that are refined and offered as candidates")
    temperature: float = number(
        1.0, 0.0, 100.0, "what the variances of the samples are multiplied by"
    )
    period_s: float = number(0.1, 0.0, 1000.0, "time between ticks", "s", above=True)
