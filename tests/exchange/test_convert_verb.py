"""`finlab layout convert`, and the way of a stranger's robot from its description to its own
computer."""

import json
from pathlib import Path

import pytest

from finlab.cli import main
from finlab.deploy.command import main as runtime
from tests.terminal import refused

HEAVY_URDF = str(Path(__file__).parent / "bluerov2_heavy.urdf")
"""Description of a BlueROV2 Heavy."""
WRENCH = [20.0, 0.0, 10.0, 0.0, 0.0, 2.0]
"""A wrench within its reach [N, N m]."""


def test_from_a_description_to_the_robot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["layout", "convert", HEAVY_URDF, "rov.yaml"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "rov.yaml: bluerov2_heavy with 8 thrusters"
    assert (
        lines[1] == "- It has no power: that of a T200 at 16 V is taken; write your own as `model`."
    )
    assert main(["layout", "show", "rov.yaml"]) == 0
    assert "axis (-0.707, -0.707, 0)" in capsys.readouterr().out
    asked = ["--wrench", *map(str, WRENCH), "--json"]
    assert main(["allocate", "rov.yaml", *asked, "--lost", "thruster4"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["err_norm"] < 1e-6 and told["lost"] == ["thruster4"]
    assert main(["export", "rov.yaml", "-o", "rov", "--lost", "thruster4"]) == 0
    assert runtime(["check", "rov"]) == 0
    assert "8 thrusters" in capsys.readouterr().out
    assert runtime(["allocate", "rov", *asked]) == 0
    there = json.loads(capsys.readouterr().out)
    assert there["actuators"] == told["actuators"] and there["power"] == told["power"]


def test_the_form_of_the_output_must_be_clear(tmp_path: Path) -> None:
    error = refused(["layout", "convert", HEAVY_URDF, str(tmp_path / "60999_rov")])
    assert "its end says no form; say --to layout, urdf, sdf, mjcf, px4, ardusub, matrix" in error
    assert main(["layout", "convert", HEAVY_URDF, str(tmp_path / "60999_rov"), "--to", "px4"]) == 0
    error = refused(["layout", "convert", "nowhere.urdf", str(tmp_path / "x.yaml")])
    assert "'nowhere.urdf' is neither a file nor a shipped layout" in error
    assert "param set-default CA_ROTOR_COUNT 8" in (tmp_path / "60999_rov").read_text()
