"""Checks that a class is a kind of actuator: what it has to declare, in one sentence where it does
not. `finlab.actuators.kinds.KINDS` calls it for each kind that is added."""

import inspect
from dataclasses import fields
from typing import Any

from finlab.actuators.actuator import ACROSS, DRAWN_AS, Actuator, Command, Faults, Kind
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.response import Group
from finlab.errors import FinlabError

CONTRACT = (
    "the contract of a kind is `Actuator` in finlab/actuators/actuator.py, docs/howto/kind.md "
    "makes one"
)
"""End of every sentence: where the contract stands."""


def check_kind(name: str, kind: Any) -> None:
    """Refuses a class that is no kind of actuator.

    Args:
        name: type under which it is added to `KINDS`.
        kind: the class.

    Raises:
        FinlabError: it lacks something that the contract asks for, which the sentence names.
    """
    problem = _problem(name, kind)
    if problem:
        module = getattr(kind, "__module__", "?")
        raise FinlabError(f"kind of actuator {name!r} of module {module!r}: {problem}; {CONTRACT}")


def _problem(name: str, kind: Any) -> str:
    """What is wrong with a class as a kind, in words; empty where nothing is."""
    if not (isinstance(kind, type) and issubclass(kind, Actuator)):
        return f"expected a subclass of Actuator, got {kind!r:.60}"
    if "__dataclass_params__" not in vars(kind):
        return f"{kind.__name__} is no dataclass; write @dataclass(frozen=True) above it"
    missing = _missing(kind)
    if missing:
        return f"{kind.__name__} lacks {', '.join(missing)}"
    if name != kind.type:
        return (
            f"{kind.__name__} has the type {kind.type!r}, expected the name under which it is added"
        )
    if not isinstance(kind.KIND, Kind):
        return f"KIND of {kind.__name__}: expected a Kind, got {kind.KIND!r:.60}"
    return _problem_of_facts(kind)


def _problem_of_facts(kind: type[Actuator]) -> str:
    """What is wrong with the `KIND` of a class, in words; empty where nothing is."""
    facts = kind.KIND
    has_own_laws = kind.laws.__func__ is not Actuator.laws.__func__  # type: ignore[attr-defined]
    bases: dict[str, Any] = {"law": ActuatorLaw, "group": Group, "command": Command}
    for fact, base in bases.items():
        part: Any = getattr(facts, fact)
        if not (isinstance(part, type) and issubclass(part, base)):
            return _expected(kind, fact, f"a subclass of {base.__name__}", part)
        if fact == "law" and has_own_laws:
            continue  # the law's class is then a base that the laws have in common
        abstract = _abstract_methods(part)
        if abstract:
            return f"{fact} of {kind.__name__}: {part.__name__} lacks {', '.join(abstract)}"

    fields_missing = _fields_missing(kind)
    if fields_missing:
        return f"{kind.__name__} lacks {', '.join(fields_missing)}"

    own_axes = (*facts.axes, ACROSS)
    choices: list[tuple[str, tuple[str, ...], tuple[str, ...]]] = [
        ("pointed", (facts.pointed,), facts.axes),
        ("pushes_along", facts.pushes_along, own_axes),
        ("drawn_as", (facts.drawn_as,), DRAWN_AS),
        ("faults", facts.faults, Faults._fields),
    ]
    for fact, values, known in choices:
        for value in values:
            if value not in known:
                return _expected(kind, fact, f"one of {', '.join(known)}", value)
    return ""


def _expected(kind: type[Actuator], fact: str, expected: str, got: object) -> str:
    """The sentence about one fact that is wrong."""
    return f"{fact} of {kind.__name__}: expected {expected}, got {got!r:.60}"


def _missing(kind: type[Actuator]) -> list[str]:
    """Names of what a class does not have: its `KIND`, fields of every actuator, and methods."""
    known = {field.name for field in fields(kind)}
    missing = []
    for name in Actuator.__annotations__:
        if name not in known and not hasattr(kind, name):
            missing.append(name)
    return missing + _abstract_methods(kind)


def _fields_missing(kind: type[Actuator]) -> list[str]:
    """Fields that the `KIND` of a class names and the class does not have, in words."""
    facts = kind.KIND
    known = {field.name for field in fields(kind)}
    # A class with properties of its own needs no fields for them: fins have such.
    has_own_limits = all(
        getattr(kind, name) is not getattr(Actuator, name) for name in ("lower", "upper")
    )
    named = []
    for number in facts.numbers:
        if number.limits is not None:
            named.append((number.limits, f"limits of {number.name!r}"))
        elif not has_own_limits:
            return [f"limits of its number {number.name!r}"]
        if number.rate is not None:
            named.append((number.rate, f"rate of {number.name!r}"))
    named += [(name, "axes") for name in facts.axes]
    if facts.arc:
        named.append((facts.arc, "arc"))
    return [
        f"the field {name!r} of its KIND ({purpose})"
        for name, purpose in named
        if name not in known and not hasattr(kind, name)
    ]


def _abstract_methods(part: Any) -> list[str]:
    """Methods that a class leaves to be written, in words."""
    names = part.__abstractmethods__ if inspect.isabstract(part) else ()
    return [f"{name}()" for name in sorted(names)]
