"""The kinds of actuator there are, by name, and the laws and responses of a robot's actuators by
kind. A kind is one line here; its module is imported when a robot has one.

Kinds outside finlab are in modules that the environment variable `FINLAB_KINDS` names, with commas
between; each adds its own to `KINDS`, which refuses a class that is no kind. A module that cannot
be imported is a `FinlabError`.
"""

import os
from collections.abc import Iterator, MutableMapping, Sequence
from importlib import import_module
from pkgutil import resolve_name

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.actuator import Actuator, Indices
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.response import Group
from finlab.arrays import Array
from finlab.errors import FinlabError


class Kinds(MutableMapping[str, type[Actuator]]):
    """Kinds by the type that layouts give them, each imported on first use.

    Raises:
        FinlabError: a class that is added is no kind; the sentence names what it lacks.
    """

    def __init__(self, paths: dict[str, str]) -> None:
        """Takes types of actuators -> their classes, as `module:Class`."""
        self._kinds: dict[str, str | type[Actuator]] = dict(paths)

    def __getitem__(self, name: str) -> type[Actuator]:
        kind = self._kinds[name]
        if isinstance(kind, str):
            kind = self._kinds[name] = resolve_name(kind)
        return kind

    def __setitem__(self, name: str, kind: type[Actuator]) -> None:
        """Adds a kind, or replaces one."""
        from finlab.actuators.kind_check import check_kind

        check_kind(name, kind)
        self._kinds[name] = kind

    def __delitem__(self, name: str) -> None:
        del self._kinds[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._kinds)

    def __len__(self) -> int:
        return len(self._kinds)

    def __contains__(self, name: object) -> bool:
        return name in self._kinds


KINDS = Kinds(
    {
        "fin": "finlab.actuators.fin.fin:Fin",
        "thruster": "finlab.actuators.thruster:Thruster",
        "azimuth": "finlab.actuators.azimuth:Azimuth",
        "tilt": "finlab.actuators.azimuth:Tilt",
        "rudder": "finlab.actuators.rudder:Rudder",
        "propeller_rudder": "finlab.actuators.propeller_rudder:PropellerRudder",
    }
)
"""Type of an actuator in a layout -> its class."""


def laws_of(actuators: Sequence[Actuator]) -> list[tuple[Indices, ActuatorLaw]]:
    """Returns the laws of a robot's n actuators, by kind.

    Args:
        actuators: n actuators.

    Returns:
        Laws, each with the indices of its m actuators among the n.

    Raises:
        DataError: a table that a law reads is bad.
    """
    laws: list[tuple[Indices, ActuatorLaw]] = []
    for indices, kind in _by_kind(actuators):
        for indices_in_kind, law in kind.laws([actuators[i] for i in indices]):
            laws.append((indices[indices_in_kind], law))
    return laws


def groups_of(actuators: Sequence[Actuator], effectiveness: Array) -> list[tuple[Indices, Group]]:
    """Returns the responses to prices of a robot's n actuators, by kind (Eq. 5).

    Args:
        actuators: n actuators.
        effectiveness: wrench (n, 3, 6) of 1 N along each own axis [1, m], body frame.

    Returns:
        Groups, each with the indices of its m actuators among the n.

    Raises:
        DataError: a table that a law reads is bad.
    """
    groups: list[tuple[Indices, Group]] = []
    for indices, kind in _by_kind(actuators):
        group = kind.KIND.group([actuators[i] for i in indices], effectiveness[indices])
        groups.append((indices, group))
    return groups


def _by_kind(actuators: Sequence[Actuator]) -> Iterator[tuple[Indices, type[Actuator]]]:
    """Indices (m,) of a robot's actuators of each kind, in the order in which kinds first occur;
    kinds with the same law (tilts are azimuths) count as one."""
    laws = [type(actuator).KIND.law for actuator in actuators]
    for law in dict.fromkeys(laws):
        indices = np.array([i for i, own in enumerate(laws) if own is law])
        yield indices, type(actuators[indices[0]])


def free_angles(actuators: Sequence[Actuator]) -> NDArray[np.bool_]:
    """Returns which numbers of the commands (n, 3) are angles that aim the force; whether one may
    turn all round depends on its limits."""
    is_angle = np.zeros((len(actuators), 3), dtype=np.bool_)
    for i, actuator in enumerate(actuators):
        if actuator.KIND.aiming_number is not None:
            is_angle[i, actuator.KIND.aiming_number] = True
    return is_angle


def wrapping_angles(actuators: Sequence[Actuator]) -> NDArray[np.bool_]:
    """Returns which numbers of the commands (n, 3) are angles that wrap whatever their limits."""
    wraps = np.zeros((len(actuators), 3), dtype=np.bool_)
    for i, actuator in enumerate(actuators):
        for k, number in enumerate(actuator.KIND.numbers):
            wraps[i, k] = number.wraps
    return wraps


def import_kinds(module: str) -> None:
    """Imports a module that `FINLAB_KINDS` names, which adds its kinds.

    Raises:
        FinlabError: it cannot be imported, or a class that it adds is no kind.
    """
    try:
        import_module(module)
    except FinlabError as error:
        raise FinlabError(f"FINLAB_KINDS: {error}") from error
    except Exception as error:  # anything: the module is not finlab's
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise FinlabError(
            f"FINLAB_KINDS: the module {module!r} cannot be imported ({reason:.200}); put it where "
            "Python finds it, such as in PYTHONPATH, mend it, or leave it out"
        ) from error


for _module in os.environ.get("FINLAB_KINDS", "").split(","):
    if _module.strip():
        import_kinds(_module.strip())
