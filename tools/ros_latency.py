#!/usr/bin/env python3
"""Asks a ROS 2 node for many wrenches over DDS, and prints how long it takes for an answer.

`tools/ros_latency.py [ROBOT] [--count N]` starts a node in a process of its own, on the loopback,
sends each wrench when the one before is answered, compares commands with the library's, and prints
the node's own time (from the message in to the last one out), and the round trip.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "ros2" / "finlab_allocator")]

import finlab  # noqa: E402
from tests.ros2.conftest import Listener, NodeProcess, forces, own_domain  # noqa: E402

SHARE = 0.2
"""Standard deviation of the wrenches along each axis, over the robot's scale."""


def main() -> int:
    """Prints the figures; 1 where an answer differs from the library's, or does not come."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("robot", nargs="?", default="bluerov2_heavy")
    parser.add_argument("--count", type=int, default=10_000, help="wrenches")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as logs:
        os.environ.update(own_domain(Path(logs)))
        import rclpy

        rclpy.init()
        listener = Listener()
        node = NodeProcess(f"robot:={options.robot}", "watchdog_s:=5.0")
        try:
            listener.until_answered()
            return _measure(listener, options.robot, options.count)
        finally:
            node.end()
            rclpy.shutdown()


def _measure(listener: Listener, robot: str, count: int) -> int:
    """Asks, and prints."""
    layout = finlab.load_layout(robot)
    allocator = finlab.Allocator(layout)
    wrenches = np.random.default_rng(0).normal(size=(count, 6)) * allocator.scale * SHARE
    is_comparable = all(part.KIND.force_number == 0 for part in layout.actuators)
    round_trips = []
    unanswered = 0
    largest_difference = 0.0
    for wrench in wrenches:
        start = time.perf_counter()
        answer = listener.ask(wrench)
        round_trips.append(time.perf_counter() - start)
        if answer is None:
            unanswered += 1
        elif is_comparable:
            expected = allocator.allocate(wrench).command[:, 0]
            difference = np.abs(forces(answer, layout.names) - expected).max()
            largest_difference = max(largest_difference, float(difference))
        listener.commands.clear()
    listener.next_status()
    values = listener.values
    p50, p99 = 1e3 * np.quantile(round_trips, (0.5, 0.99))
    print(f"{robot}: {count} wrenches, {unanswered} unanswered")
    if is_comparable:
        print(f"largest difference from the library: {largest_difference:.1e} N")
    for what in ("answer time", "processor time"):
        own_p50, own_p99 = values[f"{what} p50 [ms]"], values[f"{what} p99 [ms]"]
        print(f"node, {what}: p50 {own_p50} ms, p99 {own_p99} ms")
    print(f"round trip: p50 {p50:.3f} ms, p99 {p99:.3f} ms")
    return int(unanswered > 0 or largest_difference > 1e-6)


if __name__ == "__main__":
    sys.exit(main())
