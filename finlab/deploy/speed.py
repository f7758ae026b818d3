"""How fast, how soon and how small: one way to answer, in a process of its own.

    python -m finlab.deploy.speed runtime BUNDLE [--fast] [--engine onnx]
    python -m finlab.deploy.speed library LAYOUT.yaml

Both answer the same targets, one by one, so that the lines of one run may be compared. Start-up is the time
from this module's first line to the first answer, memory is the process's peak.
"""

from __future__ import annotations

import time

_START = time.perf_counter()

import argparse  # noqa: E402 (the clock starts first)
import os  # noqa: E402
import resource  # noqa: E402
import sys  # noqa: E402
from collections.abc import Callable  # noqa: E402
from functools import partial  # noqa: E402
from typing import Any  # noqa: E402

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

N_TARGETS = 2000
N_WARM = 100


def measure(allocate: Callable[[Any], Any], targets: Any) -> tuple[float, float]:
    """Median and 99th percentile [ms] of single answers, targets one after the other."""
    import numpy as np

    for target in targets[:N_WARM]:
        allocate(target)
    times = []
    for target in targets:
        start = time.perf_counter()
        allocate(target)
        times.append(time.perf_counter() - start)
    p50, p99 = np.percentile(times, [50, 99]) * 1e3
    return float(p50), float(p99)


def reachable_targets(layout: Any, count: int) -> Any:
    """Wrenches (count, 6) of random commands by the default fin law."""
    import numpy as np

    lower = layout.lower
    upper = layout.upper
    command = lower + np.random.default_rng(0).random((count, layout.n_fins, 3)) * (upper - lower)
    thrust = 4.7 * (np.sin(command[..., 0]) * command[..., 1]) ** 2
    angle = layout.mounting_angle
    c, s = thrust * np.cos(command[..., 2]), thrust * np.sin(command[..., 2])
    force = np.stack([-np.sin(angle) * c, np.cos(angle) * c, s], axis=-1)
    torque = np.cross(layout.position, force)
    return np.concatenate([force.sum(1), torque.sum(1)], axis=-1)


def main() -> int:
    """See the module."""
    parser = argparse.ArgumentParser("python -m finlab.deploy.speed", description=__doc__)
    parser.add_argument("way", choices=("runtime", "library"))
    parser.add_argument("path")
    parser.add_argument("--fast", action="store_true")
    parser.add_argument("--engine", choices=("numpy", "onnx"), default="numpy")
    parser.add_argument("--targets", type=int, default=N_TARGETS)
    arguments = parser.parse_args()
    name = f"{arguments.way}{' --fast' if arguments.fast else ''}, {arguments.engine}"
    if arguments.way == "runtime":
        from finlab.deploy.runtime import load

        runtime = load(arguments.path, arguments.engine, arguments.fast)
        layout = runtime.layout
        allocate: Callable[[Any], Any] = runtime.allocate
    else:
        import finlab

        layout = finlab.load_layout(arguments.path)
        allocator = finlab.load_allocator("fast" if arguments.fast else "learned")
        allocate = partial(allocator.allocate, layout)
        allocate([0.0] * 6)
    ready = time.perf_counter() - _START
    p50, p99 = measure(allocate, reachable_targets(layout, arguments.targets))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{name:24} {layout.n_fins} fins: p50 {p50:.2f} ms, p99 {p99:.2f} ms, "
        f"ready after {ready:.2f} s, peak memory {peak:.0f} MB"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
