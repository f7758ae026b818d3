"""Labels, hints and steps of the boxes in the inspector of the selected actuators, by kind.

Actuator classes know fields and units; how people edit them stands here. A kind that has no entry
in `INSPECTORS`, such as one of another package, gets boxes by its fields and their units.
"""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import get_type_hints

from finlab.actuators.actuator import Actuator
from finlab.actuators.fin.fin_model import FIN_MODELS, MAX_FREQUENCY, Parameter
from finlab.actuators.kinds import KINDS
from webapp.session.key_words import key_words

STEPS_OF_DEFAULT = 20
"""A parameter's box steps by its default over this."""
STEP_DEGREES = 5.0
"""Step of a box for an angle [deg]."""
STEP = 0.1
"""Step of a box for another number, in its unit."""
UNITS = {
    "m": "m",
    "m2": "m²",
    "kg": "kg",
    "n": "N",
    "n_s": "N/s",
    "s": "s",
    "hz": "Hz",
    "rad": "rad",
    "rad_s": "rad/s",
    "per_rad": "1/rad",
    "kg_m3": "kg/m³",
}
"""End of a key in a layout file -> the unit that it says."""


@dataclass(frozen=True, kw_only=True)
class RangeBox:
    """A box for two numbers, least and greatest.

    Args:
        label: with the unit.
        key: field of the actuator, or of its limits.
        hint: shown when the pointer rests on it.
        step: of the box, in its unit.
        degrees: whether the field is in radians and the box in degrees.
    """

    label: str
    key: str
    hint: str = ""
    step: float = STEP
    degrees: bool = False


@dataclass(frozen=True, kw_only=True)
class NumberBox:
    """A box for one number.

    Args:
        label: with the unit.
        key: field of the actuator, or of its model.
        hint: shown when the pointer rests on it.
        step: of the box, in its unit.
        degrees: whether the field is in radians and the box in degrees.
        may_be_empty: whether the field may be None, as the hint says of an empty box.
        model: type of the model that the field belongs to; empty for one of the actuator.
        default: shown of an actuator that does not have the field.
    """

    label: str
    key: str
    hint: str = ""
    step: float = STEP
    degrees: bool = False
    may_be_empty: bool = False
    model: str = ""
    default: float = 0.0


Box = RangeBox | NumberBox
"""A box of an inspector."""


@dataclass(frozen=True, kw_only=True)
class Inspector:
    """What the inspector offers of one kind.

    Args:
        limits: boxes for limits, rates and lags.
        law: boxes for the parameters of its law.
        other_axis: label of the axis that is not pointed; empty for a kind with one axis.
    """

    limits: tuple[Box, ...] = ()
    law: tuple[Box, ...] = ()
    other_axis: str = ""


PROPELLER_LIMITS: tuple[Box, ...] = (
    NumberBox(
        label="Dead band [N]",
        key="dead_band",
        hint="Forces smaller than this, but 0, cannot be held.",
    ),
    NumberBox(
        label="Rate [N/s]",
        key="rate",
        hint="How fast the force changes; empty: at once.",
        may_be_empty=True,
    ),
    NumberBox(
        label="Lag [s]", key="time_constant", hint="Time to 63 % of a new command.", step=0.05
    ),
    NumberBox(
        label="Diameter [m]",
        key="diameter",
        hint="Of the propeller, for its jet; empty: by its force.",
        step=0.01,
        may_be_empty=True,
    ),
    NumberBox(
        label="Torque/force [m]",
        key="torque_per_newton",
        hint="Reaction torque, signed.",
        step=0.001,
    ),
)
"""Boxes of all that have a propeller."""
POWER_LAW: tuple[Box, ...] = (
    NumberBox(
        label="Ahead [W]",
        key="forward",
        hint="Power at 1 N; F newtons take it times F^exponent.",
        model="power_law",
    ),
    NumberBox(
        label="Astern [W]",
        key="reverse",
        hint="The same of a negative force; empty: as ahead.",
        may_be_empty=True,
        model="power_law",
    ),
    NumberBox(
        label="Exponent",
        key="exponent",
        hint="1.5 is that of an ideal propeller at rest.",
        model="power_law",
    ),
)
"""Boxes of a propeller's power law."""
FOIL_LAW: tuple[Box, ...] = (
    NumberBox(label="Area [m²]", key="area", hint="Of the foil.", step=0.001),
    NumberBox(label="Aspect ratio", key="aspect_ratio", hint="2 span²/area for a foil on a hull."),
    NumberBox(
        label="Lift slope [1/rad]",
        key="lift_slope",
        hint="Empty: by the aspect ratio.",
        may_be_empty=True,
    ),
    NumberBox(
        label="Drag",
        key="drag",
        hint="Drag coefficient without lift; 0.0065 is NACA 0015.",
        step=0.001,
    ),
    NumberBox(
        label="Stall [°]",
        key="stall",
        hint="Angle to the flow at which it separates.",
        step=1.0,
        degrees=True,
    ),
)
"""Boxes of the law of a foil."""


def _fin() -> Inspector:
    limits = (
        RangeBox(
            label="A [°]",
            key="amplitude",
            hint="Half of the beat: least and most, up to 90.",
            step=STEP_DEGREES,
            degrees=True,
        ),
        RangeBox(
            label="f [Hz]", key="frequency", hint=f"Least and most, up to {MAX_FREQUENCY:g} Hz."
        ),
        RangeBox(
            label="φ [°]",
            key="zero_direction",
            hint="From and to; −180 to 180 is any direction.",
            step=STEP_DEGREES,
            degrees=True,
        ),
    )
    law = []
    for model, parameters in FIN_MODELS.items():
        for key, rule in parameters.items():
            law.append(_parameter_box(model, key, rule))
    return Inspector(limits=limits, law=tuple(law), other_axis="Zero")


def _parameter_box(model: str, key: str, rule: Parameter) -> NumberBox:
    """The box of a parameter of a fin's model."""
    unit = rule.unit.replace("^2", "²").replace("^3", "³")
    return NumberBox(
        label=f"{key_words(key)} [{unit}]" if unit else key_words(key),
        key=key,
        hint=f"{rule.meaning[0].upper()}{rule.meaning[1:]}. Usual: {rule.default:g}.",
        step=(abs(rule.default) or 1.0) / STEPS_OF_DEFAULT,
        model=model,
        default=rule.default,
    )


def _thruster() -> Inspector:
    force = RangeBox(
        label="Force [N]",
        key="force",
        hint="Least and most along the axis; astern it is negative.",
        step=1.0,
    )
    return Inspector(limits=(force, *PROPELLER_LIMITS), law=POWER_LAW)


def _azimuth() -> Inspector:
    force = RangeBox(
        label="Force [N]", key="force", hint="Least and most; above 0: it cannot stop.", step=1.0
    )
    arc = RangeBox(
        label="Arc [°]",
        key="arc",
        hint="Least and greatest angle from zero; −180 to 180 is any.",
        step=STEP_DEGREES,
        degrees=True,
    )
    turn_rate = NumberBox(
        label="Turn rate [°/s]",
        key="turn_rate",
        hint="How fast it turns; empty: at once.",
        step=STEP_DEGREES,
        degrees=True,
        may_be_empty=True,
    )
    limits = (force, arc, turn_rate, *PROPELLER_LIMITS)
    return Inspector(limits=limits, law=POWER_LAW, other_axis="Turns about")


def _rudder() -> Inspector:
    limits = (
        RangeBox(
            label="Deflection [°]",
            key="deflection",
            hint="Least and greatest.",
            step=1.0,
            degrees=True,
        ),
        NumberBox(
            label="Rate [°/s]",
            key="rate",
            hint="How fast it turns; empty: at once.",
            step=STEP_DEGREES,
            degrees=True,
            may_be_empty=True,
        ),
        NumberBox(
            label="Lag [s]",
            key="time_constant",
            hint="Time to 63 % of a new deflection.",
            step=0.05,
        ),
    )
    return Inspector(limits=limits, law=FOIL_LAW, other_axis="Leading edge")


def _propeller_rudder() -> Inspector:
    limits = (
        RangeBox(
            label="Thrust [N]",
            key="force",
            hint="Least and most; astern nothing meets the rudder.",
            step=1.0,
        ),
        RangeBox(
            label="Deflection [°]",
            key="deflection",
            hint="Least and greatest of the rudder.",
            step=1.0,
            degrees=True,
        ),
        NumberBox(
            label="Rudder rate [°/s]",
            key="turn_rate",
            hint="How fast the rudder turns; empty: at once.",
            step=STEP_DEGREES,
            degrees=True,
            may_be_empty=True,
        ),
        NumberBox(
            label="Rate [N/s]",
            key="rate",
            hint="How fast the thrust changes; empty: at once.",
            may_be_empty=True,
        ),
        NumberBox(
            label="Lag [s]", key="time_constant", hint="Time to 63 % of a new command.", step=0.05
        ),
    )
    slipstream = (
        NumberBox(label="Diameter [m]", key="diameter", hint="Of the propeller.", step=0.01),
        NumberBox(
            label="Slipstream",
            key="slipstream",
            hint="Share of its pressure on the rudder; 1: the rudder lies in it whole.",
            step=0.05,
        ),
    )
    law = (*slipstream, *FOIL_LAW, *POWER_LAW)
    return Inspector(limits=limits, law=law, other_axis="Shaft")


INSPECTORS: Mapping[str, Callable[[], Inspector]] = {
    "fin": _fin,
    "thruster": _thruster,
    "azimuth": _azimuth,
    "tilt": _azimuth,
    "rudder": _rudder,
    "propeller_rudder": _propeller_rudder,
}
"""Type of an actuator -> what makes its inspector."""


@cache
def inspector_of(kind: type[Actuator]) -> Inspector:
    """Returns the inspector of a kind: its own, or one by its fields."""
    make = INSPECTORS.get(kind.type)
    return inspector_by_fields(kind) if make is None else make()


def all_inspectors() -> list[Inspector]:
    """Returns the inspectors of all kinds that there are."""
    return [inspector_of(kind) for kind in KINDS.values()]


def inspector_by_fields(kind: type[Actuator]) -> Inspector:
    """Returns an inspector for a kind that has none: a box for the limits and the rate of each
    number of its command, and one for each other field that is a number."""
    limits: list[Box] = []
    numbers = kind.KIND.numbers
    for number in numbers:
        is_angle = number.unit == "rad"
        unit = "°" if is_angle else number.unit
        step = STEP_DEGREES if is_angle else 1.0
        if number.limits is not None:
            limits.append(
                RangeBox(
                    label=f"{key_words(number.limits)} [{unit}]",
                    key=number.limits,
                    hint=f"Least and greatest {number.name}.",
                    step=step,
                    degrees=is_angle,
                )
            )
        if number.rate is not None:
            limits.append(
                NumberBox(
                    label=f"{key_words(number.rate)} [{unit}/s]",
                    key=number.rate,
                    hint=f"How fast its {number.name} changes; empty: at once.",
                    step=step,
                    degrees=is_angle,
                    may_be_empty=True,
                )
            )
    other = [name for name in kind.KIND.axes if name != kind.KIND.pointed]
    return Inspector(
        limits=tuple(limits),
        law=_number_boxes(kind, {box.key for box in limits}),
        other_axis=key_words(other[0]) if other else "",
    )


def _number_boxes(kind: type[Actuator], known: set[str]) -> tuple[Box, ...]:
    """A box for each field of a kind that is a number, but those that have one already."""
    hints = get_type_hints(kind)
    boxes: list[Box] = []
    for field in fields(kind):
        if field.name in known or hints[field.name] not in (float, float | None):
            continue
        degrees = field.name in kind.DEGREES
        unit = "°" if degrees else _unit_of(kind, field.name)
        default = field.default if isinstance(field.default, float) else 0.0
        boxes.append(
            NumberBox(
                label=f"{key_words(field.name)} [{unit}]" if unit else key_words(field.name),
                key=field.name,
                degrees=degrees,
                step=STEP_DEGREES if degrees else (abs(default) or 1.0) / STEPS_OF_DEFAULT,
                may_be_empty=field.default is None and field.default is not MISSING,
            )
        )
    return tuple(boxes)


def _unit_of(kind: type[Actuator], name: str) -> str:
    """Unit of a field, by the end of its key in a layout file; empty where that says none."""
    key = kind.KEYS.get(name, name)
    ends = [end for end in UNITS if key.endswith(f"_{end}")]
    return UNITS[max(ends, key=len)] if ends else ""
