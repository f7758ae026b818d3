"""Whether a class is a kind of actuator: what it has to declare, said in a sentence where it does
not."""

import inspect
from dataclasses import fields
from typing import Any

from finlab.actuators.actuator import Actuator, Command, Faults
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.response import Group
from finlab.errors import FinlabError

CONTRACT = (
    "the contract of a kind is `Actuator` in finlab/actuators/actuator.py, docs/howto/kind.md "
    "makes one"
)
LOOKS = "fin", "thruster", "pod", "foil"
"""How an actuator may be drawn."""


def check_kind(name: str, kind: Any) -> None:
    """Refuses what is no kind of actuator of that type. Raises FinlabError: it lacks what the
    contract asks for, whose name the sentence says."""
    if problem := _problem(name, kind):
        home = getattr(kind, "__module__", "?")
        raise FinlabError(f"kind of actuator {name!r} of module {home!r}: {problem}; {CONTRACT}")


def _problem(name: str, kind: Any) -> str:
    """What is wrong with a kind, in words; nothing where it is one."""
    if not (isinstance(kind, type) and issubclass(kind, Actuator)):
        return f"expected a subclass of Actuator, got {kind!r:.60}"
    if "__dataclass_params__" not in vars(kind):
        return f"{kind.__name__} is no dataclass; write @dataclass(frozen=True) above it"
    if missing := _missing(kind):
        return f"{kind.__name__} lacks {', '.join(missing)}"
    if name != kind.type:
        return (
            f"{kind.__name__} has the type {kind.type!r}, expected the name under which it is added"
        )
    own_laws = kind.laws.__func__ is not Actuator.laws.__func__  # type: ignore[attr-defined]
    bases: dict[str, Any] = {"LAW": ActuatorLaw, "GROUP": Group, "COMMAND": Command}
    for key, base in bases.items():
        part: Any = getattr(kind, key)
        if not (isinstance(part, type) and issubclass(part, base)):
            return (
                f"{key} of {kind.__name__}: expected a subclass of {base.__name__}, got "
                f"{part!r:.60}"
            )
        lacking = [] if key == "LAW" and own_laws else _methods_left(part)
        if lacking:
            return f"{key} of {kind.__name__}: {part.__name__} lacks {', '.join(lacking)}"
    if kind.LOOKS not in LOOKS:
        return (
            f"LOOKS of {kind.__name__}: expected one of {', '.join(LOOKS)}, got {kind.LOOKS!r:.60}"
        )
    if others := [fault for fault in kind.FAULTS if fault not in Faults._fields]:
        return (
            f"FAULTS of {kind.__name__}: expected some of {', '.join(Faults._fields)}, got "
            f"{others[0]!r:.60}"
        )
    return ""


def _missing(kind: type[Actuator]) -> list[str]:
    """Names of what a kind does not declare: facts, fields, fields that facts name, and methods."""
    known = {field.name for field in fields(kind)}

    def has(name: str) -> bool:
        return name in known or hasattr(kind, name)

    declared = {name for name in Actuator.__annotations__ if name not in vars(Actuator)}
    # What follows from a fact need not be said by it: fins have limits and rates of their own.
    for key, properties in {"LIMITS": ("lower", "upper"), "RATES": ("rates",)}.items():
        if all(getattr(kind, name) is not getattr(Actuator, name) for name in properties):
            declared.discard(key)
    missing = [name for name in Actuator.__annotations__ if name in declared and not has(name)]
    for key in ("LIMITS", "RATES", "AXES"):
        missing += [
            f"the field {name!r} of its {key}" for name in getattr(kind, key, ()) if not has(name)
        ]
    return missing + _methods_left(kind)


def _methods_left(part: Any) -> list[str]:
    """Methods that a class leaves to be written, in words."""
    names = part.__abstractmethods__ if inspect.isabstract(part) else ()
    return [f"{name}()" for name in sorted(names)]
