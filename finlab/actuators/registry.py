"""The kinds of actuator there are, from the type in a layout to the law. A new kind is one line here."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.azimuth import azimuth_laws
from finlab.actuators.fin.models import stack_laws
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.rudder import RudderLaw
from finlab.actuators.thruster import thruster_laws
from finlab.layout.layout import Layout

Groups = list[tuple[NDArray[np.intp], ActuatorLaw]]
"""Laws, each with the places of its actuators."""


@dataclass(frozen=True)
class Kind:
    """What is known of one kind of actuator."""

    laws: Callable[[Sequence[Any]], Groups]
    """Its laws for n actuators of the kind, few laws for many of them; places count among these n."""
    angle: int | None = None
    """Which of its commands is an angle that may turn freely."""


_AZIMUTH = Kind(azimuth_laws, angle=0)
KINDS: dict[str, Kind] = {
    "fin": Kind(lambda fins: [*stack_laws([fin.model for fin in fins])], angle=2),
    "thruster": Kind(thruster_laws),
    "azimuth": _AZIMUTH,
    "tilt": _AZIMUTH,
    "rudder": Kind(lambda rudders: [(np.arange(len(rudders)), RudderLaw(rudders))]),
}
"""Type of an actuator in a layout -> what is known of it."""


def laws_of(layout: Layout) -> Groups:
    """Returns the laws of a robot's actuators, those of one kind together.

    Raises:
        DataError: the force table of a fin cannot be read.
    """
    kinds = [KINDS[actuator.type] for actuator in layout.actuators]
    groups: Groups = []
    for kind in dict.fromkeys(kinds):
        places = np.array([i for i, own in enumerate(kinds) if own is kind])
        found = kind.laws([layout.actuators[i] for i in places])
        groups += [(places[among], law) for among, law in found]
    return groups


def free_angles(layout: Layout) -> NDArray[np.bool_]:
    """Which commands (n, 3) are angles; whether they may turn freely depends on their limits."""
    found = np.zeros((layout.n, 3), bool)
    for i, actuator in enumerate(layout.actuators):
        angle = KINDS[actuator.type].angle
        if angle is not None:
            found[i, angle] = True
    return found
