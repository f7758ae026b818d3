"""Limits of a fin's commands, and the models of its force, by name and parameters.

`fin_laws` makes a law of a model; layout files, the app and the fits read what is here.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Union

from msgspec import Meta, Struct, defstruct

from finlab.axes import FULL_TURN_TOLERANCE, TURN
from finlab.errors import LayoutError
from finlab.files.schema import Checked, Part, checked, given

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

MAX_AMPLITUDE = math.pi / 2
"""Largest half amplitude a layout may allow [rad]; beyond it the fin would beat through the
hull."""
MAX_FREQUENCY = 20.0
"""Largest frequency a layout may allow [Hz]; ten times what such servos reach."""

DOUBT = "not to be trusted"
"""How a table's note begins that every answer repeats."""

Amplitude = Annotated[float, Meta(ge=0.0, le=MAX_AMPLITUDE)]
"""A half amplitude [rad]."""
Frequency = Annotated[float, Meta(ge=0.0, le=MAX_FREQUENCY)]
"""A frequency of the beat [Hz]."""
Direction = Annotated[float, Meta(ge=-TURN, le=TURN)]
"""A zero direction [rad]."""
LEAST = {"amplitude": 1e-4, "frequency": 1e-3}
"""Least amplitude [rad] and frequency [Hz] other than 0."""
LEAST_WIDTH = 1e-6
"""Least width of a range [rad, Hz, rad] other than 0."""


@dataclass(frozen=True)
class Limits(Checked):
    """Limits of one fin's command; the defaults are the nominal ones. Checked on construction.

    Args:
        amplitude: least and greatest half amplitude [rad].
        frequency: least and greatest frequency [Hz].
        zero_direction: least and greatest zero direction, at most one turn apart; a full turn means
            any direction [rad].

    Raises:
        LayoutError: a value is out of its bounds, or the two of a range do not fit together; the
            message names the argument.
    """

    KEYS: ClassVar[Mapping[str, str]] = {
        "amplitude": "amplitude_rad",
        "frequency": "frequency_hz",
        "zero_direction": "zero_direction_rad",
    }
    WRITTEN: ClassVar[Collection[str]] = ("amplitude", "frequency", "zero_direction")

    amplitude: tuple[Amplitude, Amplitude] = (0.05, 0.6)
    frequency: tuple[Frequency, Frequency] = (0.1, 2.1)
    zero_direction: tuple[Direction, Direction] = (-math.pi, math.pi)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.KEYS:
            low, high = getattr(self, name)
            if low > high:
                raise LayoutError(f"minimum {low:g} is above maximum {high:g}; swap them", name)
            if name != "zero_direction" and (high < LEAST[name] or 0.0 < low < LEAST[name]):
                raise LayoutError(
                    f"the maximum must be at least {LEAST[name]:g}, the minimum 0 or as much, got "
                    f"{low:g} and {high:g}; leave the fin out if it never moves",
                    name,
                )
            if 0.0 < high - low < LEAST_WIDTH:
                raise LayoutError(
                    f"must span 0 or at least {LEAST_WIDTH:g}, got {high - low:g}; write one "
                    "value twice",
                    name,
                )
        width = self.zero_direction[1] - self.zero_direction[0]
        if width > TURN + FULL_TURN_TOLERANCE:
            raise LayoutError(
                f"must span at most one turn (6.2832), got {width:.4f}", "zero_direction"
            )

    @property
    def lower(self) -> tuple[float, float, float]:
        """Least (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.amplitude[0], self.frequency[0], self.zero_direction[0]

    @property
    def upper(self) -> tuple[float, float, float]:
        """Greatest (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.amplitude[1], self.frequency[1], self.zero_direction[1]


@dataclass(frozen=True)
class Parameter:
    """One number of a fin's model.

    Args:
        default: its value where a layout file leaves it out.
        meaning: what it is, in a few words.
        unit: its unit; empty where it has none.
        low: least value that a robot's fin may have.
        high: greatest value.
    """

    default: float
    meaning: str
    unit: str = ""
    low: float = 0.001
    high: float = 10.0


_DENSITY = Parameter(1000.0, "density of the water", "kg/m^3", 500.0, 2000.0)

FIN_MODELS: Mapping[str, Mapping[str, Parameter]] = {
    "drag": {
        "density": _DENSITY,
        "drag_coefficient": Parameter(0.15, "drag coefficient of the blade", "", 0.01),
        "area": Parameter(0.02, "area of the blade", "m^2", 1e-5),
        "lever": Parameter(0.1, "distance of the blade's centre from the shaft", "m"),
    },
    "lighthill": {
        "density": _DENSITY,
        "length": Parameter(0.20, "length of the fin from the shaft", "m"),
        "width": Parameter(0.10, "width of the trailing edge", "m"),
    },
    "soft": {
        "k": Parameter(3.6, "thrust at A f = 1 rad Hz, before it saturates", "N", 1e-4, 1e5),
        "p": Parameter(1.0, "exponent with which thrust grows with A f", low=0.5, high=4.0),
        "x0": Parameter(1.3, "A f from which thrust saturates and falls", "rad Hz", 0.01, 100.0),
        "q": Parameter(5.0, "exponent of that fall", low=0.1, high=20.0),
        "e": Parameter(0.0, "share by which thrust differs with direction", low=0.0, high=0.99),
        "phi_e": Parameter(0.0, "zero direction of the largest thrust", "rad", -10.0, 10.0),
        "d": Parameter(0.0, "angle from zero direction to thrust", "rad", -1.5, 1.5),
    },
    # Its one parameter, `path`, is the text that names a CSV file of forces; it has no default.
    "table": {},
}
"""The fin models there are, by name, with their numeric parameters."""

SCALES_THRUST: Mapping[str, tuple[str, float]] = {
    "drag": ("area", 1.0),
    "lighthill": ("width", 0.5),
    "soft": ("k", 1.0),
}
"""The parameter by which a model's thrust is made larger or smaller, and its exponent."""


@dataclass(frozen=True)
class FinModelSpec(Part):
    """Name and parameters of a fin model, as a layout file gives them. Checked on construction.

    Args:
        type: one of `FIN_MODELS`.
        parameters: parameters that differ from the model's defaults, as (name, value), sorted by
            name; units as in `FIN_MODELS`.

    Raises:
        LayoutError: unknown model, unknown parameter, or a value out of its bounds.
    """

    type: str = "drag"
    parameters: tuple[tuple[str, float | str], ...] = ()

    def __post_init__(self) -> None:
        model: Any = checked({**dict(self.parameters), "type": self.type}, Model)
        object.__setattr__(self, "parameters", tuple(sorted(given(model).items())))

    @classmethod
    def file_form(cls) -> Any:
        return Model

    @classmethod
    def from_file(cls, tag: str, values: dict[str, Any], may_open: bool) -> "Self":
        return cls(tag, tuple(values.items()))

    @classmethod
    def from_values(cls, values: Mapping[str, float | str]) -> "FinModelSpec":
        """Returns the spec of a mapping with the model's name under `type` and its parameters by
        name. Raises LayoutError: as on construction."""
        parameters = {key: value for key, value in values.items() if key != "type"}
        return cls(str(values["type"]), tuple(parameters.items()))

    def scaled(self, share: float) -> "FinModelSpec":
        """Returns the model of a fin whose thrust is `share` of this one's at every command. Raises
        LayoutError: it is a table, which cannot be scaled."""
        if self.type not in SCALES_THRUST:
            raise LayoutError(
                "the thrust of a table cannot be scaled; name another CSV file", "type"
            )
        name, exponent = SCALES_THRUST[self.type]
        rule = FIN_MODELS[self.type][name]
        value = min(max(float(self.values()[name]) * share**exponent, rule.low), rule.high)
        return FinModelSpec(self.type, tuple({**dict(self.parameters), name: value}.items()))

    def values(self) -> dict[str, float | str]:
        """Returns all parameters of the model by name, with defaults for those left out."""
        defaults = {name: rule.default for name, rule in FIN_MODELS[self.type].items()}
        return {**defaults, **dict(self.parameters)}


def _form(name: str, parameters: Mapping[str, Parameter]) -> type[Struct]:
    """The part of a layout file that holds the parameters of a model."""
    path = Annotated[str, Meta(min_length=1, max_length=4096, description="a CSV file of forces")]
    keys: list[Any] = [("path", path)] if name == "table" else []
    for key, rule in parameters.items():
        about = f"{rule.meaning}{rule.unit and f' [{rule.unit}]'}; {rule.default:g} when left out"
        kind = Annotated[float, Meta(ge=rule.low, le=rule.high, description=about)]
        keys.append((key, kind | None, None))
    return defstruct(
        f"{name.title()}Model",
        keys,
        tag=name,
        tag_field="type",
        forbid_unknown_fields=True,
        namespace={"stands_for": FinModelSpec},
    )


Model: Any = Union[tuple(_form(name, parameters) for name, parameters in FIN_MODELS.items())]  # noqa: UP007
"""A fin model in a file: keys and values, among them its `type`."""
