"""A robot in MuJoCo loses a thruster; the node, over DDS, says which, and goes on."""

import subprocess
import sys

import pytest

from tests.ros2.conftest import ROOT, NodeProcess

SCRIPT = ROOT / "ros2" / "finlab_allocator" / "examples" / "mujoco_robot.py"


def test_the_lost_thruster_is_named_and_the_robot_goes_on(ros: None) -> None:
    pytest.importorskip("mujoco")
    node = NodeProcess("robot:=bluerov2_heavy", "monitor:=true", "policy:=direction")
    try:
        done = subprocess.run(
            [sys.executable, str(SCRIPT), "--lose", "front_left", "--at", "9", "--until", "15"],
            capture_output=True,
            text=True,
            timeout=60.0,
        )
        assert node.lives
    finally:
        _, errors = node.end()
    assert done.returncode == 0, done.stdout + done.stderr + errors
    assert "status: answering; the wrench is delivered; found: front_left lost for" in done.stdout
    assert "authority: Fx (surge): 44 % is left" in done.stdout
