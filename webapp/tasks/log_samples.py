"""The sample logs that the page opens: one dive, as each autopilot and ROS would log it."""

from importlib.resources import files
from typing import NamedTuple

from finlab.layout import Layout
from webapp.session.files import shipped


class Sample(NamedTuple):
    """A log in `webapp/samples`."""

    words: str
    """What its button says."""
    file: str
    robot: str = ""
    """Shipped robot by whose laws it is judged; empty where its own parameters tell."""

    def content(self) -> bytes:
        """The file."""
        return files("webapp.samples").joinpath(self.file).read_bytes()

    def layout(self) -> Layout | None:
        """The shipped robot; None where its own parameters tell."""
        return shipped()[self.robot] if self.robot else None


SAMPLES = (
    Sample("PX4 (.ulg)", "dive.ulg"),
    Sample("ArduSub (.bin)", "dive.bin"),
    Sample("Telemetry (.tlog)", "dive.tlog"),
    Sample("ROS 2 (.mcap)", "dive.mcap", "bluerov2_heavy"),
)
"""The samples, in the order of their buttons."""
