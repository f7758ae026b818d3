"""Thrusters, azimuths and rudders in a file: what is read, what is refused and why, and what is
written."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.actuators.kinds import KINDS
from finlab.actuators.thrust_model import PowerTable
from finlab.errors import LayoutError
from finlab.files.schema import checked
from finlab.layout import Azimuth, Fin, Rudder, Thruster, Tilt, parse_layout
from finlab.layout.load import PartReader, actuator_form
from finlab.layout.save import plain

THRUSTER_DATA = {
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
"""A thruster of a layout file."""
TABLE_DATA = {
    "type": "table",
    "rows": [[1100, -40, 380], [1500, 0, 0], [1900, 52, 300]],
    "unit": "us",
}
"""A measured model of a layout file."""
AZIMUTH_DATA = {
    "name": "stern",
    "type": "azimuth",
    "position_m": [-0.5, 0, 0],
    "turn_axis": [0, 0, 1],
    "zero": [1, 0, 0],
    "force_n": [0, 20],
    "model": {"type": "power_law", "forward": 1.0},
    "turn_rate_deg_s": 90,
}
"""A pod of a layout file."""
TILT_DATA = {**AZIMUTH_DATA, "type": "tilt", "arc_deg": [-20, 30]}
"""A pod with an arc of a layout file."""
RUDDER_DATA = {
    "name": "rudder",
    "type": "rudder",
    "position_m": [-0.6, 0, 0],
    "shaft": [0, 0, 1],
    "zero": [1, 0, 0],
    "area_m2": 0.00665,
    "deflection_deg": [-15, 20],
    "aspect_ratio": 2.21,
}
"""A rudder of a layout file."""


def read_actuator(data: Any, folder: Path | None = None) -> Any:
    """An actuator as a layout file's reader makes it."""
    return PartReader(folder).value(checked(data, actuator_form(tuple(KINDS.values()))))


@pytest.mark.parametrize(
    "data",
    [THRUSTER_DATA, {**THRUSTER_DATA, "model": TABLE_DATA}, AZIMUTH_DATA, TILT_DATA, RUDDER_DATA],
)
def test_what_is_written_is_read_the_same(data: dict[str, Any]) -> None:
    actuator = read_actuator(data)
    assert read_actuator(plain(actuator)) == actuator
    axes = np.array(actuator.frame)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) > 0.0
    assert len(actuator.lower) == len(actuator.upper) == 3


def test_degrees_become_radians() -> None:
    assert read_actuator(TILT_DATA).arc == pytest.approx((np.radians(-20), np.radians(30)))
    assert read_actuator(TILT_DATA).turn_rate == pytest.approx(np.pi / 2)
    assert read_actuator(RUDDER_DATA).upper == pytest.approx((np.radians(20), 0.0, 0.0))


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (
            {**THRUSTER_DATA, "axis": [0, 0, 0.7]},
            "axis: expected a unit vector, got one of length 0.7",
        ),
        ({**THRUSTER_DATA, "force_n": [5, 10]}, "force_n: must include 0"),
        ({**THRUSTER_DATA, "force_n": [0, 0]}, "force_n: must include 0"),
        ({**THRUSTER_DATA, "dead_band_n": 60}, "dead_band_n: leaves no force"),
        (
            {**THRUSTER_DATA, "model": {"type": "power_law", "forward": 1, "exponent": 1.05}},
            "model.exponent: must",
        ),
        (
            {**THRUSTER_DATA, "model": {"type": "table"}},
            "model.rows: give either rows, or the path",
        ),
        (
            {**THRUSTER_DATA, "model": {**TABLE_DATA, "rows": [[1, -9, 5], [2, 0, 0], [3, -1, 5]]}},
            "model.rows: the force must not fall with the command, row 3 has -1 N after 0 N",
        ),
        (
            {**THRUSTER_DATA, "model": {**TABLE_DATA, "rows": [[1, -9, 5], [3, 0, 0], [3, 9, 5]]}},
            "model.rows: the command must rise from row to row, row 3 has 3",
        ),
        (
            {
                **THRUSTER_DATA,
                "model": {**TABLE_DATA, "rows": [[0, 0, 0], [1, 20, 9], [2, 40, 10]]},
            },
            "model.rows: the power must grow ever faster with the force, but forward it lies 4 W "
            "above",
        ),
        (
            {**THRUSTER_DATA, "model": TABLE_DATA, "force_n": [-45, 50]},
            "force_n: the table ends at -40 and 52 N",
        ),
        (
            {**AZIMUTH_DATA, "force_n": [-20, 0]},
            "force_n: expected a most force above 0 and above the least",
        ),
        (
            {**AZIMUTH_DATA, "arc_deg": [20, -20]},
            "arc_deg: must rise, by at most one turn, got 20 and -20",
        ),
        ({**AZIMUTH_DATA, "type": "tilt"}, "arc_deg: is missing: the arc of a tilt"),
        ({**AZIMUTH_DATA, "zero": [0, 0, 1]}, "zero: must stand across turn_axis, got 0 degrees"),
        ({**RUDDER_DATA, "deflection_deg": [5, 5]}, "deflection_deg: expected a least below"),
        ({**RUDDER_DATA, "aspect_ratio": None}, "aspect_ratio: expected a number, got None"),
        (
            {**RUDDER_DATA, "type": "jet"},
            "type: expected one of fin, thruster, azimuth, tilt, rudder, propeller_rudder, got 'jet'",
        ),
    ],
)
def test_what_is_wrong_is_one_sentence_with_the_key(data: dict[str, Any], sentence: str) -> None:
    key, words = sentence.split(": ", 1)
    with pytest.raises(LayoutError, match=f"^{key}( of {data['type']} '{data['name']}')?: {words}"):
        read_actuator(data)


@pytest.mark.parametrize(
    ("kind", "arguments", "sentence"),
    [
        (
            Thruster,
            {"force": (3.0, 2.0)},
            "force of thruster 'own': must include 0, .* got 3 and 2",
        ),
        (
            Thruster,
            {"position": (0.0, 0.0)},
            "position of thruster 'own': expected a list of 3 values",
        ),
        (Thruster, {"dead_band": 99.0}, "dead_band of thruster 'own': leaves no force"),
        (Azimuth, {"arc": (1.0, -1.0)}, "arc of azimuth 'own': must rise, by at most one turn"),
        (Tilt, {"arc": (-3.1415926, 3.1415926)}, "arc of tilt 'own': is missing"),
        (Rudder, {"deflection": (0.1, 0.1)}, "deflection of rudder 'own': expected a least below"),
        (Rudder, {"shaft": (0.0, 0.0, 0.5)}, "shaft of rudder 'own': expected a unit vector"),
        (
            Fin,
            {"mounting_angle": None},
            "mounting_angle of fin 'own': is missing; give it, or shaft",
        ),
        (Fin, {"mounting_angle": 9e9}, "mounting_angle of fin 'own': must lie within"),
    ],
)
def test_in_python_a_refusal_names_the_argument_and_the_actuator(
    kind: type[Any], arguments: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(LayoutError, match=f"^{sentence}"):
        replace(kind.sample(), name="own", **arguments)


def test_in_a_file_the_same_refusal_names_the_key_and_the_actuator() -> None:
    parts = [RUDDER_DATA, {**THRUSTER_DATA, "force_n": [3, 2]}]
    data = {"format": "finlab-layout", "version": 2, "name": "two", "actuators": parts}
    with pytest.raises(LayoutError) as caught:
        parse_layout(data, "two.yaml")
    expected = (
        f"two.yaml: actuators[1].force_n of thruster {THRUSTER_DATA['name']!r}: must include 0"
    )
    assert str(caught.value).startswith(expected)


def test_a_table_comes_from_a_csv_file(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(
        "power_w,command,force_n\n380,1100,-40\n0,1500,0\n300,1900,52\n"
    )
    actuator = read_actuator(
        {**THRUSTER_DATA, "model": {"type": "table", "path": "t.csv"}}, tmp_path
    )
    assert actuator.model == PowerTable(
        ((1100.0, -40.0, 380.0), (1500.0, 0.0, 0.0), (1900.0, 52.0, 300.0))
    )
    (tmp_path / "t.csv").write_text("command,force_n\n1,2\n")
    with pytest.raises(LayoutError, match=r"model\.path: .*t.csv: has no column power_w"):
        read_actuator({**THRUSTER_DATA, "model": {"type": "table", "path": "t.csv"}}, tmp_path)


def test_lift_of_an_aspect_ratio() -> None:
    foil = read_actuator(RUDDER_DATA)
    assert foil.slope == pytest.approx(
        2.61, abs=0.005
    )  # Whicker-Fehlner at the aspect ratio of REMUS
