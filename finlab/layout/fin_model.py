"""Which fin model a fin follows, by name and numbers; the formulas live in `finlab.physics`."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from finlab.errors import LayoutError
from finlab.layout.rules import number, text

MODEL_DEFAULTS: MappingProxyType[str, MappingProxyType[str, float]] = MappingProxyType(
    {
        # U-CAT's on-board thrust law: density [kg/m^3], drag coefficient, fin area [m^2], lever to its
        # centre [m].
        "drag": MappingProxyType({"density": 1000.0, "drag_coefficient": 0.15, "area": 0.02, "lever": 0.1}),
        # Lighthill's large-amplitude elongated body: density [kg/m^3], fin length [m], trailing-edge width
        # [m].
        "lighthill": MappingProxyType({"density": 1000.0, "length": 0.20, "width": 0.10}),
        # A table of measured or computed forces; its one parameter, `path`, is text and has no default.
        "table": MappingProxyType({}),
    }
)
"""The fin models there are, their numeric parameters and the values a layout file may leave out."""


@dataclass(frozen=True)
class FinModelSpec:
    """Name and parameters of a fin model, as a layout file gives them. Checked on construction."""

    type: str = "drag"
    """`drag`, `lighthill` or `table`."""

    parameters: tuple[tuple[str, float | str], ...] = ()
    """Parameters that differ from the model's defaults, as (name, value), sorted by name."""

    def __post_init__(self) -> None:
        if self.type not in MODEL_DEFAULTS:
            known = ", ".join(MODEL_DEFAULTS)
            raise LayoutError(f"unknown fin model {self.type!r:.60}, expected one of {known}", "type")
        known_names = ["path"] if self.type == "table" else list(MODEL_DEFAULTS[self.type])
        checked: list[tuple[str, float | str]] = []
        for name, value in sorted(self.parameters):
            if name not in known_names:
                raise LayoutError(f"unknown key, {self.type} takes {', '.join(known_names)}", name)
            if name == "path":
                checked.append((name, text(value, name, 4096)))
            else:
                checked.append((name, number(value, name, high=1e6, positive=True)))
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
        return {**MODEL_DEFAULTS[self.type], **dict(self.parameters)}
