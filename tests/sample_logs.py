"""The sample logs of the app: one dive, as each autopilot and ROS would log it.

`python -m tests.sample_logs` writes webapp/samples/dive.*. More of surge and yaw is asked for than
goes together for a sixth of the time, so that there is something to see.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from rosbags import rosbag2
from rosbags.typesys import Stores, get_typestore

from finlab.allocation import Allocator
from finlab.layout import load_layout
from tests.log.conftest import asked, px4_dive, sub_dive, sub_motion
from tests.log.telemetry_writer import telemetry_of, write_telemetry

FOLDER = Path(__file__).resolve().parents[1] / "webapp" / "samples"
"""Where the samples are."""
N_SAMPLES = 300
PERIOD_S = 0.1
"""Time between two of them [s]."""
TYPES = get_typestore(Stores.ROS2_HUMBLE)
"""Types of the messages of ROS 2."""


def write_samples(folder: Path) -> None:
    """Writes a sample of each kind into a folder."""
    px4_dive(folder / "dive.ulg", n=N_SAMPLES, dt=PERIOD_S)
    sub_dive(folder / "dive.bin", n=N_SAMPLES, dt=PERIOD_S)
    write_telemetry(folder / "dive.tlog", telemetry_of(sub_motion(N_SAMPLES, PERIOD_S)))
    write_bag(folder / "dive.mcap")


def write_bag(path: Path) -> None:
    """A bag of ROS 2 with wrenches, and the forces of the BlueROV2 Heavy's thrusters for them."""
    robot = load_layout("bluerov2_heavy")
    time, demand = asked(N_SAMPLES, PERIOD_S, 110.0, 24.0)
    force = Allocator(robot, "px4").allocate_batch(demand).command[..., 0]
    kinds = {name.rsplit("/", 1)[1]: made for name, made in TYPES.types.items()}
    with tempfile.TemporaryDirectory() as scratch:
        bag = Path(scratch) / "bag"
        plugin = rosbag2.StoragePlugin.MCAP
        with rosbag2.Writer(bag, version=9, storage_plugin=plugin) as writer:
            known: dict[str, Any] = {}

            def put(topic: str, at: float, message: Any) -> None:
                kind = message.__msgtype__
                if topic not in known:
                    known[topic] = writer.add_connection(topic, kind, typestore=TYPES)
                writer.write(known[topic], round(at * 1e9), TYPES.serialize_cdr(message, kind))

            vector = kinds["Vector3"]
            for at, wrench, forces in zip(time, demand, force, strict=True):
                wanted = kinds["Wrench"](force=vector(*wrench[:3]), torque=vector(*wrench[3:]))
                put("/wrench", at, wanted)
                dimensions = kinds["MultiArrayLayout"](dim=[], data_offset=0)
                told = kinds["Float64MultiArray"](
                    layout=dimensions, data=np.ascontiguousarray(forces)
                )
                put("/forces", at + 1e-4, told)
        (recorded,) = bag.glob("*.mcap")
        path.write_bytes(recorded.read_bytes())


if __name__ == "__main__":
    write_samples(FOLDER)
