"""`tools/ros_latency.py` with the monitor on and off: a few wrenches to two nodes over DDS."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: no wheel for this Python or machine")

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "ros_latency.py"


def test_both_nodes_answer_and_the_monitor_hears_a_robot_that_is_whole() -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--monitor", "--count", "60"],
        capture_output=True,
        text=True,
        timeout=200.0,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    for state in ("off", "on"):
        assert f"bluerov2_heavy, monitor {state}: 60 wrenches, 0 unanswered" in done.stdout
    assert done.stdout.count("node, answer time: p50") == 2
    assert "the monitor has found: nothing" in done.stdout
    assert "with the monitor over without:" in done.stdout
