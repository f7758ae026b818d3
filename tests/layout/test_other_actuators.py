"""Thrusters, azimuths and rudders in a file: what is read, what is refused and why, and what is written."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.actuators.kinds import KINDS
from finlab.actuators.thrust_model import PowerTable
from finlab.errors import LayoutError
from finlab.files.schema import checked
from finlab.layout.file_form import Reader, actuator_form, plain

THRUSTER = {
    "name": "lift",
    "type": "thruster",
    "position_m": [0, 0.2, 0],
    "axis": [0, 0.6, 0.8],
    "force_n": [-39.91, 51.44],
    "model": {"type": "power_law", "forward": 0.997, "reverse": 1.449},
    "dead_band_n": 0.3,
    "torque_per_newton_m": -0.02,
    "rate_n_s": 100.0,
}
TABLE = {"type": "table", "rows": [[1100, -40, 380], [1500, 0, 0], [1900, 52, 300]], "unit": "us"}
AZIMUTH = {
    "name": "stern",
    "type": "azimuth",
    "position_m": [-0.5, 0, 0],
    "turn_axis": [0, 0, 1],
    "zero": [1, 0, 0],
    "force_n": [0, 20],
    "model": {"type": "power_law", "forward": 1.0},
    "turn_rate_deg_s": 90,
}
TILT = {**AZIMUTH, "type": "tilt", "arc_deg": [-20, 30]}
RUDDER = {
    "name": "rudder",
    "type": "rudder",
    "position_m": [-0.6, 0, 0],
    "shaft": [0, 0, 1],
    "zero": [1, 0, 0],
    "area_m2": 0.00665,
    "deflection_deg": [-15, 20],
    "aspect_ratio": 2.21,
}


def _read(data: Any, folder: Path | None = None) -> Any:
    return Reader(folder).value(checked(data, actuator_form(tuple(KINDS.values()))))


@pytest.mark.parametrize("data", [THRUSTER, {**THRUSTER, "model": TABLE}, AZIMUTH, TILT, RUDDER])
def test_what_is_written_is_read_the_same(data: dict[str, Any]) -> None:
    actuator = _read(data)
    assert _read(plain(actuator)) == actuator
    axes = np.array(actuator.frame)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) > 0.0
    assert len(actuator.lower) == len(actuator.upper) == 3


def test_degrees_become_radians() -> None:
    assert _read(TILT).arc == pytest.approx((np.radians(-20), np.radians(30)))
    assert _read(TILT).turn_rate == pytest.approx(np.pi / 2)
    assert _read(RUDDER).upper == pytest.approx((np.radians(20), 0.0, 0.0))


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        ({**THRUSTER, "axis": [0, 0, 0.7]}, "axis: expected a unit vector, got one of length 0.7"),
        ({**THRUSTER, "force_n": [5, 10]}, "force_n: must include 0"),
        ({**THRUSTER, "force_n": [0, 0]}, "force_n: must include 0"),
        ({**THRUSTER, "dead_band_n": 60}, "dead_band_n: leaves no force"),
        (
            {**THRUSTER, "model": {"type": "power_law", "forward": 1, "exponent": 1.05}},
            "model.exponent: must",
        ),
        ({**THRUSTER, "model": {"type": "table"}}, "model.rows: give either rows, or the path"),
        (
            {**THRUSTER, "model": {**TABLE, "rows": [[1, -9, 5], [2, 0, 0], [3, -1, 5]]}},
            "model.rows: the force must not fall with the command, row 3 has -1 N after 0 N",
        ),
        (
            {**THRUSTER, "model": {**TABLE, "rows": [[1, -9, 5], [3, 0, 0], [3, 9, 5]]}},
            "model.rows: the command must rise from row to row, row 3 has 3",
        ),
        (
            {**THRUSTER, "model": {**TABLE, "rows": [[0, 0, 0], [1, 20, 9], [2, 40, 10]]}},
            "model.rows: the power must grow ever faster with the force, but forward it lies 4 W above",
        ),
        ({**THRUSTER, "model": TABLE, "force_n": [-45, 50]}, "force_n: the table ends at -40 and 52 N"),
        ({**AZIMUTH, "force_n": [-20, 0]}, "force_n: expected a most force above 0 and above the least"),
        ({**AZIMUTH, "arc_deg": [20, -20]}, "arc_deg: must rise, by at most one turn, got 20 and -20"),
        ({**AZIMUTH, "type": "tilt"}, "arc_deg: required key is missing: the arc of a tilt"),
        ({**AZIMUTH, "zero": [0, 0, 1]}, "zero: must stand across turn_axis, got 0 degrees"),
        ({**RUDDER, "deflection_deg": [5, 5]}, "deflection_deg: expected a least below"),
        ({**RUDDER, "aspect_ratio": None}, "aspect_ratio: expected a number, got None"),
        ({**RUDDER, "type": "jet"}, "type: expected one of fin, thruster, azimuth, tilt, rudder, got 'jet'"),
    ],
)
def test_what_is_wrong_is_one_sentence_with_the_key(data: dict[str, Any], sentence: str) -> None:
    with pytest.raises(LayoutError, match=f"^{sentence}"):
        _read(data)


def test_a_table_comes_from_a_csv_file(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("power_w,command,force_n\n380,1100,-40\n0,1500,0\n300,1900,52\n")
    actuator = _read({**THRUSTER, "model": {"type": "table", "path": "t.csv"}}, tmp_path)
    assert actuator.model == PowerTable(((1100.0, -40.0, 380.0), (1500.0, 0.0, 0.0), (1900.0, 52.0, 300.0)))
    (tmp_path / "t.csv").write_text("command,force_n\n1,2\n")
    with pytest.raises(LayoutError, match=r"model\.path: .*t.csv: has no column power_w"):
        _read({**THRUSTER, "model": {"type": "table", "path": "t.csv"}}, tmp_path)


def test_lift_of_an_aspect_ratio() -> None:
    foil = _read(RUDDER)
    assert foil.slope == pytest.approx(2.61, abs=0.005)  # Whicker-Fehlner at the aspect ratio of REMUS
