"""Parameters: what is taken, what is refused in a sentence, and what each one is said to be."""

from typing import Any

import pytest
from finlab_allocator.parameters import Parameters, descriptions

from finlab.errors import CommandError


def test_each_parameter_is_described_and_has_a_default() -> None:
    assert set(descriptions()) == set(vars(Parameters()))
    assert all(description for description, _ in descriptions().values())
    assert [name for name, (_, read_only) in descriptions().items() if read_only] == ["autostart"]
    contract = Parameters(period_s=0.1, watchdog_s=0.5, frame="base_link", nan="refuse")
    assert Parameters() == contract


@pytest.mark.parametrize(
    ("name", "value", "taken"),
    [
        ("robot", "A", "A"),
        ("policy", "priority", "priority"),
        ("period_s", 1, 1.0),
        ("watchdog_s", 0.02, 0.02),
        ("frame", "auv/base_link", "auv/base_link"),
        ("lost", ["a", "b", "a"], ("a", "b")),
        ("lost", [""], ()),
        ("lost", None, ()),
        ("free", ("Tx",), ("Tx",)),
        ("nan", "free", "free"),
        ("calm", 0, 0.0),
        ("calm", None, None),
        ("calm", float("nan"), None),
        ("power_w", float("inf"), None),
        ("power_w", 250.0, 250.0),
        ("autostart", False, False),
        ("accelerometer", True, True),
        ("pressure", True, True),
        ("drives", "signed", "signed"),
    ],
)
def test_a_value_is_taken(name: str, value: Any, taken: Any) -> None:
    before = Parameters()
    changed = before.changed({name: value})
    assert getattr(changed, name) == taken and type(getattr(changed, name)) is type(taken)
    assert before == Parameters()


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("robot", 3, "robot: expected a text, got 3"),
        ("policy", "best", "policy: expected one of closest, direction, priority"),
        ("period_s", 0.0, "period_s: expected a number from 0.001 to 60 s, got 0.0"),
        ("period_s", float("nan"), "period_s: expected a number from 0.001 to 60 s, got nan"),
        ("watchdog_s", True, "watchdog_s: expected a number from 0.001 to 60 s, got True"),
        ("watchdog_s", "1", "watchdog_s: expected a number from 0.001 to 60 s, got '1'"),
        ("frame", "", "frame: expected a text, got ''"),
        ("lost", "front", 'lost: expected a list of names such as ["a", "b"], got \'front\''),
        ("lost", [1], 'lost: expected a list of names such as ["a", "b"], got [1]'),
        ("nan", "ignore", "nan: expected one of refuse, free, got 'ignore'"),
        ("calm", -1.0, "calm: expected a number from 0, got -1.0"),
        ("power_w", float("nan"), "power_w: expected a number from 0 W, got nan"),
        ("autostart", 1, "autostart: expected true or false, got 1"),
        ("speed", 1, "speed: no such parameter, expected one of robot, policy"),
    ],
)
def test_a_value_is_refused(name: str, value: Any, sentence: str) -> None:
    with pytest.raises(CommandError) as refusal:
        Parameters().changed({name: value})
    assert str(refusal.value).startswith(sentence)
