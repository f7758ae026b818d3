"""The topics of single actuators: one for each number of a command, and one for the force."""

import re
from typing import NamedTuple

import numpy as np

from finlab.actuators.actuator import Actuator
from finlab.arrays import Array
from finlab.layout import Layout

NO_TOPIC = re.compile(r"[^A-Za-z0-9_]+")
"""What names of topics may not hold."""


class NumberTopic(NamedTuple):
    """A topic with one number of one actuator."""

    name: str
    """Name of the topic, such as `front_left/force`."""
    actuator: int
    """Index of the actuator."""
    number: int | None
    """Which number of its command; None for the size of its force, of kinds whose command does not
    hold it."""


def number_topics(layout: Layout) -> list[NumberTopic]:
    """Returns the topics of all actuators of a robot, in order."""
    topics: list[NumberTopic] = []
    for index, (actuator, folder) in enumerate(
        zip(layout.actuators, topic_names(layout.names), strict=True)
    ):
        for number, name in enumerate(number_names(actuator)):
            topics.append(NumberTopic(f"{folder}/{name}", index, number))
        if actuator.KIND.force_number is None:
            topics.append(NumberTopic(f"{folder}/force", index, None))
    return topics


def number_names(actuator: Actuator) -> tuple[str, ...]:
    """Returns the names of the numbers of a command, such as `("angle", "force")`."""
    count = len(actuator.KIND.numbers)
    return tuple(actuator.KIND.command.__struct_fields__[:count])


def topic_names(names: tuple[str, ...]) -> list[str]:
    """Returns names of actuators as parts of names of topics: with `_` for whatever a topic may not
    hold, and a number behind one that would be there twice."""
    parts: list[str] = []
    for name in names:
        part = NO_TOPIC.sub("_", name).strip("_") or "actuator"
        if part[0].isdigit():
            part = f"actuator_{part}"
        base = part
        count = 1
        while part in parts:
            count += 1
            part = f"{base}_{count}"
        parts.append(part)
    return parts


def values_to_send(layout: Layout, command: Array) -> Array:
    """Returns commands (n, 3) without NaN for topics that drives listen to: a lost actuator rests.

    Its angle stays NaN: nothing is sent of it.

    Args:
        layout: the robot of n actuators.
        command: (n, 3), NaN for lost ones.
    """
    if not np.isnan(command).any():
        return command
    sent = command.copy()
    for index, actuator in enumerate(layout.actuators):
        if np.isnan(command[index]).any():
            sent[index] = actuator.neutral()
            angle = actuator.KIND.aiming_number
            if angle is not None:
                sent[index, angle] = np.nan
    return sent
