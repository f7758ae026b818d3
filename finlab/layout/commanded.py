"""Limits, rates, axes and uncertainty of actuators, in fields of their own."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from finlab.layout.axes import Vector, axes_across, cross
from finlab.layout.checked import Checked, Name


@dataclass(frozen=True)
class Uncertainty(Checked):
    """Standard deviation of an actuator's force. Checked on construction.

    Along each own direction of the actuator it is the root of (share |F|)^2 + floor^2 at a force F.
    """

    KEYS: ClassVar[Mapping[str, str]] = {"floor": "floor_n"}

    share: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    """Its part that grows with the force, as a share of the force."""
    floor: Annotated[float, Meta(ge=0.0, le=1e6)] = 0.0
    """Its part that is there at any force [N]."""
    common: Name | None = None
    """Name of what the error comes from, such as a fit or a measurement; actuators of one name err together,
    by the same share along and across their forces. None for an actuator that errs by itself."""
    correlation: Annotated[float, Meta(ge=0.0, le=1.0)] = 1.0
    """Share of the error's variance that actuators of one `common` have together."""


class Commanded(Checked):
    """Base of actuators; `Checked` otherwise."""

    LIMITS: ClassVar[tuple[str, ...]]
    """Fields with the least and greatest of each command."""
    RATES: ClassVar[tuple[str, ...]]
    """Fields with how fast each command changes at most; None in one where nothing limits it."""
    PUSHES: ClassVar[tuple[int, ...]]
    """Own axes along which it pushes at will; a rudder, ahead, along shaft x zero."""
    HELD: ClassVar[int] = 0
    """Which command stays as it is where it sticks."""
    LAGS: ClassVar[int] = 0
    """Which command it follows with its time constant; another one at its rate."""
    AXES: ClassVar[tuple[str, ...]] = ()
    """Fields with two own axes that stand across each other."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.AXES:
            first, second = ((name, getattr(self, name)) for name in self.AXES)
            for (name, _), axis in zip((first, second), axes_across(first, second), strict=True):
                object.__setattr__(self, name, axis)

    @property
    def lower(self) -> Vector:
        """Least command (3,), in radians and newtons; what the actuator does not have is 0."""
        return _three([getattr(self, name)[0] for name in self.LIMITS], 0.0)

    @property
    def upper(self) -> Vector:
        """Greatest command, as `lower`."""
        return _three([getattr(self, name)[1] for name in self.LIMITS], 0.0)

    @property
    def rates(self) -> Vector:
        """Fastest changes of the command [rad/s, N/s]; infinite where nothing limits them."""
        return _three([getattr(self, name) or math.inf for name in self.RATES], math.inf)

    @property
    def frame(self) -> tuple[Vector, Vector, Vector]:
        """Own axes in the body frame: the two of `AXES`, and the first x the second."""
        first, second = (getattr(self, name) for name in self.AXES)
        return first, second, cross(first, second)


def _three(values: list[Any], rest: float) -> Vector:
    first, second, third = (*values, rest, rest, rest)[:3]
    return first, second, third
