"""The kinds of actuator there are, from the type in a layout to the law. A new kind is one line here."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.fin_laws import stack_laws
from finlab.actuators.fin.fin_response import FinGroup
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.response import Group
from finlab.actuators.rudder import RudderGroup, RudderLaw
from finlab.actuators.thruster import AzimuthGroup, AzimuthLaw, ThrusterGroup, ThrusterLaw
from finlab.arrays import Array
from finlab.layout.layout import Layout

Places = NDArray[np.intp]
"""Places of actuators among others."""


@dataclass(frozen=True)
class Kind:
    """What is known of one kind of actuator."""

    laws: Callable[[Sequence[Any]], Sequence[tuple[Places, ActuatorLaw]]]
    """Laws of m actuators of the kind, few for many of them, each with its places among these m."""
    group: Callable[[Sequence[Any], Array], Group]
    """Answers to prices of m actuators with an effectiveness (m, 3, 6)."""
    angle: int | None = None
    """Which of its commands is an angle that may turn freely."""
    feels_flow: bool = False
    """Whether it gives nothing at rest: its force is that of the flow."""


def _kind(law: type[Any], group: Any, angle: int | None = None) -> Kind:
    """A kind whose actuators have one law together."""
    return Kind(lambda parts: [(np.arange(len(parts)), law(parts))], group, angle, law.feels_flow)


_AZIMUTH = _kind(AzimuthLaw, AzimuthGroup, angle=0)
KINDS: dict[str, Kind] = {
    "fin": Kind(lambda fins: stack_laws([fin.model for fin in fins]), FinGroup, angle=2),
    "thruster": _kind(ThrusterLaw, ThrusterGroup),
    "azimuth": _AZIMUTH,
    "tilt": _AZIMUTH,
    "rudder": _kind(RudderLaw, RudderGroup),
}
"""Type of an actuator in a layout -> what is known of it."""


def laws_of(layout: Layout) -> list[tuple[Places, ActuatorLaw]]:
    """Returns the laws of a robot's actuators with their places, by kind; a `DataError` at a bad table."""
    groups: list[tuple[Places, ActuatorLaw]] = []
    for places, kind in _kinds(layout):
        laws = kind.laws([layout.actuators[i] for i in places])
        groups += [(places[among], law) for among, law in laws]
    return groups


def groups_of(layout: Layout, effectiveness: Array) -> list[tuple[Places, Group]]:
    """Returns the answers to prices of a robot's actuators by kind, with their places; `effectiveness` (n, 3,
    6) is the wrench of 1 N along their own axes. Errors as for `FinGroup`."""
    kinds = [(places, kind, [layout.actuators[i] for i in places]) for places, kind in _kinds(layout)]
    return [(places, kind.group(parts, effectiveness[places])) for places, kind, parts in kinds]


def _kinds(layout: Layout) -> list[tuple[Places, Kind]]:
    """The kinds of a robot's actuators, in the order in which they come, with their places."""
    kinds = [KINDS[actuator.type] for actuator in layout.actuators]
    return [
        (np.array([i for i, own in enumerate(kinds) if own is kind]), kind) for kind in dict.fromkeys(kinds)
    ]


def free_angles(layout: Layout) -> NDArray[np.bool_]:
    """Which commands (n, 3) are angles; whether they may turn freely depends on their limits."""
    angles = [KINDS[actuator.type].angle for actuator in layout.actuators]
    return np.array([[k == angle for k in range(3)] for angle in angles])
