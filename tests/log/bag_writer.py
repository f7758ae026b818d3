"""Bags of ROS 2, in MCAP, as robots record them: wrenches, and forces of thrusters."""

from pathlib import Path
from typing import Any

import numpy as np
from rosbags import rosbag2
from rosbags.typesys import Stores, get_typestore

from finlab.arrays import Array

TYPES = get_typestore(Stores.ROS2_HUMBLE)
"""Types of the messages of ROS 2 Humble."""


def write_bag(
    path: Path, time: Array, wrench: Array, force: Array, topics: tuple[str, ...] = ("/wrench",)
) -> None:
    """Writes a bag of wrenches, on several topics, and of forces of thrusters on `/forces`.

    Args:
        path: the bag's folder, which there is not yet.
        time: of each sample (T,) [s].
        wrench: body wrenches (T, 6) [N, N m].
        force: forces of n thrusters (T, n) [N].
        topics: where each wrench is published.
    """
    kinds = {name.rsplit("/", 1)[1]: made for name, made in TYPES.types.items()}
    vector = kinds["Vector3"]
    with rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
        known: dict[str, Any] = {}

        def put(topic: str, at: float, message: Any) -> None:
            kind = message.__msgtype__
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=TYPES)
            writer.write(known[topic], round(at * 1e9), TYPES.serialize_cdr(message, kind))

        for at, wanted, given in zip(time, wrench, force, strict=True):
            message = kinds["Wrench"](force=vector(*wanted[:3]), torque=vector(*wanted[3:]))
            for topic in topics:
                put(topic, at, message)
            told = kinds["Float64MultiArray"](
                layout=kinds["MultiArrayLayout"](dim=[], data_offset=0),
                data=np.ascontiguousarray(given),
            )
            put("/forces", at + 1e-4, told)
