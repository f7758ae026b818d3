"""A robot of four fins and two thrusters: light loads go to the fins, heavy ones to the thrusters.

You will see what more and more lift takes beside the least that any answer takes, the command of each
actuator, and what becomes of a lift out of reach by two policies.
"""

import finlab
from finlab.actuators.thruster import ThrusterCommand


def main() -> None:
    layout = finlab.load_layout("turtle_hybrid")
    allocator = finlab.Allocator(layout)
    for lift in (1.0, 10.0, 40.0, 100.0):
        result = allocator.allocate([2.0, 0.0, lift, 0.0, 0.0, 0.0])
        thrust = sum(each.force for each in result.commands.values() if isinstance(each, ThrusterCommand))
        print(f"{lift:5.0f} N up: {thrust:5.2f} N by thrusters, {result.power:6.2f} W", end=", ")
        print(f"least {result.bound:6.2f} W")
    for name, command in result.commands.items():
        print(f"{name:<12} {command}")
    for policy in ("closest", "direction"):
        result = allocator.allocate([10.0, 0.0, 150.0, 0.0, 0.0, 0.0], failed=["lift_left"], policy=policy)
        missing = ", ".join(f"{value:+.1f}" for value in result.unallocated)
        print(f"one thruster lost, {policy:<9}: err_norm {result.err_norm:.3f}, missing [{missing}]")


if __name__ == "__main__":
    main()
