"""Which fin model a fin follows, by name and numbers; the formulas live in `finlab.physics`."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from finlab.errors import LayoutError
from finlab.layout.rules import number, text


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

FIN_MODELS: Mapping[str, Mapping[str, Parameter]] = MappingProxyType(
    {
        "drag": MappingProxyType(
            {
                "density": _DENSITY,
                "drag_coefficient": Parameter(0.15, "drag coefficient of the blade"),
                "area": Parameter(0.02, "area of the blade", "m^2"),
                "lever": Parameter(0.1, "distance of the blade's centre from the shaft", "m"),
            }
        ),
        "lighthill": MappingProxyType(
            {
                "density": _DENSITY,
                "length": Parameter(0.20, "length of the fin from the shaft", "m"),
                "width": Parameter(0.10, "width of the trailing edge", "m"),
            }
        ),
        "soft": MappingProxyType(
            {
                "k": Parameter(3.6, "thrust at A f = 1 rad Hz, before it saturates", "N"),
                "p": Parameter(1.0, "exponent with which thrust grows with A f", low=0.5, high=4.0),
                "x0": Parameter(1.3, "A f from which thrust saturates and falls", "rad Hz"),
                "q": Parameter(5.0, "exponent of that fall", high=20.0),
                "e": Parameter(
                    0.0, "share by which thrust differs with direction", high=0.99, positive=False
                ),
                "phi_e": Parameter(
                    0.0, "zero direction of the largest thrust", "rad", -10.0, 10.0, positive=False
                ),
                "d": Parameter(0.0, "angle from zero direction to thrust", "rad", -1.5, 1.5, positive=False),
            }
        ),
        # Its one parameter, `path`, is the text that names a CSV file of forces; it has no default.
        "table": MappingProxyType({}),
    }
)
"""The fin models there are, by name, with their numeric parameters."""


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

    def values(self) -> dict[str, float | str]:
        """Returns all parameters of the model, those given and those left at their defaults."""
        defaults = {name: rule.default for name, rule in FIN_MODELS[self.type].items()}
        return {**defaults, **dict(self.parameters)}
