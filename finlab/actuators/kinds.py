"""The kinds of actuator there are, and what follows for the actuators of a robot. A kind is one
line here; it is imported when a robot has one.

Kinds that stand elsewhere are in modules that `FINLAB_KINDS` names, with commas between; each adds
its own to `KINDS`, which refuses what is no kind. A module that cannot be imported is a
`FinlabError`.
"""

import os
from collections.abc import Iterator, MutableMapping, Sequence
from importlib import import_module
from pkgutil import resolve_name

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.actuator import Actuator, Places
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.response import Group
from finlab.arrays import Array
from finlab.errors import FinlabError


class Kinds(MutableMapping[str, type[Actuator]]):
    """Kinds by the type that layouts give them, each imported when it is asked for. Raises
    FinlabError where one is added that is none: it lacks what the contract asks for, whose name the
    sentence says."""

    def __init__(self, homes: dict[str, str]) -> None:
        """Takes types of actuators -> where their classes stand, `module:Class`."""
        self._kinds: dict[str, str | type[Actuator]] = dict(homes)

    def __getitem__(self, name: str) -> type[Actuator]:
        kind = self._kinds[name]
        if isinstance(kind, str):
            kind = self._kinds[name] = resolve_name(kind)
        return kind

    def __setitem__(self, name: str, kind: type[Actuator]) -> None:
        """Adds a kind, or puts another one in its place."""
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
    }
)
"""Type of an actuator in a layout -> its class."""


def laws_of(actuators: Sequence[Actuator]) -> list[tuple[Places, ActuatorLaw]]:
    """Returns the laws of a robot's actuators with their places, by kind. Raises DataError: a bad
    table."""
    groups: list[tuple[Places, ActuatorLaw]] = []
    for places, kind in _kinds(actuators):
        groups += [(places[among], law) for among, law in kind.laws([actuators[i] for i in places])]
    return groups


def groups_of(actuators: Sequence[Actuator], effectiveness: Array) -> list[tuple[Places, Group]]:
    """Returns the answers to prices of a robot's actuators by kind, with their places;
    `effectiveness` (n, 3, 6) is the wrench of 1 N along their own axes. Errors as for
    `FinGroup`."""
    kinds = [(places, kind, [actuators[i] for i in places]) for places, kind in _kinds(actuators)]
    return [(places, kind.GROUP(parts, effectiveness[places])) for places, kind, parts in kinds]


def _kinds(actuators: Sequence[Actuator]) -> Iterator[tuple[Places, type[Actuator]]]:
    """The kinds of a robot's actuators, in the order in which they come, with their places; those
    that share their law (tilts are azimuths) are one."""
    laws = [type(part).LAW for part in actuators]
    for law in dict.fromkeys(laws):
        places = np.array([i for i, own in enumerate(laws) if own is law])
        yield places, type(actuators[places[0]])


def free_angles(actuators: Sequence[Actuator]) -> NDArray[np.bool_]:
    """Which commands (n, 3) are angles; whether they may turn freely depends on their limits."""
    return np.array([[k == part.ANGLE for k in range(3)] for part in actuators])


def import_kinds(module: str) -> None:
    """Imports a module that `FINLAB_KINDS` names, which adds its kinds. Raises FinlabError: it
    cannot be imported, or one of its kinds is none."""
    try:
        import_module(module)
    except FinlabError as error:
        raise FinlabError(f"FINLAB_KINDS: {error}") from error
    except Exception as error:  # whatever somebody else's module does
        said = " ".join(f"{type(error).__name__}: {error}".split())
        raise FinlabError(
            f"FINLAB_KINDS: the module {module!r} cannot be imported ({said:.200}); put it where "
            "Python "
            "finds it, such as in PYTHONPATH, mend it, or leave it out"
        ) from error


for _module in os.environ.get("FINLAB_KINDS", "").split(","):
    if _module.strip():
        import_kinds(_module.strip())
