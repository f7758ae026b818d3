"""The main job: a layout and a target wrench in, one command per fin out.

You will see amplitude, frequency and zero direction of layout A's four fins, the wrench they deliver, and
their power beside the least that any answer takes.
"""

import numpy as np

import finlab


def main() -> None:
    layout = finlab.load_layout("A")
    allocator = finlab.Allocator(layout)
    result = allocator.allocate([1, 0, 0.5, 0, 0, 0.1], seed=0)

    print("fin           A [rad]  f [Hz]  zero direction [deg]")
    for name, (amplitude, frequency, direction) in zip(result.names, result.command, strict=True):
        print(f"{name:<12}  {amplitude:7.3f}  {frequency:6.3f}  {np.degrees(direction):20.1f}")
    print("delivered [N, N m]:", np.round(result.wrench, 3) + 0.0)
    print(f"error {result.err_norm:.1e} of what the robot can push")
    print(f"power {result.power:.4f} W, no answer takes less than {result.bound:.4f} W")


if __name__ == "__main__":
    main()
