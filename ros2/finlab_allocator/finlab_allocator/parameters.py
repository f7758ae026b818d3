"""The node's parameters: their types, ranges and what they mean. What depends on the robot, such as
names of actuators, is checked where there is one (`commander.py`)."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from finlab.allocation.policy import POLICY_NAMES
from finlab.errors import CommandError

DRIVES_CHOICES = ("off", "unsigned", "signed")
"""Whether drives are heard, and whether the signs of their speeds say which way they turn."""
NAN_CHOICES = ("refuse", "free")
"""What may be done with a component of a wrench that is NaN."""
SHORTEST_S = 0.001
"""Shortest period, and shortest silence that may count as one [s]."""
LONGEST_S = 60.0
"""The longest of both [s]."""


def _parameter(default: Any, description: str, read_only: bool = False) -> Any:
    """A field with what ROS shows of it."""
    return field(default=default, metadata={"description": description, "read_only": read_only})


@dataclass(frozen=True)
class Parameters:
    """Values of all parameters; None where one is not set."""

    robot: str = _parameter("", "the robot: name of a shipped layout, a layout file, or a bundle")
    policy: str = _parameter(
        "closest", f"what to give for a wrench out of reach: {', '.join(POLICY_NAMES)}"
    )
    period_s: float = _parameter(0.1, "time from one wrench to the next [s]")
    watchdog_s: float = _parameter(
        0.5, "silence after which the robot goes to neutral, and age of a stale wrench [s]"
    )
    frame: str = _parameter("base_link", "frame of the robot's layout")
    lost: tuple[str, ...] = _parameter((), "names of actuators that are lost")
    free: tuple[str, ...] = _parameter((), "names of axes that may take any wrench, such as Tx")
    nan: str = _parameter(
        "refuse", "what becomes of a wrench with NaN: refuse it, or free the axes that are NaN"
    )
    calm: float | None = _parameter(
        None, "what turning costs; the method's own where not set, or NaN"
    )
    power_w: float | None = _parameter(
        None,
        "the most power that all actuators take together [W]; the layout's own budget where not "
        "set, or infinite",
    )
    monitor: bool = _parameter(
        False, "whether actuators that the monitor takes for broken are done without"
    )
    accelerometer: bool = _parameter(
        False, "whether the monitor takes linear_acceleration of the IMU, gravity included"
    )
    pressure: bool = _parameter(False, "whether the monitor hears pressures, for depths")
    drives: str = _parameter(
        "off",
        "whether the monitor hears speeds and currents of the drives: off, unsigned, or signed "
        "where the signs of speeds say which way they turn",
    )
    autostart: bool = _parameter(
        True, "whether it configures and activates itself, without a lifecycle manager", True
    )

    def changed(self, values: Mapping[str, Any]) -> "Parameters":
        """Returns these parameters with other values.

        Args:
            values: new values by name, as ROS has them: lists of text may be empty, or hold empty
                texts, which count as nothing.

        Raises:
            CommandError: a value is of another type, or out of its range.
        """
        checked = {name: _checked(name, value) for name, value in values.items()}
        return replace(self, **checked)


def descriptions() -> dict[str, tuple[str, bool]]:
    """Returns what each parameter means, and whether it can be set only at the start, by name."""
    return {
        each.name: (each.metadata["description"], each.metadata["read_only"])
        for each in fields(Parameters)
    }


def _checked(name: str, value: Any) -> Any:
    """Returns a value as `Parameters` has it. Raises CommandError: it is not acceptable."""
    if name in ("robot", "frame"):
        return _text(name, value)
    if name == "policy":
        return _one_of(name, value, POLICY_NAMES)
    if name == "nan":
        return _one_of(name, value, NAN_CHOICES)
    if name in ("period_s", "watchdog_s"):
        return _number(name, value, SHORTEST_S, LONGEST_S, "s")
    if name == "calm":
        return None if _is_unset(value, math.isnan) else _number(name, value, 0.0, math.inf, "")
    if name == "power_w":
        return None if _is_unset(value, math.isinf) else _number(name, value, 0.0, math.inf, "W")
    if name in ("lost", "free"):
        return _names(name, value)
    if name == "drives":
        return _one_of(name, value, DRIVES_CHOICES)
    if name in ("autostart", "monitor", "accelerometer", "pressure"):
        if isinstance(value, bool):
            return value
        raise CommandError(f"{name}: expected true or false, got {value!r:.60}")
    known = ", ".join(each.name for each in fields(Parameters))
    raise CommandError(f"{name:.60}: no such parameter, expected one of {known}")


def _is_unset(value: Any, is_unset_by: Callable[[float], bool]) -> bool:
    """Whether there is no value, or the number that stands for none."""
    return value is None or (isinstance(value, float) and is_unset_by(value))


def _text(name: str, value: Any) -> str:
    if isinstance(value, str) and (value or name == "robot"):
        return value
    raise CommandError(f"{name}: expected a text, got {value!r:.60}")


def _one_of(name: str, value: Any, choices: tuple[str, ...]) -> str:
    if isinstance(value, str) and value in choices:
        return value
    raise CommandError(f"{name}: expected one of {', '.join(choices)}, got {value!r:.60}")


def _number(name: str, value: Any, least: float, most: float, unit: str) -> float:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if is_number and math.isfinite(value) and least <= value <= most:
        return float(value)
    upper = "" if math.isinf(most) else f" to {most:g}"
    raise CommandError(
        f"{name}: expected a number from {least:g}{upper} {unit}".rstrip() + f", got {value!r:.60}"
    )


def _names(name: str, value: Any) -> tuple[str, ...]:
    if value is None:
        return ()
    if isinstance(value, list | tuple) and all(isinstance(each, str) for each in value):
        return tuple(dict.fromkeys(each for each in value if each))
    raise CommandError(f'{name}: expected a list of names such as ["a", "b"], got {value!r:.60}')
