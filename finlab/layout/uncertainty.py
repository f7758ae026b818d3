"""How far the force of an actuator may be from what its law or table says."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from msgspec import Meta

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
