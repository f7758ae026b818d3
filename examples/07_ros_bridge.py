"""A bridge between ROS 2 and a robot's bundle: wrenches come in, fin commands go out.

You will see what it publishes for three wrenches; without ROS, a stand-in plays the topics.
"""

from collections.abc import Callable
from tempfile import TemporaryDirectory
from types import SimpleNamespace as Message

import finlab
from finlab.deploy.bundle import make_bundle

MOTORS = ("front_right", "back_right", "back_left", "front_left")


class Bridge:
    """On a robot: node.create_subscription(WrenchStamped, "wrench", bridge.on_wrench, 1)."""

    def __init__(self, bundle: str, publish: Callable[[Message], None]) -> None:
        self.allocator = finlab.Allocator.from_bundle(bundle)
        self.publish = publish

    def on_wrench(self, message: Message) -> None:
        force, torque = message.wrench.force, message.wrench.torque
        wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z]
        answer = self.allocator.allocate(wrench)
        self.publish(Message(flippers=[*map(flipper, answer.names, answer.command)]))


def flipper(name: str, beat: tuple[float, float, float]) -> dict[str, float]:
    """One message of U-CAT's simulator, whose amplitude is the whole stroke."""
    a, f, phi = beat
    return {"motor_number": MOTORS.index(name) + 1, "frequency": f, "zero_direction": phi, "amplitude": 2 * a}


def wrench_stamped(fx: float, fz: float, tz: float) -> Message:
    """A stand-in for geometry_msgs/WrenchStamped."""
    force, torque = Message(x=fx, y=0.0, z=fz), Message(x=0.0, y=0.0, z=tz)
    return Message(wrench=Message(force=force, torque=torque))


def show(message: Message) -> None:
    """A stand-in for a publisher."""
    for fin in message.flippers:
        print("motor {motor_number}: {frequency:.2f} Hz, {amplitude:.3f} rad".format(**fin), end="; ")
    print()


def main() -> None:
    with TemporaryDirectory() as folder:
        make_bundle(finlab.Allocator(finlab.load_layout("ucat"))).write(folder)
        bridge = Bridge(folder, show)
        for wrench in (wrench_stamped(1.0, 0.5, 0.0), wrench_stamped(0.5, 0.0, 0.1), wrench_stamped(0, 0, 0)):
            bridge.on_wrench(wrench)


if __name__ == "__main__":
    main()
