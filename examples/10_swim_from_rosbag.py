"""From a rosbag to a CSV file that `finlab fit robot` reads; `pip install rosbags`, no ROS.

You will see how it is called, or, given a bag (ROS 1 or 2) and a file to write, how many rows were written.
Odometry is taken from nav_msgs/Odometry (pose in the world, z up; twist in the body frame), commands from a
std_msgs/Float64MultiArray with A [rad], f [Hz], phi [rad] of each fin in order: change TOPICS to yours.
"""

import csv
import math
import sys
from pathlib import Path
from typing import Any

TOPICS = {"odometry": "/odometry", "commands": "/fins/command"}
FINS = ("front_right", "front_left", "back_left", "back_right")
POSE = ("x", "y", "z", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r")


def row_of(message: Any) -> list[float]:
    """Position, attitude angles, velocity and rates of an odometry message."""
    at = message.pose.pose.position
    q = message.pose.pose.orientation
    roll = math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x**2 + q.y**2))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (q.w * q.y - q.z * q.x))))
    yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y**2 + q.z**2))
    linear = message.twist.twist.linear
    angular = message.twist.twist.angular
    speed = [part for v in (linear, angular) for part in (v.x, v.y, v.z)]
    return [at.x, at.y, at.z, roll, pitch, yaw, *speed]


def convert(bag: Path, output: Path) -> int:
    """Writes the CSV file; one row for each odometry message once there is a command."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    command: list[float] = []
    rows: list[list[float]] = []
    # Bags of ROS 2 before Iron do not say what their messages look like.
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for topic in set(TOPICS.values()) - reader.topics.keys():
            raise SystemExit(
                f"{bag}: has no topic {topic}, only {', '.join(sorted(reader.topics))}"
            )
        chosen = [c for c in reader.connections if c.topic in TOPICS.values()]
        for connection, nanoseconds, raw in reader.messages(connections=chosen):
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.topic == TOPICS["commands"]:
                command = [float(value) for value in message.data]
            elif command:
                rows.append([(nanoseconds - reader.start_time) * 1e-9, *row_of(message), *command])
    names = [f"{fin}.{part}" for fin in FINS for part in ("A", "f", "phi")]
    with output.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([["t", *POSE, *names], *rows])
    return len(rows)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        print(convert(Path(sys.argv[1]), Path(sys.argv[2])), "rows written; now fit:")
    print("python 10_swim_from_rosbag.py BAG swim.csv && finlab fit robot A swim.csv -o mine.yaml")
