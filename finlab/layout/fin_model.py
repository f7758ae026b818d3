"""Fin models that a fin may follow, by name and numbers; the formulas live in `finlab.actuators.fin`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Union

from msgspec import Meta, Struct, defstruct

from finlab.errors import LayoutError
from finlab.files.schema import checked
from finlab.layout.checked import given


@dataclass(frozen=True)
class Parameter:
    """One number of a fin model."""

    default: float
    """Its value where a layout file leaves it out."""
    meaning: str
    """What it is, in a few words."""
    unit: str = ""
    """Its unit; empty where it has none."""
    low: float = 0.001
    """Least value that a robot's fin may have."""
    high: float = 10.0
    """Greatest value."""


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


def _form(name: str, parameters: Mapping[str, Parameter]) -> type[Struct]:
    """The part of a file that gives the parameters of a model."""
    path = Annotated[str, Meta(min_length=1, max_length=4096, description="a CSV file of forces")]
    keys: list[Any] = [("path", path)] if name == "table" else []
    for key, rule in parameters.items():
        about = f"{rule.meaning}{rule.unit and f' [{rule.unit}]'}; {rule.default:g} when left out"
        kind = Annotated[float, Meta(ge=rule.low, le=rule.high, description=about)]
        keys.append((key, kind | None, None))
    return defstruct(f"{name.title()}Model", keys, tag=name, tag_field="type", forbid_unknown_fields=True)


Model: Any = Union[tuple(_form(name, parameters) for name, parameters in FIN_MODELS.items())]  # noqa: UP007
"""A fin model in a file: keys and values, among them its `type`."""


@dataclass(frozen=True)
class FinModelSpec:
    """Name and parameters of a fin model, as a layout file gives them. Checked on construction."""

    type: str = "drag"
    """One of `FIN_MODELS`."""
    parameters: tuple[tuple[str, float | str], ...] = ()
    """Parameters that differ from the model's defaults, as (name, value), sorted by name."""

    def __post_init__(self) -> None:
        model: Any = checked({**dict(self.parameters), "type": self.type}, Model)
        object.__setattr__(self, "parameters", tuple(sorted(given(model).items())))

    @classmethod
    def from_values(cls, values: Mapping[str, float | str]) -> "FinModelSpec":
        """The spec of a mapping with the model's name under `type` and its parameters beside it. Raises
        LayoutError: unknown model, unknown parameter, or a value that is none."""
        return cls(str(values["type"]), tuple((k, v) for k, v in values.items() if k != "type"))

    def scaled(self, share: float) -> "FinModelSpec":
        """The model of a fin that gives a share of the thrust at every command. Raises LayoutError: the fin
        is a table, whose file would have to be another one."""
        if self.type not in SCALES_THRUST:
            raise LayoutError("the thrust of a table cannot be scaled; name another CSV file", "type")
        name, exponent = SCALES_THRUST[self.type]
        rule = FIN_MODELS[self.type][name]
        value = min(max(float(self.values()[name]) * share**exponent, rule.low), rule.high)
        return FinModelSpec(self.type, tuple({**dict(self.parameters), name: value}.items()))

    def values(self) -> dict[str, float | str]:
        """Returns all parameters of the model, those given and those left at their defaults."""
        defaults = {name: rule.default for name, rule in FIN_MODELS[self.type].items()}
        return {**defaults, **dict(self.parameters)}
