"""Layouts from and to the parameters of PX4, the factors of ArduSub, and allocation matrices."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange import Exchange, convert, read_any
from finlab.exchange.motor_factors import FRAMES, factors_of
from finlab.layout import Layout, Thruster, own_effectiveness, save_layout
from tests.random_robots import load, random_robot

DIAGONAL = np.sqrt(0.5)
"""Part of a unit vector along each of two axes, between which it lies."""
DIRECTIONS = [
    (-DIAGONAL, -DIAGONAL, 0),
    (-DIAGONAL, DIAGONAL, 0),
    (DIAGONAL, -DIAGONAL, 0),
    (DIAGONAL, DIAGONAL, 0),
    *[(0, 0, -1)] * 4,
]
"""Force of each thruster of a BlueROV2 Heavy for a positive output of ArduSub, x forward, y left, z
up."""
AIRFRAME_SCRIPT = """#!/bin/sh
# @name Some robot, with motors in x forward, y right, z down
. ${R}etc/init.d/rc.uuv_defaults
param set-default CA_AIRFRAME 7
param set-default CA_ROTOR_COUNT 3
param set-default CA_R_REV 3   # the third pushes one way only
param set-default CA_ROTOR0_PX 0.5
param set-default CA_ROTOR0_PY 0.3
param set-default CA_ROTOR0_PZ 0.2
param set-default CA_ROTOR0_AX 1.0
param set-default CA_ROTOR0_AY -1.0
param set-default CA_ROTOR0_AZ 0.0
param set-default CA_ROTOR0_CT 40
param set-default CA_ROTOR0_KM 0.0
param set CA_ROTOR1_AZ 1.0
param set CA_ROTOR1_PY -.5
param set-default CA_ROTOR2_KM -0.02
"""
"""A start script of PX4, with parameters and with lines that are none."""


def thrusters(number: int) -> Layout:
    """A random robot of thrusters."""
    return load(random_robot("thrusters", number, 7))


def written(
    layout: Layout, path: Path, to: str | None = None, **unsaid: str
) -> tuple[Layout, list[str]]:
    """A layout that went into a file and came back, and the notes of both ways."""
    save_layout(layout, path.with_name("before.json"))
    exchange = Exchange(**unsaid)  # type: ignore[arg-type]
    convert(str(path.with_name("before.json")), path, to, exchange)
    return read_any(str(path), exchange), exchange.notes


def wrenches(layout: Layout) -> Array:
    """Wrench of 1 N of each thruster (n, 6)."""
    return own_effectiveness(layout)[:, 0]


def test_px4_rotors_push_and_turn_as_its_formula_says(tmp_path: Path) -> None:
    path = tmp_path / "60999_some_robot"
    path.write_text(AIRFRAME_SCRIPT)
    layout = read_any(str(path), Exchange())
    first, second, third = layout.actuators
    assert isinstance(third, Thruster)
    np.testing.assert_allclose(
        (first.position, first.frame[0]), [(0.5, -0.3, -0.2), (DIAGONAL, DIAGONAL, 0)], atol=1e-15
    )
    np.testing.assert_allclose([part.lower[0] for part in layout.actuators], [-40.0, -6.5, 0.0])
    np.testing.assert_allclose([part.upper[0] for part in layout.actuators], [40.0, 6.5, 6.5])
    # CT (p x a - KM a) in x forward, y right, z down; the usual axis is -z, the usual KM 0.05.
    for part, place, axis, km in (
        (first, (0.5, 0.3, 0.2), (DIAGONAL, -DIAGONAL, 0.0), 0.0),
        (second, (0.0, -0.5, 0.0), (0.0, 0.0, 1.0), 0.05),
        (third, (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), -0.02),
    ):
        torque = np.cross(place, axis) - km * np.array(axis)
        own = wrenches(replace(layout, actuators=(part,)))[0]
        np.testing.assert_allclose(own * [1, -1, -1, 1, -1, -1], [*axis, *torque], atol=1e-15)


@pytest.mark.parametrize("name", ["robot.params", "airframe.sh"])
def test_px4_gives_back_what_it_has_a_place_for(name: str, tmp_path: Path) -> None:
    for number in range(8):
        layout = thrusters(number)
        both = tuple(
            replace(part, force=(-part.force[1] if part.force[0] else 0.0, part.force[1]))
            for part in layout.actuators
            if isinstance(part, Thruster)
        )
        layout = replace(layout, actuators=both[:12])
        back, notes = written(layout, tmp_path / name, "px4")
        np.testing.assert_allclose(wrenches(back), wrenches(layout), atol=1e-12)
        np.testing.assert_array_equal(back.upper, layout.upper)
        np.testing.assert_array_equal(back.lower, layout.lower)
        assert notes[0].startswith("PX4 has no place for power")


def test_px4_has_one_size_for_both_ways(tmp_path: Path) -> None:
    back, notes = written(finlab.load_layout("bluerov2_heavy"), tmp_path / "rov.params")
    assert "PX4 has one size for both ways: 51.44 N stands for -39.91 N, too." in notes
    np.testing.assert_array_equal(back.lower[:, 0], -51.44)
    one_way = Thruster("a", (0, 1, 0), (1, 0, 0), (-5.0, 0.0), PowerLaw(1.0), torque_per_newton=0.1)
    back, _ = written(Layout("one", (one_way,)), tmp_path / "one.params")
    assert back.upper[0, 0] == 5.0 and back.lower[0, 0] == 0.0
    np.testing.assert_allclose(-wrenches(back), wrenches(Layout("one", (one_way,))), atol=1e-15)


def test_ardusub_frames_have_the_directions_of_the_bluerov2(tmp_path: Path) -> None:
    path = tmp_path / "rov.csv"
    path.write_text(factor_rows("VECTORED_6DOF"))
    layout = read_any(str(path), Exchange())
    shipped = finlab.load_layout("bluerov2_heavy")
    np.testing.assert_allclose(wrenches(layout)[:, :3], DIRECTIONS, atol=1e-15)
    np.testing.assert_allclose(wrenches(shipped)[:, :3], DIRECTIONS, atol=1e-7)
    torques = wrenches(layout)[:, 3:]
    own = wrenches(shipped)[:, 3:]
    clear = np.abs(torques) > 0.01
    np.testing.assert_array_equal(np.sign(torques)[clear], np.sign(own)[clear])


def factor_rows(frame: str) -> str:
    """A table of a frame's factors."""
    rows = [
        ",".join(map(str, [f"motor{i}", *row])) for i, row in enumerate(FRAMES[frame].tolist(), 1)
    ]
    return "\n".join(["motor,roll,pitch,yaw,throttle,forward,lateral", *rows])


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("name", ["factors.csv", "motors.cpp"])
def test_factors_survive_the_way_there_and_back(frame: str, name: str, tmp_path: Path) -> None:
    source = tmp_path / "frame.csv"
    source.write_text(factor_rows(frame))
    layout = read_any(str(source), Exchange())
    back, _ = written(layout, tmp_path / name, "ardusub")
    np.testing.assert_allclose(
        factors_of(back, Exchange())[1], factors_of(layout, Exchange())[1], atol=1e-12
    )


@pytest.mark.parametrize("frame", ["FLU", "FRD"])
@pytest.mark.parametrize("name", ["matrix.csv", "matrix.yaml"])
def test_a_matrix_gives_back_wrenches_and_limits(name: str, frame: str, tmp_path: Path) -> None:
    for number in range(5):
        layout = thrusters(number)
        back, notes = written(layout, tmp_path / name, "matrix", frame=frame)
        assert back.names == layout.names
        np.testing.assert_allclose(wrenches(back), wrenches(layout), atol=1e-12)
        np.testing.assert_allclose(back.lower, layout.lower, rtol=1e-12)
        np.testing.assert_allclose(back.upper, layout.upper, rtol=1e-12)
        assert any("places along the lines" in note for note in notes)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("tam.yaml", "a:\n  tam:\n  - [40, 0]\n  - [0, 40]\n  - [0, 0]\n  - [0, 0]\n  - [0, 0]\n  - [-8, 4]"),
        ("tam.yaml", "controller: {ros__parameters: {tam: {fx: [40, 0], fy: [0, 40], fz: [0, 0], tx: [0, 0], "
                     "ty: [0, 0], tz: [-8, 4]}}}"),
        ("tam.yaml", "names: [a, b]\nmatrix: [40, 0, 0, 40, 0, 0, 0, 0, 0, 0, -8, 4]"),
        ("tam.csv", "40, 0\n0, 40\n0, 0\n0, 0\n0, 0\n-8, 4\n"),
        ("tam.csv", "# FRD\naxis, a, b\nFx, 40, 0\nFy, 0, -40\nFz, 0, 0\nTx, 0, 0\nTy, 0, 0\nTz, 8, -4"),
    ],
)  # fmt: skip
def test_matrices_of_others(name: str, content: str, tmp_path: Path) -> None:
    """40 N per unit of a command from -1 to 1, 0.2 m right of the centre and 0.1 m ahead of it."""
    (tmp_path / name).write_text(content)
    exchange = Exchange()
    layout = read_any(str(tmp_path / name), exchange)
    np.testing.assert_allclose(
        wrenches(layout), [[1, 0, 0, 0, 0, -0.2], [0, 1, 0, 0, 0, 0.1]], atol=1e-15
    )
    np.testing.assert_allclose(layout.position, [[0, 0.2, 0], [0.1, 0, 0]], atol=1e-15)
    assert (layout.lower[0, 0], layout.upper[1, 0]) == (-40.0, 40.0)
    assert any("from -1 to 1" in note for note in exchange.notes)


def test_a_published_matrix_of_the_bluerov2(tmp_path: Path) -> None:
    """Arms of the matrix that users of ROS 2 load for it: yaw 0.1888 m, roll 0.21805, pitch
    0.12."""
    arms = np.zeros((8, 3))
    arms[:4, 2] = [-0.1888, 0.1888, 0.1888, -0.1888]
    arms[4:, 0] = [0.21805, -0.21805, 0.21805, -0.21805]
    arms[4:, 1] = [0.12, 0.12, -0.12, -0.12]
    matrix = np.hstack([np.array(DIRECTIONS), arms])
    rows = "\n".join(",".join(map(repr, row)) for row in matrix.T.tolist())
    (tmp_path / "tam.csv").write_text(rows)
    layout = read_any(str(tmp_path / "tam.csv"), Exchange())
    np.testing.assert_allclose(wrenches(layout), matrix, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(layout.position[:4], axis=1), 0.1888)
    places = list(product((0.12, -0.12), (-0.21805, 0.21805), (0.0,)))
    np.testing.assert_allclose(layout.position[4:], places, atol=1e-15)
    assert (layout.lower[0, 0], layout.upper[0, 0]) == (-39.91, 51.44)
    convert(str(tmp_path / "tam.csv"), tmp_path / "rov.cpp", None, Exchange())
    assert (tmp_path / "rov.cpp").read_text().count("add_motor_raw_6dof") == 8


def test_a_thruster_through_the_centre_has_no_factor_of_torque() -> None:
    part = Thruster("stern", (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-1.0, 1.0), PowerLaw(1.0))
    _, factors = factors_of(Layout("one", (part,)), Exchange())
    np.testing.assert_array_equal(factors, [[0, 0, 0, 0, 1, 0]])


def test_what_has_no_place_is_named(tmp_path: Path) -> None:
    _, notes = written(finlab.load_layout("turtle_hybrid"), tmp_path / "turtle.params")
    assert notes[0].startswith(
        "PX4 has a place for thrusters alone; left out are front_right (fin), "
    )
    with pytest.raises(
        LayoutError, match="layout A has no thruster, and a matrix has a place for these alone"
    ):
        written(finlab.load_layout("A"), tmp_path / "a.csv")


def test_lines_that_fit_nothing_take_no_time(tmp_path: Path) -> None:
    path = tmp_path / "a.cpp"
    numbers = ", ".join(["1" * 70] * 6)
    long = f"a({numbers}x\nA_B{' ' * 100_000}x\n"
    path.write_text("add_motor(1, 0, 0, 0, 0, 1, 0)\n" + 20 * long)
    assert read_any(str(path), Exchange()).n == 1
