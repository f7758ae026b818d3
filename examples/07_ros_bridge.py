"""A bridge between ROS 2 and a robot's bundle: wrenches come in, fin commands go out.

You will see what it publishes for three wrenches; without ROS, a stand-in plays the topics.
"""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace as Message

import finlab
from finlab.deploy.bundle import make_bundle
from finlab.exchange import flippers


class Bridge:
    """On a robot: node.create_subscription(WrenchStamped, "wrench", bridge.on_wrench, 1)."""

    def __init__(self, bundle: str, publish: Callable[[Message], None]) -> None:
        self.allocator = finlab.Allocator.from_bundle(bundle)
        self.publish = publish

    def on_wrench(self, message: Message) -> None:
        force, torque = message.wrench.force, message.wrench.torque
        wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z]
        answer = self.allocator.allocate(wrench)
        self.publish(Message(flippers=[m._asdict() for m in flippers(answer.fins, answer.command)]))


def wrench_stamped(fx: float, fz: float, tz: float) -> Message:
    """A stand-in for geometry_msgs/WrenchStamped."""
    force, torque = Message(x=fx, y=0.0, z=fz), Message(x=0.0, y=0.0, z=tz)
    return Message(wrench=Message(force=force, torque=torque))


def show(message: Message) -> None:
    """A stand-in for a publisher."""
    for fin in message.flippers:
        number, amplitude = fin["motor_number"], fin["amplitude"]
        print(f"motor {number}: {fin['frequency']:.2f} Hz, {amplitude:.3f} rad from end to end", end="; ")
    print()


def main() -> None:
    layout = finlab.load_layout("ucat")
    with TemporaryDirectory() as folder:
        bundle = Path(folder) / "ucat"
        make_bundle(finlab.Allocator(layout)).write(bundle)
        bridge = Bridge(str(bundle), show)
        for wrench in (wrench_stamped(1.0, 0.5, 0.0), wrench_stamped(0.5, 0.0, 0.1), wrench_stamped(0, 0, 0)):
            bridge.on_wrench(wrench)


if __name__ == "__main__":
    main()
