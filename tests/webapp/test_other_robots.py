"""Robots that the app cannot show yet are refused in a sentence, and nothing that they name is opened."""

import json
from pathlib import Path

import pytest

from finlab.assets import shipped_layouts
from finlab.errors import LayoutError
from webapp.session.files import read_layout, read_together, shipped


def test_a_thruster_is_named() -> None:
    content = shipped_layouts()["turtle_hybrid"].read_bytes()
    with pytest.raises(LayoutError, match="the app works for robots of fins only, and 'lift_left'"):
        read_layout("mine.yaml", content)
    with pytest.raises(LayoutError, match="the app works for robots of fins only, and 'lift_left'"):
        read_together({"mine.yaml": content})
    assert "turtle_hybrid" not in shipped() and "ucat" in shipped()


def test_a_table_of_thrust_on_the_server_is_not_opened(tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("command,force_n,power_w\n-1,-5,9\n0,0,0\n1,5,9\n")
    model = {"type": "table", "path": str(tmp_path / "secret.csv")}
    thruster = {"name": "t", "type": "thruster", "position_m": [0, 0, 0], "axis": [0, 0, 1]}
    robot = {"format": "finlab-layout", "version": 2, "name": "x"}
    robot["actuators"] = [{**thruster, "force_n": [-5, 5], "model": model}]
    content = json.dumps(robot).encode()
    for read in (lambda: read_layout("x.json", content), lambda: read_together({"x.json": content})):
        with pytest.raises(LayoutError, match="model.path: names a file, which is not opened here"):
            read()
