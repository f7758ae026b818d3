"""The sample logs of the app: one dive, as each autopilot and ROS would log it.

`python -m tests.sample_logs` writes webapp/samples/dive.*. More of surge and yaw is asked for than
goes together for a sixth of the time, so that there is something to see.
"""

import tempfile
from pathlib import Path

from finlab.allocation import Allocator
from finlab.layout import load_layout
from tests.log.bag_writer import write_bag
from tests.log.conftest import asked, px4_dive, sub_dive, sub_motion
from tests.log.telemetry_writer import telemetry_of, write_telemetry

FOLDER = Path(__file__).resolve().parents[1] / "webapp" / "samples"
"""Where the samples are."""
N_SAMPLES = 300
PERIOD_S = 0.1
"""Time between two of them [s]."""


def write_samples(folder: Path) -> None:
    """Writes a sample of each kind into a folder."""
    px4_dive(folder / "dive.ulg", n=N_SAMPLES, dt=PERIOD_S)
    sub_dive(folder / "dive.bin", n=N_SAMPLES, dt=PERIOD_S)
    write_telemetry(folder / "dive.tlog", telemetry_of(sub_motion(N_SAMPLES, PERIOD_S)))
    write_dive_bag(folder / "dive.mcap")


def write_dive_bag(path: Path) -> None:
    """A bag of ROS 2 with wrenches, and the forces of the BlueROV2 Heavy's thrusters for them."""
    robot = load_layout("bluerov2_heavy")
    time, demand = asked(N_SAMPLES, PERIOD_S, 110.0, 24.0)
    force = Allocator(robot, "px4").allocate_batch(demand).command[..., 0]
    with tempfile.TemporaryDirectory() as scratch:
        bag = Path(scratch) / "bag"
        write_bag(bag, time, demand, force)
        (recorded,) = bag.glob("*.mcap")
        path.write_bytes(recorded.read_bytes())


if __name__ == "__main__":
    write_samples(FOLDER)
