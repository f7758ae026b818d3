"""Bags as robots record them, made without ROS: the example turns them into swims that a fit
reads."""

import runpy
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from finlab.layout import load_layout
from finlab.swim.identification.swim import STEP_S, read_swim, replay
from tests.swim.identification.swims import swim

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "10_swim_from_rosbag.py"
"""The example under test."""
SWIM_S = 32.0
"""Length of the swim that is recorded [s]."""
BEGUN = 1_790_000_000_123_456_789
"""Time of the first message [ns]."""


@pytest.fixture(scope="module")
def swum() -> tuple[np.ndarray, np.ndarray]:
    """Commands (N, 4, 3) and measurements (N, 12)."""
    return swim(load_layout("A"), SWIM_S, 5)


@pytest.fixture
def convert() -> Callable[[Path, Path], int]:
    """The example's function from a bag to a file of a swim."""
    made: Callable[[Path, Path], int] = runpy.run_path(str(EXAMPLE))["convert"]
    return made


def messages(
    types: Any, swum: tuple[np.ndarray, np.ndarray], first: int
) -> list[tuple[int, str, Any]]:
    """Time [ns], topic and message; the first command comes some steps after the first odometry."""
    t = SimpleNamespace(**{name.rsplit("/", 1)[1]: made for name, made in types.types.items()})
    stamp = types.types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = t.Header(
        stamp=stamp, frame_id="odom", **({"seq": 0} if "seq" in _fields(t.Header) else {})
    )
    found = []
    for k, (command, said) in enumerate(zip(*swum, strict=True)):
        at = BEGUN + round(k * STEP_S * 1e9)
        x, y, z, w = Rotation.from_euler("xyz", said[3:6]).as_quat()
        pose = t.Pose(position=t.Point(*said[:3]), orientation=t.Quaternion(x=x, y=y, z=z, w=w))
        twist = t.Twist(linear=t.Vector3(*said[6:9]), angular=t.Vector3(*said[9:]))
        blank = np.zeros(36)
        odometry = t.Odometry(
            header=header,
            child_frame_id="base_link",
            pose=t.PoseWithCovariance(pose=pose, covariance=blank),
            twist=t.TwistWithCovariance(twist=twist, covariance=blank),
        )
        if k >= first:
            layout = t.MultiArrayLayout(dim=[], data_offset=0)
            told = t.Float64MultiArray(layout=layout, data=np.ascontiguousarray(command.ravel()))
            found.append((at - 1_000_000, "/fins/command", told))
        found.append((at, "/odometry", odometry))
    return found


def _fields(message: Any) -> set[str]:
    """Names of the fields of a message."""
    return set(message.__dataclass_fields__)


def write_bag(path: Path, kind: str, swum: tuple[np.ndarray, np.ndarray], first: int = 0) -> Path:
    """A bag of ROS 1 (`ros1`) or ROS 2 as Humble (`humble`) and Jazzy (`jazzy`) record it."""
    store = {"ros1": Stores.ROS1_NOETIC, "humble": Stores.ROS2_HUMBLE, "jazzy": Stores.ROS2_JAZZY}[
        kind
    ]
    types = get_typestore(store)
    encode = types.serialize_ros1 if kind == "ros1" else types.serialize_cdr
    if kind == "ros1":
        path = path.with_suffix(".bag")
        writer: Any = rosbag1.Writer(path)
    else:
        plugin = rosbag2.StoragePlugin.MCAP if kind == "jazzy" else rosbag2.StoragePlugin.SQLITE3
        writer = rosbag2.Writer(path, version=9 if kind == "jazzy" else 8, storage_plugin=plugin)
    with writer:
        known: dict[str, Any] = {}
        for at, topic, message in messages(types, swum, first):
            if topic not in known:
                known[topic] = writer.add_connection(topic, message.__msgtype__, typestore=types)
            writer.write(known[topic], at, encode(message, message.__msgtype__))
    return path


@pytest.mark.parametrize("kind", ["ros1", "humble", "jazzy"])
def test_a_bag_becomes_the_swim_that_it_recorded(
    kind: str,
    swum: tuple[np.ndarray, np.ndarray],
    convert: Callable[[Path, Path], int],
    tmp_path: Path,
) -> None:
    command, measured = swum
    assert convert(write_bag(tmp_path / "bag", kind, swum), tmp_path / "swim.csv") == len(command)
    found = read_swim(tmp_path / "swim.csv", load_layout("A"))
    np.testing.assert_allclose(found.measured, measured[: len(found)], atol=1e-7)
    np.testing.assert_allclose(
        found.motion, replay(load_layout("A"), command)[: len(found)], atol=1e-6
    )
    assert len(found) >= len(command) - 1


def test_what_was_measured_before_the_first_command_is_left_out(
    swum: tuple[np.ndarray, np.ndarray], convert: Callable[[Path, Path], int], tmp_path: Path
) -> None:
    assert convert(write_bag(tmp_path / "bag", "humble", swum, first=7), tmp_path / "swim.csv") == (
        len(swum[0]) - 7
    )


def test_a_bag_without_a_topic_is_refused_in_a_sentence(
    swum: tuple[np.ndarray, np.ndarray], convert: Callable[[Path, Path], int], tmp_path: Path
) -> None:
    bag = write_bag(tmp_path / "bag", "humble", swum, first=len(swum[0]))
    with pytest.raises(SystemExit, match="has no topic /fins/command, only /odometry"):
        convert(bag, tmp_path / "swim.csv")
    assert not (tmp_path / "swim.csv").exists()
