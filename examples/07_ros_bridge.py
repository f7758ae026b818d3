# %% [markdown]
# # A bridge to ROS 2
# Wrenches come in, fin commands go out, by a robot's bundle. Without ROS a stand-in plays the topics. You
# will see what the bridge publishes for three wrenches, and the last answer.

# %%
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
        force = message.wrench.force
        torque = message.wrench.torque
        wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z]
        self.answer = self.allocator.allocate(wrench)
        self.publish(Message(flippers=[*map(flipper, self.answer.names, self.answer.command)]))


def flipper(name: str, beat: tuple[float, float, float]) -> dict[str, float]:
    """One message of U-CAT's simulator, whose amplitude is the whole stroke."""
    a, f, phi = beat
    return {
        "motor_number": MOTORS.index(name) + 1,
        "frequency": f,
        "zero_direction": phi,
        "amplitude": 2 * a,
    }


# %% [markdown]
# Stand-ins for `geometry_msgs/WrenchStamped` and for a publisher.


# %%
def wrench_stamped(fx: float, fz: float, tz: float) -> Message:
    force = Message(x=fx, y=0.0, z=fz)
    torque = Message(x=0.0, y=0.0, z=tz)
    return Message(wrench=Message(force=force, torque=torque))


def show(message: Message) -> None:
    for fin in message.flippers:
        print(
            "motor {motor_number}: {frequency:.2f} Hz, {amplitude:.3f} rad".format(**fin), end="; "
        )
    print()


# %%
with TemporaryDirectory() as folder:
    make_bundle(finlab.Allocator(finlab.load_layout("ucat"))).write(folder)
    bridge = Bridge(folder, show)
for wrench in (
    wrench_stamped(0, 0, 0),
    wrench_stamped(1.0, 0.5, 0.0),
    wrench_stamped(0.5, 0.0, 0.1),
):
    bridge.on_wrench(wrench)
bridge.answer
