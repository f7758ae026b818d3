"""Bags of ROS 1 and 2, read by rosbags: a wrench that was asked for, and what actuators were sent.

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
from finlab.log.recorded import Event, Recorded, Series

WRENCHES = ("geometry_msgs/msg/Wrench", "geometry_msgs/msg/WrenchStamped")
SHARES = "actuator_msgs/msg/Actuators"
OUTPUTS = ("std_msgs/msg/Float64MultiArray", "std_msgs/msg/Float32MultiArray", SHARES)
HEALTH = "diagnostic_msgs/msg/DiagnosticArray"
WARNING = 1
"""Level of a diagnostic from which on it is told."""
ENDS = (".bag", ".mcap", ".db3")
"""How files of bags end; one of ROS 2 may be a folder of them."""


def read_bag(path: Path, demand: str | None, outputs: str | None) -> Recorded:
    """Reads a bag; topics by name, or the only ones of their kinds. Raises DataError: it lacks a
    topic, or has several; any error: it is damaged."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    rows: dict[str, list[tuple[float, Any]]] = defaultdict(list)
    events: list[Event] = []
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        kinds = {each.topic: each.msgtype for each in reader.connections}
        demanded = _topic(path, kinds, WRENCHES, demand, "demand")
        sent = _topic(path, kinds, OUTPUTS, outputs, "outputs")
        read = [
            each
            for each in reader.connections
            if each.topic in (demanded, sent) or each.msgtype == HEALTH
        ]
        for connection, nanoseconds, raw in reader.messages(read):
            message: Any = reader.deserialize(raw, connection.msgtype)
            time = (nanoseconds - reader.start_time) * 1e-9
            if connection.msgtype == HEALTH:
                warnings = [each for each in message.status if each.level >= WARNING]
                events += [Event(time, f"{each.name}: {each.message}") for each in warnings]
            else:
                rows[connection.topic].append((time, _numbers(message)))
    record = Recorded("ros", _series(path, demanded, rows), events=events)
    record.lacking.append("A bag holds no robot; name it by --robot LAYOUT.")
    if sent in rows:
        record.outputs = _series(path, sent, rows)
        record.of_shares = kinds[sent] == SHARES
    return record


def _numbers(message: Any) -> Any:
    """What a message of a wrench or of outputs holds."""
    if (wrench := getattr(message, "wrench", message)) is message and not hasattr(message, "force"):
        return getattr(message, "normalized", getattr(message, "data", ()))
    return [value for part in (wrench.force, wrench.torque) for value in (part.x, part.y, part.z)]


def _topic(
    path: Path, kinds: dict[str, str], wanted: Sequence[str], named: str | None, option: str
) -> str | None:
    """The topic that an option names, or the only one of some types; None where there are no
    outputs."""
    topics = [topic for topic in sorted(kinds) if kinds[topic] in wanted and named in (None, topic)]
    if not topics and (named is not None or option == "demand"):
        what = "" if named is None else f" {named!r:.60}"
        only = ", ".join(sorted(kinds)) or "none"
        raise DataError(f"{path}: has no topic{what} of {' or '.join(wanted)}, only {only}")
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
