"""The main job: a layout and a target wrench in, one command per fin out.

You will see amplitude, frequency and zero direction of layout A's four fins, and the wrench they deliver.
"""

import numpy as np

import finlab


def main() -> None:
    layout = finlab.load_layout("A")
    allocator = finlab.Allocator(layout)
    result = allocator.allocate([1, 0, 0.5, 0, 0, 0.1], seed=0)

    print("fin           A [rad]  f [Hz]  zero direction [deg]")
    for name, (amplitude, frequency, direction) in zip(result.fins, result.command, strict=True):
        print(f"{name:<12}  {amplitude:7.3f}  {frequency:6.3f}  {np.degrees(direction):20.1f}")
    print("delivered [N, N m]:", np.round(result.wrench, 3) + 0.0)
    print(f"normalized error {result.err_norm:.1e}, effort {result.effort:.2f}")


if __name__ == "__main__":
    main()
