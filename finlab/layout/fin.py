"""Which fin model a fin follows, by name and numbers; the formulas live in `finlab.physics`."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from finlab.errors import LayoutError
from finlab.layout.angles import FULL_TURN_TOLERANCE, TURN
from finlab.layout.rules import MAX_NAME_LENGTH, interval, number, numbers, text
from finlab.layout.servo import Servo


@dataclass(frozen=True)
class Parameter:
    """One number of a fin model."""

    default: float
    """Its value where a layout file leaves it out."""
    meaning: str
    """What it is, in a few words."""
    unit: str = ""
    """Its unit; empty where it has none."""
    low: float = 0.0
    """Least value; must be exceeded if `positive`."""
    high: float = 1e6
    """Greatest value."""
    positive: bool = True
    """Whether it must be above zero."""


_DENSITY = Parameter(1000.0, "density of the water", "kg/m^3")

FIN_MODELS: Mapping[str, Mapping[str, Parameter]] = {
    "drag": {
        "density": _DENSITY,
        "drag_coefficient": Parameter(0.15, "drag coefficient of the blade"),
        "area": Parameter(0.02, "area of the blade", "m^2"),
        "lever": Parameter(0.1, "distance of the blade's centre from the shaft", "m"),
    },
    "lighthill": {
        "density": _DENSITY,
        "length": Parameter(0.20, "length of the fin from the shaft", "m"),
        "width": Parameter(0.10, "width of the trailing edge", "m"),
    },
    "soft": {
        "k": Parameter(3.6, "thrust at A f = 1 rad Hz, before it saturates", "N"),
        "p": Parameter(1.0, "exponent with which thrust grows with A f", low=0.5, high=4.0),
        "x0": Parameter(1.3, "A f from which thrust saturates and falls", "rad Hz"),
        "q": Parameter(5.0, "exponent of that fall", high=20.0),
        "e": Parameter(0.0, "share by which thrust differs with direction", high=0.99, positive=False),
        "phi_e": Parameter(0.0, "zero direction of the largest thrust", "rad", -10.0, 10.0, positive=False),
        "d": Parameter(0.0, "angle from zero direction to thrust", "rad", -1.5, 1.5, positive=False),
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
class FinModelSpec:
    """Name and parameters of a fin model, as a layout file gives them. Checked on construction."""

    type: str = "drag"
    """One of `FIN_MODELS`."""
    parameters: tuple[tuple[str, float | str], ...] = ()
    """Parameters that differ from the model's defaults, as (name, value), sorted by name."""

    def __post_init__(self) -> None:
        if self.type not in FIN_MODELS:
            known = ", ".join(FIN_MODELS)
            raise LayoutError(f"unknown fin model {self.type!r:.60}, expected one of {known}", "type")
        known_names = ["path"] if self.type == "table" else list(FIN_MODELS[self.type])
        checked: list[tuple[str, float | str]] = []
        for name, value in sorted(self.parameters):
            if name not in known_names:
                raise LayoutError(f"unknown key, {self.type} takes {', '.join(known_names)}", name)
            if name == "path":
                checked.append((name, text(value, name, 4096)))
            else:
                rule = FIN_MODELS[self.type][name]
                checked.append((name, number(value, name, rule.low, rule.high, rule.positive)))
        if self.type == "table" and not checked:
            raise LayoutError("required key is missing; name the CSV file of forces", "path")
        object.__setattr__(self, "parameters", tuple(checked))

    @classmethod
    def from_values(cls, values: Mapping[str, float | str]) -> "FinModelSpec":
        """The spec of a mapping with the model's name under `type` and its parameters beside it.

        Raises:
            LayoutError: unknown model, unknown parameter, or a value that is none.
        """
        return cls(str(values["type"]), tuple((k, v) for k, v in values.items() if k != "type"))

    def scaled(self, share: float) -> "FinModelSpec":
        """The model of a fin that gives a share of the thrust at every command.

        Raises:
            LayoutError: the fin is a table, whose file would have to be another one.
        """
        if self.type not in SCALES_THRUST:
            raise LayoutError("the thrust of a table cannot be scaled; name another CSV file", "type")
        name, exponent = SCALES_THRUST[self.type]
        value = float(self.values()[name]) * share**exponent
        return FinModelSpec(self.type, tuple({**dict(self.parameters), name: value}.items()))

    def values(self) -> dict[str, float | str]:
        """Returns all parameters of the model, those given and those left at their defaults."""
        defaults = {name: rule.default for name, rule in FIN_MODELS[self.type].items()}
        return {**defaults, **dict(self.parameters)}


MAX_AMPLITUDE = math.pi / 2
"""Largest half amplitude a layout may allow [rad]; beyond it the fin would beat through the hull."""
MAX_FREQUENCY = 20.0
"""Largest frequency a layout may allow [Hz]; ten times what such servos reach."""
MAX_POSITION = 10.0
"""Largest coordinate of a fin [m]."""


@dataclass(frozen=True)
class Limits:
    """What one fin may be commanded. The defaults are the nominal limits. Checked on construction."""

    amplitude: tuple[float, float] = (0.05, 0.6)
    """Half amplitude [rad], (minimum, maximum); the maximum is above 0."""
    frequency: tuple[float, float] = (0.1, 2.1)
    """Frequency [Hz], (minimum, maximum); the maximum is above 0."""
    zero_direction: tuple[float, float] = (-math.pi, math.pi)
    """Zero direction [rad], (minimum, maximum), at most one turn apart; a full turn means any direction."""

    def __post_init__(self) -> None:
        amplitude = interval(self.amplitude, "amplitude_rad", 0.0, MAX_AMPLITUDE)
        frequency = interval(self.frequency, "frequency_hz", 0.0, MAX_FREQUENCY)
        zero_direction = interval(self.zero_direction, "zero_direction_rad", -2 * math.pi, 2 * math.pi)
        # The energy proxy divides by these two maxima.
        for key, (_, most) in (("amplitude_rad", amplitude), ("frequency_hz", frequency)):
            if most <= 0.0:
                raise LayoutError("the maximum must be above 0; leave the fin out if it never moves", key)
        width = zero_direction[1] - zero_direction[0]
        if width > TURN + FULL_TURN_TOLERANCE:
            raise LayoutError(f"must span at most one turn (6.2832), got {width:.4f}", "zero_direction_rad")
        object.__setattr__(self, "amplitude", amplitude)
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "zero_direction", zero_direction)

    @property
    def lower(self) -> tuple[float, float, float]:
        """Least (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.amplitude[0], self.frequency[0], self.zero_direction[0]

    @property
    def upper(self) -> tuple[float, float, float]:
        """Greatest (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.amplitude[1], self.frequency[1], self.zero_direction[1]


@dataclass(frozen=True)
class Fin:
    """One fin on the hull. Checked on construction."""

    name: str
    """Unique within its layout; `--failed NAME` and the app refer to it."""
    position: tuple[float, float, float]
    """Where the fin's force acts, body frame (x forward, y left, z up from the centre of gravity) [m]."""
    mounting_angle: float
    """Azimuth of the shaft in the body xy plane, from +x, counter-clockwise [rad]."""
    limits: Limits = Limits()
    """What the fin may be commanded."""
    model: FinModelSpec = FinModelSpec()
    """Which law gives its force."""
    servo: Servo = Servo()
    """How fast it comes to what is commanded."""

    def __post_init__(self) -> None:
        x, y, z = numbers(self.position, "position_m", 3, -MAX_POSITION, MAX_POSITION)
        object.__setattr__(self, "name", text(self.name, "name", MAX_NAME_LENGTH))
        object.__setattr__(self, "position", (x, y, z))
        angle = number(self.mounting_angle, "mounting_angle")
        if abs(angle) > 2 * math.pi + 1e-9:
            raise LayoutError(
                f"must lie within one turn either way, got {math.degrees(angle):g} deg", "mounting_angle_deg"
            )
        object.__setattr__(self, "mounting_angle", angle)
