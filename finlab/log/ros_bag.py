"""Reads bags of ROS 1 and 2 by rosbags: demanded wrenches, and outputs of actuators.

Wrenches are geometry_msgs/Wrench or WrenchStamped [N, N m], x forward, y left, z up, NaN for an
axis that is free. Outputs are actuator_msgs/Actuators (`normalized`) or a Float64MultiArray: of n
numbers forces of thrusters [N], of 3 n numbers commands as the actuators' laws take them.
"""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from finlab.errors import DataError
from finlab.log.recorded import Event, LogRecord, Series

WRENCH_TYPES = ("geometry_msgs/msg/Wrench", "geometry_msgs/msg/WrenchStamped")
ACTUATORS = "actuator_msgs/msg/Actuators"
OUTPUT_TYPES = ("std_msgs/msg/Float64MultiArray", "std_msgs/msg/Float32MultiArray", ACTUATORS)
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
WARNING = 1
"""Level of a diagnostic from which on it is an event."""
SUFFIXES = (".bag", ".mcap", ".db3")
"""Suffixes of bags; one of ROS 2 may be a folder of such files."""


def read_bag(path: Path, demand: str | None, outputs: str | None) -> LogRecord:
    """Reads a bag.

    Args:
        path: the bag, a file or a folder.
        demand: topic of the wrench; the only one of such a type when None.
        outputs: topic of the outputs; the only one of such a type, if any, when None.

    Raises:
        DataError: it lacks a topic, or has several.
        Exception: of any class, where the bag is damaged.
    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    rows: dict[str, list[tuple[float, Any]]] = defaultdict(list)
    events: list[Event] = []
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        kinds = {each.topic: each.msgtype for each in reader.connections}
        demand_topic = _topic(path, kinds, WRENCH_TYPES, demand, "demand")
        output_topic = _topic(path, kinds, OUTPUT_TYPES, outputs, "outputs")
        connections = [
            each
            for each in reader.connections
            if each.topic in (demand_topic, output_topic) or each.msgtype == DIAGNOSTICS
        ]
        for connection, nanoseconds, raw in reader.messages(connections):
            message: Any = reader.deserialize(raw, connection.msgtype)
            time = (nanoseconds - reader.start_time) * 1e-9
            if connection.msgtype == DIAGNOSTICS:
                warnings = [each for each in message.status if each.level >= WARNING]
                events += [Event(time, f"{each.name}: {each.message}") for each in warnings]
            else:
                rows[connection.topic].append((time, _numbers(message)))
    record = LogRecord("ros", _series(path, demand_topic, rows), events=events)
    record.lacking.append("A bag holds no robot; name it by --robot LAYOUT.")
    if output_topic in rows:
        record.outputs = _series(path, output_topic, rows)
        record.of_shares = kinds[output_topic] == ACTUATORS
    return record


def _numbers(message: Any) -> Any:
    """The numbers in a message of a wrench or of outputs."""
    is_stamped = hasattr(message, "wrench")
    if not is_stamped and not hasattr(message, "force"):
        return getattr(message, "normalized", getattr(message, "data", ()))
    wrench = message.wrench if is_stamped else message
    force = wrench.force
    torque = wrench.torque
    return [force.x, force.y, force.z, torque.x, torque.y, torque.z]


def _topic(
    path: Path, kinds: dict[str, str], types: Sequence[str], name: str | None, option: str
) -> str | None:
    """The topic of demands or outputs; None where there are no outputs.

    Args:
        path: the bag, for the errors.
        kinds: the types of all topics.
        types: types that a topic may have.
        name: the topic that the user names; the only one of these types when None.
        option: `demand` or `outputs`.
    """
    topics = [topic for topic in sorted(kinds) if kinds[topic] in types and name in (None, topic)]
    if not topics and (name is not None or option == "demand"):
        shown = "" if name is None else f" {name!r:.60}"
        present = ", ".join(sorted(kinds)) or "none"
        raise DataError(f"{path}: has no topic{shown} of {' or '.join(types)}, only {present}")
    if len(topics) > 1:
        raise DataError(
            f"{path}: has several topics for {option}: {', '.join(topics)}; say --{option} TOPIC"
        )
    return topics[0] if topics else None


def _series(path: Path, topic: str | None, rows: dict[Any, list[tuple[float, Any]]]) -> Series:
    times, values = zip(*rows[topic], strict=True) if rows[topic] else ((), ())
    if len(widths := {*map(len, values)}) != 1 or 0 in widths:
        raise DataError(
            f"{path}: {topic}: expected messages of one length, got {sorted(widths) or 'none'}"
        )
    return Series.of(np.array(times), np.array(values, np.float64))
