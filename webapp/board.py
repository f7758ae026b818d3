"""The board of a page: properties of handles are declared as functions of facts, made when these
change.

A function names the facts that it is made of as its parameters: `lambda layout, is_edited: ...`.
"""

import inspect
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from markupsafe import Markup, escape

from webapp.viser_internals import write_content

Facts = dict[str, Any]
"""Whoever shows a part names the facts that it is made of, each with its type."""


PLAIN = (str, int, float, bool, tuple)
"""Facts that are compared by value; the others, which may hold arrays, by identity."""
Fail = Callable[[Exception | None], None]
UNKNOWN = object()
"""In place of what was made last, where that is not known."""


@dataclass(eq=False)
class Rule:
    """One property of a handle, or whatever else is done when facts change."""

    group: "Group"
    """Whose rules are written together."""
    make: Callable[..., Any]
    """Gives the property's value; where there is no handle, it does all itself."""
    handle: Any = None
    """Whose property it is."""
    key: str = ""
    """Name of the property."""
    is_due: bool = True
    """Whether a fact has changed since it was written."""
    last: Any = UNKNOWN
    """What was made last."""
    names: list[str] = field(init=False)
    """Facts that it is made of: the parameters of `make` without defaults."""

    def __post_init__(self) -> None:
        parameters = inspect.signature(self.make).parameters.values()
        self.names = [each.name for each in parameters if each.default is each.empty]


class Group:
    """Rules that stand or fall together, and wait while nobody can see what they show."""

    def __init__(self, fail: Fail, fault: Callable[[Exception], None]) -> None:
        """`fail` hides all that the rules show, or shows it again where it gets None; `fault` hears
        why."""
        self.rules: list[Rule] = []
        self.is_visible = True
        """Whether anybody can see what the rules show."""
        self.is_due = True
        """Whether one of them is."""
        self._is_hidden = False
        self._fail = fail
        self._fault = fault

    def write(self, facts: Facts) -> None:
        """Make again what is due, and send what has changed."""
        self.is_due = False
        try:
            for rule in self.rules:
                if not rule.is_due:
                    continue
                made = rule.make(*map(facts.__getitem__, rule.names))
                handle = rule.handle
                key = rule.key
                if handle is not None:
                    if key == "content" and type(made) is not Markup:
                        made = escape(made)  # content that is not marked as markup is text
                    # A user may have changed a value.
                    before = handle.value if key == "value" else rule.last
                    is_nan_as_before = made != made and before != before
                    if before is UNKNOWN or (before != made and not is_nan_as_before):
                        if key == "content":
                            write_content(handle, str(made))
                        else:
                            setattr(handle, key, made)
                    rule.last = made
                rule.is_due = False
        except Exception as error:
            self.fail(error)
        else:
            if self._is_hidden:
                self._is_hidden = False
                self._fail(None)

    def fail(self, error: Exception) -> None:
        """Hide all."""
        self._is_hidden = True
        self._fail(error)
        self._fault(error)


class Board:
    """All rules of one page."""

    def __init__(self, fault: Callable[[Exception], None]) -> None:
        """`fault` hears why something cannot be shown."""
        self._fault = fault
        self.groups: list[Group] = []
        self._of_fact: dict[str, list[Rule]] = defaultdict(list)
        self._of_handle: dict[int, list[Rule]] = {}
        self.view = Group(lambda _: None, fault)
        """What is drawn in the view, after all words."""
        self.facts: Facts | None = None
        """What is shown; None where nothing is trusted to be."""
        self._to_draw: Facts | None = None
        """What the view shows soon."""

    def group(self, fail: Fail = lambda _: None, is_view: bool = False) -> Group:
        """Rules that are declared from now on belong to a group; groups are written in their order,
        that of the view by `draw`."""
        self.groups.append(Group(fail, self._fault))
        if is_view:
            self.view = self.groups[-1]
        return self.groups[-1]

    def show(self, handle: Any, **made: Callable[..., Any]) -> Any:
        """Let properties of a handle be what functions make of the facts; gives the handle back."""
        for key, make in made.items():
            self._of_handle.setdefault(id(handle), []).append(self._declare(make, handle, key))
        return handle

    def act(self, make: Callable[..., None], *handles: Any) -> None:
        """Call a function of facts whenever these change, or a user has changed one of the
        `handles`."""
        rule = self._declare(make)
        for handle in handles:
            self._of_handle.setdefault(id(handle), []).append(rule)

    def _declare(self, make: Callable[..., Any], handle: Any = None, key: str = "") -> Rule:
        rule = Rule(self.groups[-1], make, handle, key)
        rule.group.rules.append(rule)
        for name in rule.names:
            self._of_fact[name].append(rule)
        return rule

    def recheck(self, handle: Any) -> None:
        """A user has changed a handle, and the session may have refused it."""
        for rule in self._of_handle.get(id(handle), []):
            rule.is_due = rule.group.is_due = True

    def write_all(self) -> None:
        """Something went wrong: all is made again next time."""
        self.facts = None

    def fail(self, error: Exception) -> None:
        """There are no facts: nothing is shown."""
        self._to_draw = None
        for group in self.groups:
            group.fail(error)

    def refresh(self, facts: Facts) -> None:
        """Write what has changed where it can be seen; the rest waits until it can."""
        before = self.facts
        self.facts = facts
        self._to_draw = facts
        if before is None:
            for group in self.groups:
                for rule in group.rules:
                    rule.last = UNKNOWN
                    rule.is_due = True
                    group.is_due = True
        else:
            for name, rules in self._of_fact.items():
                old = before[name]
                new = facts[name]
                if old is not new and not (type(old) in PLAIN and old == new):
                    for rule in rules:
                        rule.is_due = rule.group.is_due = True
        for group in self.groups:
            if group.is_due and group.is_visible and group is not self.view:
                group.write(facts)

    def draw(self) -> None:
        """Write what has changed in the view."""
        if self.view.is_due and self._to_draw is not None:
            self.view.write(self._to_draw)
