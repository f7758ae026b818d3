"""Allocate many targets at once: a path that turns the robot while it swims forward.

You will see how many targets per second one call allocates, and the worst error among them.
"""

import time

import numpy as np

import finlab

N_TARGETS = 512


def main() -> None:
    layout = finlab.load_layout("ucat")
    phase = np.linspace(0, 2 * np.pi, N_TARGETS)
    targets = np.zeros((N_TARGETS, 6))
    targets[:, 0] = 1.0
    targets[:, 5] = 0.2 * np.sin(phase)

    allocator = finlab.Allocator(layout)
    start = time.perf_counter()
    result = allocator.allocate_batch(targets)
    seconds = time.perf_counter() - start

    print(
        f"{N_TARGETS} targets, {N_TARGETS / seconds:.0f} per second, "
        f"worst err_norm {result.err_norm.max():.1e}"
    )


if __name__ == "__main__":
    main()
