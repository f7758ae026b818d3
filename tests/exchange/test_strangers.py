"""Files as other programs write them: read rightly, or refused in a sentence that says why."""
# ruff: noqa: E501  # files stand as they are written

import time
from pathlib import Path

import numpy as np
import pytest

from finlab.errors import LayoutError
from finlab.exchange import Exchange, read_any, read_robot
from finlab.layout import Layout, own_effectiveness

SCREW = (
    '<link name="hull"><inertial><mass>12</mass><inertia><ixx>.2</ixx><iyy>.3</iyy><izz>.3</izz></inertia></inertial>'
    '</link><link name="screw"><pose>-0.4 0 0 0 0 0</pose></link><joint name="sj" type="revolute"><parent>hull</parent>'
    "<child>screw</child><axis><xyz>1 0 0</xyz></axis></joint>"
)
"""A hull and a propeller that turns, in SDF."""
THRUSTER = '<plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster"><joint_name>sj</joint_name></plugin>'
"""The plugin that makes a thruster of this propeller."""
COLUMNS = np.array([[1, 0, 0, 0, 0, 0.3], [1, 0, 0, 0, 0, -0.3], [0, 0, 1, 0.1, -0.2, 0]])
"""Wrenches per newton of a robot's port, starboard and lift, x forward, y left, z up."""


def read(file: str, text: str, **said: object) -> tuple[Layout, str]:
    """The layout of a text under a file name, and the notes about what was not said."""
    exchange = Exchange(**said)  # type: ignore[arg-type]
    return read_robot(text, file, exchange), " ".join(exchange.notes)


def effectiveness_of(layout: Layout) -> np.ndarray:
    """Effectiveness (n, 6) of each actuator along its first axis."""
    return own_effectiveness(layout)[:, 0]


def sdf(inside: str, version: str = "1.9") -> str:
    """A robot in SDF."""
    return f'<sdf version="{version}"><model name="rov">{inside}</model></sdf>'


@pytest.mark.parametrize(
    ("file", "text", "read_as"),
    [
        ("a.yaml", "names: [port, starboard, lift]\ntam: [1, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, .1, 0, 0, -.2, .3, -.3, 0]", "tam"),
        ("a.yaml", "tam: {rows: 6, cols: 3, dt: d, data: [1,1,0, 0,0,0, 0,0,1, 0,0,.1, 0,0,-.2, .3,-.3,0]}", "tam"),
        ("a.yaml", "node:\n  allocation_matrix:\n    surge: [1, 1, 0]\n    sway: [0, 0, 0]\n    heave: [0, 0, 1]\n"
                   "    roll: [0, 0, 1e-1]\n    pitch: [0, 0, -0.2]\n    yaw: [0.3, -0.3, 0]", "node.allocation_matrix"),
        ("a.yaml", "mixer: {port: [1,0,0,0,0,.3], starboard: [1,0,0,0,0,-.3], lift: [0,0,1,.1,-.2,0]}\n"
                   "mass_matrix: [[1,0,0,0,0,0],[0,1,0,0,0,0],[0,0,1,0,0,0],[0,0,0,1,0,0],[0,0,0,0,1,0],[0,0,0,0,0,1]]",
         "Not read: mass_matrix"),
        ("a.yaml", "frame: ned\nmatrix: {fx: [1,1,0], fy: [0,0,0], fz: [0,0,-1], mx: [0,0,.1], my: [0,0,.2], mz: [-.3,.3,0]}",
         "y right, z down (frame ned), and was turned to x forward, y left, z up"),
        ("a.csv", "name,Fx,Fy,Fz,Tx,Ty,Tz,min,max\nport,1,0,0,0,0,0.3,-5,6\nstarboard,1,0,0,0,0,-3e-1,-5,6\n"
                  "lift,0,0,1,0.1,-0.2,0,-5,6\n", "a row per thruster"),
        ("a.csv", "# body frame SNAME, port and starboard\nX;Y;Z;K;M;N\n1;0;0;0;0;-.3\n1;0;0;0;0;.3\n0;0;-1;.1;.2;0\n", "its comment"),
        ("a.txt", "1 0 0 0 0 0.3\n1 0 0 0 0 -0.3\n0 0 1 0.1 -0.2 0\n", "taken for thrusters"),
    ],
)  # fmt: skip
def test_matrices_of_every_shape(file: str, text: str, read_as: str) -> None:
    layout, notes = read(file, text)
    np.testing.assert_allclose(effectiveness_of(layout), COLUMNS, atol=1e-12)
    assert read_as in notes


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("a.yaml", "matrix: [1, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]", "12 numbers in one list, which may be 2 rows of 6, 3 rows"),
        ("a.yaml", "tam: {rows: 5, cols: 2, data: [1, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]}", "12 numbers in one list, which may"),
        ("a.yaml", "names: [a, a]\ntam: [[1, 1], [0, 0], [0, 0], [0, 0], [0, 0], [1, -1]]", "holds 2 names, expected 2, each another"),
        ("a.yaml", "mass_matrix: [[1,0],[0,1],[1,1],[0,0],[0,0],[0,0]]", "its lists of numbers, mass_matrix"),
        ("a.yaml", "tam: [[1, 1], [0, 0], [0.3, -0.3]]", "is 3 rows of 2 numbers, expected six rows"),
        ("a.yaml", "body: {inertia: {matrix: [[1,0,0],[0,1,0],[0,0,1],[0,0,0],[0,0,0],[0,0,0]]}}", "no key that says so"),
        ("a.yaml", "tam: [[1, 1], [0, 0, 0]]", "tam: is no matrix: its rows differ"),
        ("a.yaml", "frame: quadrant\ntam: {fx: [1], fz: [0]}", "frame: is 'quadrant', expected FLU, ENU"),
        ("a.yaml", "tam: {fx: [1], fz: [0]}\nmixer: {fx: [1], fz: [0]}", "a matrix more than once, at tam, mixer"),
        ("a.yaml", "a: &x [1]\nb: *x", "anchors and aliases .* write the value out"),
        ("a.csv", "\n".join(",".join(f"{i * j + 1}.5" for i in range(6)) for j in range(6)), "without labels, which may be"),
        ("a.csv", "\n".join(["0.5,0,0,0.1,0,1"] * 4), "a row per thruster .* or the inverse"),
        ("a.csv", "axis,a,b\nFx,1,1\nFy,0,O\nTz,.3,-.3", "row 3: 'O' is no number"),
        ("a.csv", "axis,a,b\nFx,1,1\nFg,0,0\nTz,.3,-.3", "row 3 begins with 'Fg'"),
        ("a.csv", "name,x,y,z,roll,pitch,yaw\na,0,0,0,0,0,1\n", "which may be its wrench, or its place and angles"),
        ("a.csv", "name,Fx,Fy,Tz\na,1,0,0.3\nb,1,0,x\n", "row 3: Tz is 'x', expected a number"),
        ("a.csv", "motor,roll,pitch,yaw,throttle,forward,lateral\n1,0,0,1,0,1,0\n2,0,0,-1,0,1,l\n", "row 3: lateral is 'l'"),
        ("a.params", "1 1 CA_ROTOR_COUNT 1 6\n1 1 CA_ROTOR0_PX 0.5x 9", "line 2: CA_ROTOR0_PX is '0.5x'"),
        ("a.parm", "FRAME_CONFIG 7", "FRAME_CONFIG: is 7, a frame of one's own"),
        ("a.parm", "FRAME_CLASS 1\nMOT_SPIN_MIN 0.1", "parameters of ArduPilot of another vehicle"),
        ("a.params", "1 1 BAT1_N_CELLS 4 6", "holds 1 parameters of an autopilot, but neither"),
        ("a.lua", "motors:add_motor_raw_6dof(0, 0, 0, 1,\n 0, side, 0, 1)", "line 1: 'side' is not defined in the file"),
        ("a.cpp", "x\nadd_motor_raw_6dof(AP_MOTORS_MOT_1, 0, 0, 1/2, 0, 1, 0, 1);", "line 2: '1/2' divides whole"),
        ("a.lua", "print(1)", "is a program without a call of add_motor_raw_6dof"),
        ("a.yaml", "thrusters:\n- {position: [0,0,0], orientation: [0,0,1]}", "may be a direction, or roll, pitch"),
        ("a.yaml", "t:\n  a: {position: [0,0,0], axis: [1,0,0]}\n  b: {position: [0,0,0]}", "t.b: has no direction"),
        ("a.params", "1 1 CA_ROTOR0_PX 1 9", "CA_ROTOR_COUNT: expected 1 to 12 rotors, got 0"),
        ("a.params", "CA_ROTOR_COUNT 1e400", "line 1: CA_ROTOR_COUNT is '1e400', expected a number"),
        ("a.params", "CA_ROTOR_COUNT 1\nCA_ROTOR0_AZ 0", "CA_ROTOR0: has no direction"),
        ("a.cpp", "add_motor", "has no rows of factors"),
        ("a.cpp", "add_motor_raw_6dof(AP_MOTORS_MOT_1, 1, 0, 0, 0, 0, 0, 1);", "'motor1' has no force"),
        ("a.cpp", "add_motor(1, 0, 0, 0, 1, 0, 0, 1);\n" * 2, "adds a motor twice, motor2; keep"),
        ("a.yaml", "matrix: [[1], [2]]", "matrix: is 2 rows of 1 numbers, expected six"),
        ("a.yaml", "limits: [[0, 1]]\nnames: [a, b]\nmatrix: [1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]", "limits"),
        ("a.csv", "\n".join([",".join("1" * 257)] * 6), "expected up to 256 columns, got 257"),
        ("a.json", "[1", "is not valid JSON"),
        ("a.txt", "Dear all,", "holds no|has no matrix|holds none"),
        ("a.sdf", sdf('<include><uri>model://x</uri></include>' + SCREW + THRUSTER.replace("sj", "x::j")),
         "names joint 'x::j', which moves no link in it, or stands in what is included: x"),
        ("a.world", f'<sdf version="1.9"><world name="w"><include><name>my auv</name><uri>m</uri>{THRUSTER}</include>'
                    '<include><uri>model://sun</uri></include></world></sdf>', "the robot is in <include> my auv, which"),
        ("a.sdf", sdf('<include merge="true"><uri>model://wamv</uri></include>' + THRUSTER), "in <include> wamv, which is not"),
        ("a.xacro", '<robot xmlns:xacro="x"><link name="${a}"/></robot>', "is a xacro file, .* expands it"),
        ("a.xml", "<launch/>", "got <launch>"),
        ("a.scn", '<scenario><include file="b.scn"/></scenario>', "Stonefish without a <robot>; it includes b.scn, which are not opened"),
    ],
)  # fmt: skip
def test_what_stands_in_the_way_is_named(file: str, text: str, message: str) -> None:
    with pytest.raises(LayoutError, match=message):
        read(file, text)


def test_rows_and_frames_may_be_said() -> None:
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(6, 6)).round(3)
    text = "\n".join(",".join(map(str, row)) for row in matrix.tolist())
    for rows, expected in (("axes", matrix.T), ("thrusters", matrix)):
        layout, _ = read("a.csv", text, rows=rows, force=(-1.0, 1.0))
        size = np.linalg.norm(expected[:, :3], axis=1, keepdims=True)
        np.testing.assert_allclose(effectiveness_of(layout), expected / size, atol=1e-12)
    layout, notes = read(
        "a.yaml", "frame: FLU\ntam: {fx: [1], fy: [0], fz: [0], tz: [1]}", frame="FRD"
    )
    assert effectiveness_of(layout)[0, 5] == -1.0 and "FRD was taken" in notes


def test_a_boat_commands_the_axes_of_its_rows() -> None:
    layout, notes = read("a.csv", "axis,l,r\nFx,1,1\nTz,-0.4,0.4\n")
    assert layout.axes == ("Fx", "Tz") and "no row Fy, Fz, Tx, Ty" in notes
    np.testing.assert_allclose(
        effectiveness_of(layout), [[1, 0, 0, 0, 0, -0.4], [1, 0, 0, 0, 0, 0.4]], atol=1e-12
    )


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("a.yaml", "thrusters:\n- {name: a, pos_mm: [100, 200, 0], axis: [0, 0, 2], max_thrust_kgf: 1}"),
        ("a.yaml", "cog: [0.1, 0, 0]\nt: {a: {xyz: {x: 0.2, y: 0.2, z: 0}, direction: [0, 0, 1], min: -9.80665, max: 9.80665}}"),
        ("a.yaml", "frame: SNAME\nt: {a: {position: [0.1, -0.2, 0], direction: [0, 0, -1]}, bounds: [-9.80665, 9.80665]}"),
        ("a.yaml", "t: {a: {position: [0.1, 0.2, 0], rpy_deg: [0, -90, 0], force_limits_n: [-9.80665, 9.80665]}}"),
        ("a.csv", "thruster,x (mm),y (mm),z,dx,dy,dz,min,max\na,100,200,0,0,0,1,-9.80665,9.80665".replace(" (mm)", "")
                  .replace("100,200", "0.1,0.2")),
        ("a.csv", "name,px,py,pz,ax,ay,az,min,max\na,0.1,0.2,0,0,0,1,-9.80665,9.80665"),
        ("a.yaml", "t: [{name: a, pose: [0.1, 0.2, 0, 0, -1.5707963268, 0], bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", "t: [{name: a, pose_deg: [0.1, 0.2, 0, 0, -90, 0], bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", "t: [{name: a, pose: {x: 0.1, y: 0.2, z: 0, roll: 0, pitch: -1.5707963268, yaw: 0}, bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", "t: [{name: a, pose: {position: {x: 0.1, y: 0.2, z: 0}, orientation: {x: 0, y: -0.70710678118, z: 0, w: 0.70710678118}},\n"
                   "     bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", "# body frame, y to the right\nt: [{name: a, pos: [0.1, -0.2, 0], heading_pitch: [0, 90], bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", "t: [{name: a, pos: [0.1, 0.2, 0], heading_deg: 0, pitch_deg: 90, bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", "unit: mm\ncom: {x: 50, y: 0, z: 0}\nt: [{name: a, x: 150, y: 200, x-dir: 0, y-dir: 0, z-dir: 1, bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", "t: [{name: a, x_mm: 100, y_mm: 200, z_mm: 0, dx: 0, dy: 0, dz: 1, bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", "t: [{name: a, xyz: 0.1 0.2 0, rpy: '0 -1.5707963268 0', bounds: [-9.80665, 9.80665]}]"),
        ("a.yaml", 't: [{name: a, pose: "0.1, 0.2, 0, 0, -1.5707963268, 0", bounds: [-9.80665, 9.80665]}]'),
        ("a.csv", "name,x_mm,y_mm,z_mm,x-dir,y-dir,z-dir,min,max\na,100,200,0,0,0,1,-9.80665,9.80665"),
        ("a.toml", '[[thrusters]]\nname = "a"\npos = [0.1, 0.2, 0]\naxis = [0, 0, 1]\nbounds = [-9.80665, 9.80665]'),
        ("a.conf", '// FLU\n{"thrusters": [ # all\n {"name": "a", "pos": [0.1, 0.2, 0], /* up */ "axis": [0, 0, 1,], "bounds": [-9.80665, 9.80665]}, // one\n]}'),
        ("a.json", '{"url": "http://a", "t": [{"name": "a", "xyz": [0.1, 0.2, 0], "axis": [0, 0, 1], "bounds": [-9.80665, 9.80665],},]}'),
        ("a.cfg", '[[thrusters]]\nname = "a"\npos = [0.1, 0.2, 0]\naxis = [0, 0, 1]\nbounds = [-9.80665, 9.80665]'),
        ("a.json", '{"thrusters": {"names": ["a", "b"], "thruster_positions": [[0.1, 0.2, 0], [0, 1, 0]], "max_force": 9.80665, '
                   '"directions": [[0, 0, 1], [1, 0, 0]]}}'),
    ],
)  # fmt: skip
def test_thrusters_by_place_and_direction(file: str, text: str) -> None:
    layout, _ = read(file, text)
    first = layout.actuators[0]
    assert first.name == "a"
    np.testing.assert_allclose(
        [first.position, first.frame[0]], [[0.1, 0.2, 0], [0, 0, 1]], atol=1e-9
    )
    np.testing.assert_allclose([first.lower[0], first.upper[0]], [-9.80665, 9.80665])


def test_what_a_pose_does_not_say_is_asked() -> None:
    for text, said in {
        "t: [{pose: [0, 0, 0, 0, 0, 0, 1], name: a}]": "is 7 numbers, expected six: x, y, z, roll",
        "t: [{pos: [260, 0, 0], axis: [1, 0, 0]}]": "reaches 260: which unit is that.*--length mm",
        "t: [{pos: [0, 0, 0], heading_pitch: [1.5, 0]}]": "in degrees or radians. name the unit",
        "t: [{pos: [0, 0, 0], rpy: [0, 90, 0]}]": "are these degrees",
        "t: [{pos: [0, 0, 0], orientation: [1, 0, 0]}]": "may be a direction, or roll, pitch",
        "t: [{pos: [0, 0, 0], heading_pitch: [1, 2, 3]}]": "expected heading and pitch",
        "t: [{pos: [0, 0, 0], quaternion: [0, 0, 0, 0]}]": "expected x, y, z, w of a quaternion",
    }.items():
        with pytest.raises(LayoutError, match=said):
            read("a.yaml", text)
    layout, _ = read("a.yaml", "t: [{pos: [260, 0, 0], axis: [1, 0, 0]}]", length="mm")
    assert layout.actuators[0].position == pytest.approx((0.26, 0.0, 0.0))


def test_orientations_that_lean_and_have_length_1_are_directions() -> None:
    text = (
        "[motors.a]\nposition = [0.1, 0.2, 0]\norientation = [0.6, 0.8, 0.0]\n"
        'direction = "Clockwise"\n[motors.b]\nposition = [0.1, 0.2, 0]\n'
        'orientation = [0.0, 0.0, 1.0]\ndirection = "CounterClockwise"'
    )
    layout, notes = read("a.toml", text)
    np.testing.assert_allclose(
        [part.frame[0] for part in layout.actuators], [[0.6, 0.8, 0], [0, 0, 1]]
    )
    assert "orientation has length 1 throughout" in notes and "not applied" not in notes


@pytest.mark.parametrize(
    "key", ["reversed: true", "flipped: yes", "direction: -1, axis: [1, 0, 0]", "thrust: -1"]
)
def test_reversed_thrusters_are_named(key: str) -> None:
    axis = "" if "axis" in key else "axis: [1, 0, 0], "
    plain = "{name: b, pos: [0, 0, 0], axis: [1, 0, 0], reversed: false, thrust: 1}"
    layout, notes = read("a.yaml", f"t: [{{name: a, pos: [0, 0, 0], {axis}{key}}}, {plain}]")
    assert layout.actuators[0].frame[0] == (1.0, 0.0, 0.0)
    assert f"{key.split(':')[0]} of a is not applied: the direction is as drawn" in notes


def test_cameras_are_no_thrusters() -> None:
    camera = '{"Cameras": {"front": {"X": 1, "Y": 0, "Z": 0, "Pitch": 0, "Roll": 0, "Yaw": 0}}}'
    with pytest.raises(LayoutError, match="has no matrix, expected six rows"):
        read("settings.json", f'{{"Vehicles": {{"rov": {camera}}}}}')
    thrusters = "t: [{name: a, pos: [0, 0, 0], axis: [1, 0, 0]}]"
    cameras = "cameras: {front: {pos: [0, 0, 0], direction: [1, 0, 0]}}"
    assert read("a.yaml", f"{thrusters}\n{cameras}")[0].names == ("a",)


def test_devices_beside_the_thrusters_and_symmetries() -> None:
    pose = "pose: [0, 0, 0, 0, 0, 0]"
    text = f"thrusters: [{{name: a, {pose}}}]\npoker: {{tip: {{{pose}}}}}\nfog: {{{pose}}}"
    layout, notes = read("a.yaml", text)
    assert layout.names == ("a",)
    assert "Places beside those of thrusters are left out: the file, poker" in notes
    text = "seed: {position: [0.2, 0.2, 0], axis: [1, 0, 0]}\nmotors: {front: 0, back: 1}"
    with pytest.raises(LayoutError, match="of seed alone, and 2 motors beside it, which follow"):
        read("a.yaml", text)


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("a.toml", "a = [1", "is not valid TOML: "),
        ("a.toml", "a = nan", "holds nan, expected a finite number"),
        ("a.toml", "a = " + "[" * 500 + "]" * 500, "nested"),
        ("a.toml", "a = 1\n" + "#" * 400_000, "is TOML of more than 100,000 characters"),
        ("a.toml", "day = 2020-01-01\n", "has no matrix"),
        ("a.conf", "[section]\nkey = a word\n", "holds none of the forms .* as TOML it is not valid TOML"),
        ("a.conf", '{"a": 1 // one\n "b": 2}', "is not valid JSON: line 2"),
        ("a.json", '{"a": "x // y" "b": 2}', "is not valid JSON: line 1"),
    ],
)  # fmt: skip
def test_a_file_is_blamed_for_what_it_is(file: str, text: str, said: str) -> None:
    with pytest.raises(LayoutError, match=said):
        read(file, text)


def test_mixers_of_arducopter_push_as_they_say() -> None:
    calls = (
        "Motors_6DoF:add_motor(0, 0.0, 0.5, -0.1, 0.8, 0.5, 0.0, true, 1)\n"
        "Motors_6DoF:add_motor(1, -0.4, -0.2, 0.1, 0.8, -0.3, 0.5, false, 2) -- aft\n"
    )
    layout, notes = read("a.lua", calls)
    size = np.hypot(0.5, 0.8)
    np.testing.assert_allclose(layout.actuators[0].frame[0], [0.5 / size, 0, 0.8 / size])
    right = np.array([-0.3, -0.5, 0.8])  # to the left is -0.5
    np.testing.assert_allclose(layout.actuators[1].frame[0], right / np.linalg.norm(right))
    # Pitch up is -Ty, yaw to the right is -Tz, with arms of 0.2 m; roll to the right is Tx.
    np.testing.assert_allclose(effectiveness_of(layout)[0, 3:], [0, -0.1, 0.02], atol=1e-12)
    np.testing.assert_allclose(effectiveness_of(layout)[1, 3:], [-0.08, 0.04, -0.02], atol=1e-12)
    assert layout.actuators[1].lower[0] == 0.0 and "pushing one way, are motor2" in notes
    with pytest.raises(LayoutError, match="line 1: 'maybe' says whether it is reversible"):
        read("a.lua", calls.replace("true", "maybe"))
    with pytest.raises(LayoutError, match="line 1: a motor with 4 arguments behind it"):
        read("a.lua", "MotorsMatrix:add_motor_raw(0, -1, 0.5, 0.7, 2)")


def test_thrusters_without_a_plugin_are_named() -> None:
    more = (
        SCREW[SCREW.index('<link name="screw"') :]
        .replace("screw", "thruster_2")
        .replace("sj", "j2")
    )
    _, notes = read("a.sdf", sdf(SCREW + more + THRUSTER))
    assert "Left out, since no plugin drives them: thruster_2; --thrusters" in notes
    assert "No mass stands at link screw, thruster_2: 0 is taken, where SDF takes 1 kg" in notes
    layout, notes = read("a.sdf", sdf(SCREW + more + THRUSTER), thrusters=["thruster_2"])
    assert layout.names == ("screw", "thruster_2") and "Left out" not in notes


def test_motors_of_programs_and_lists_are_the_same() -> None:
    calls = [
        f"add_motor_raw_6dof({{}}{i}, 0, 0, {yaw}, 0, {ahead}, 0, {i + 1})"
        for i, (yaw, ahead) in enumerate(
            # fmt: skip
            [
                ("-SIDE", "cosf(radians(60))"),
                ("0.25f * 2", "5e-1f"),
                ("-0.5", "-0.5"),
                (".5", "-.5"),
            ]
        )
    ]
    cpp = "static const float SIDE = 0.5f;\nvoid add_motor_raw_6dof(int8_t n, float roll);\n/* add_motor_raw_6dof(\n */\n"
    cpp += (
        ";\n".join(call.format("AP_MOTORS_MOT_") for call in calls)
        .replace("MOT_3", "MOT_4")
        .replace("MOT_2", "MOT_3")
    )
    cpp = cpp.replace("MOT_1, 0, 0, 0.25", "MOT_2, 0, 0, 0.25").replace("MOT_0", "MOT_1")
    lua = "local SIDE = 1 / 2\n" + "\n".join(f"motors:{call}".format("") for call in calls).replace(
        "cosf", "math.cos"
    )
    lua = lua.replace("radians", "math.rad").replace("0.25f", "0.25").replace("5e-1f", "5e-1")
    csv = "lateral,forward,throttle,yaw,pitch,roll,motor\n" + "\n".join(
        f"0,{ahead},1e-20,{yaw},0,0,{i}"
        for i, (yaw, ahead) in enumerate([(-5e-1, 0.5), (0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)], 1)
    )
    one, _ = read("a.cpp", cpp)
    two, _ = read("a.lua", lua)
    three, _ = read("a.csv", csv)
    assert one.names == two.names == three.names == ("motor1", "motor2", "motor3", "motor4")
    np.testing.assert_allclose(effectiveness_of(one), effectiveness_of(two), atol=1e-12)
    np.testing.assert_allclose(effectiveness_of(one), effectiveness_of(three), atol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "FRAME_CONFIG,1.000000\nMOT_2_DIRECTION,-1",
        "# Vehicle-Id\n1 1 FRAME_CONFIG 1 6\n1\t1\tMOT_2_DIRECTION\t-1\t6",
    ],
)
def test_parameters_of_ardusub_name_a_frame(text: str) -> None:
    layout, notes = read("a.params", text)
    assert layout.n == 6 and "frame VECTORED" in notes and "motors 2," in notes


def test_px4_says_what_its_defaults_filled() -> None:
    _, notes = read(
        "a.params", "CA_ROTOR_COUNT 2\nCA_ROTOR0_CT 4\nCA_ROTOR2_PX 1\nCA_ROTOR2_CT 6.5"
    )
    assert (
        "No CA_ROTORi_CT of rotors 1: 6.5 is taken" in notes and "not read: CA_ROTOR2_PX." in notes
    )


def test_models_inside_models_and_names_of_others() -> None:
    buoy = '<model name="buoy"><link name="b"/><plugin filename="blink" name="x::Blinker"/></model>'
    world = f'<sdf version="1.9"><world name="w">{buoy}<model name="a">{SCREW}{THRUSTER}</model><model name="b">{SCREW}{THRUSTER}</model></world></sdf>'
    layout, notes = read("a.sdf", world)
    assert layout.name == "a" and "other robots: b" in notes
    assert read("a.sdf", world, model="b")[0].name == "b"
    with pytest.raises(LayoutError, match="has no model 'c'; it has buoy, a, b"):
        read("a.sdf", world, model="c")
    arm = f'<model name="arm"><pose>1 0 0 0 0 1.5707963267948966</pose>{SCREW}{THRUSTER}</model><link name="hull"><inertial><mass>8</mass></inertial></link>'
    layout, notes = read("a.sdf", sdf(arm))
    assert (
        layout.body is not None and layout.body.mass_kg == 20.0 and layout.body.inertia_kgm2 is None
    )
    assert layout.names == ("arm::screw",) and "no inertia" in notes
    np.testing.assert_allclose(layout.actuators[0].frame[0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(layout.position[0], [0.4, -0.4, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("version", "told", "axis"),
    [
        ("1.6", "", (0, 1, 0)),
        ("1.6", "<use_parent_model_frame>1</use_parent_model_frame>", (1, 0, 0)),
        ("1.4", "", (1, 0, 0)),
    ],
)
def test_axes_in_the_frame_of_the_model(version: str, told: str, axis: tuple[float, ...]) -> None:
    turned = SCREW.replace("-0.4 0 0 0 0 0", "-0.4 0 0 0 0 1.5707963267948966").replace(
        "</xyz>", f"</xyz>{told}"
    )
    layout, _ = read("a.sdf", sdf(turned + THRUSTER, version))
    np.testing.assert_allclose(layout.actuators[0].frame[0], axis, atol=1e-12)


WATER = '<plugin filename="gz-sim-hydrodynamics-system" name="gz::sim::systems::Hydrodynamics">{}</plugin>'
"""The plugin of a body in water, in which a test writes its coefficients."""


def test_derivatives_that_are_not_said_stay_unknown() -> None:
    six = "".join(
        f"<{tag}>-{i}</{tag}>" for i, tag in enumerate(["xUU", "yVV", "zWW", "kPP", "mQQ", "nRR"])
    )
    layout, notes = read(
        "a.sdf", sdf(SCREW + THRUSTER + WATER.format(six + "<xU>-4</xU><xDotV>1</xDotV>"))
    )
    body = layout.body
    assert body is not None and body.quadratic_damping == (0, 1, 2, 3, 4, 5)
    assert body.linear_damping is None and body.added_mass is None
    assert (
        "linear_damping is left out: the file says these alone of six: xU -4" in notes
        and "xDotV" in notes
    )


def test_uuv_simulator(tmp_path: Path) -> None:
    def urdf(thruster: str, water: str = "") -> str:
        plugin = f'<gazebo><plugin name="t" filename="libuuv_thruster_ros_plugin.so"><linkName>t</linkName><jointName>j</jointName>{thruster}</plugin></gazebo>'
        fossen = f'<gazebo><plugin name="h" filename="libuuv_underwater_object_ros_plugin.so"><link name="hull"><hydrodynamic_model>{water}</hydrodynamic_model></link></plugin></gazebo>'
        return f'<robot name="r"><link name="hull"><inertial><mass value="3"/></inertial></link><link name="t"/><joint name="j" type="continuous"><parent link="hull"/><child link="t"/><axis xyz="1 0 0"/></joint>{plugin}{fossen}</robot>'

    clamps = "<clampMin>-10</clampMin><clampMax>20</clampMax>"
    for more, force in (
        (clamps + "<conversion><type>Basic</type><rotorConstant>0.1</rotorConstant></conversion>", (-10, 40)),
        (clamps + "<gain>2</gain><thrustMax>100</thrustMax><thrustMin>-100</thrustMin><conversion><type>Basic</type><rotorConstant>0.1</rotorConstant></conversion>", (-40, 100)),
        (clamps + "<conversion><type>Bessa</type></conversion>", (-39.91, 51.44)),
        ("", (-39.91, 51.44)),
    ):  # fmt: skip
        layout, notes = read("a.urdf", urdf(more))
        np.testing.assert_allclose([layout.lower[0, 0], layout.upper[0, 0]], force)
        assert "uuv_thruster of t" in notes
    layout, _ = read(
        "a.urdf", urdf("", "<type>fossen</type><linear_damping>-1 -2 -3 -4 -5 -6</linear_damping>")
    )
    assert (
        layout.body is not None
        and layout.body.linear_damping == (1, 2, 3, 4, 5, 6)
        and layout.body.added_mass is None
    )


def test_xacro_is_expanded_where_it_is_installed(tmp_path: Path) -> None:
    pytest.importorskip("xacro")
    path = tmp_path / "a.xacro"
    text = (
        (Path(__file__).parent / "bluerov2_heavy.urdf")
        .read_text()
        .replace("<robot ", '<robot xmlns:xacro="http://ros.org/wiki/xacro" ')
    )
    path.write_text(
        text.replace(
            "</robot>", '<xacro:property name="a" value="2"/><link name="b${a*2}"/></robot>'
        )
    )
    assert read_any(str(path), Exchange()).n == 8
    path.write_text(text.replace("</robot>", '<link name="${nobody}"/></robot>'))
    with pytest.raises(LayoutError, match="names .nobody., which is not defined"):
        read_any(str(path), Exchange())


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("a.sdf", "<!--" * 60_000),
        ("a.sdf", sdf('<model name="m">' * 90 + "</model>" * 90)),
        ("a.sdf", sdf("".join(f'<model name="m{i}"><link name="l"/></model>' for i in range(20_000)))),
        ("a.sdf", "<a>" * 200_000),
        ("a.csv", "a" + " " * 300_000 + ",Fx\n" + "1,1\n" * 20_000),
        ("a.csv", ("," * 50 + "\n") * 20_000),
        ("a.csv", "a," * 2_000_000),
        ("a.csv", "a,b\n" + " " * 500_000 + "\n" + '"' * 200_000),
        ("a.cpp", "add_motor(" * 100_000),
        ("a.cpp", "void add_motor(x)\n" * 60_000 + "/*" * 60_000),
        ("a.lua", "local a = 1\n" * 60_000 + "add_motor(--[[" * 30_000),
        ("a.params", "CA_ROTOR_COUNT x " + "A_B " * 200_000),
        ("a.parm", "MOT_" * 200_000 + "\n" + " " * 500_000 + "FRAME_CONFIG x"),
        ("a.json", '{"a":' + "[" * 900 + "1" + "]" * 900 + "," + ",".join(f'"k{i}": [1,2,3]' for i in range(50_000)) + "}"),
        ("a.conf", "{" + '"' * 900_000),
        ("a.conf", "{" + "/*" * 450_000),
        ("a.conf", "{" + ",  " * 300_000),
        ("a.conf", '{"a": "' + "\\\\" * 400_000),
        ("a.conf", '{"a": [' + "1, /* */ " * 100_000 + "]}"),
        ("a.toml", "a = " + "[" * 100_000),
        ("a.toml", "".join(f"a.b{i}.c = 1\n" for i in range(20_000))),
        ("a.toml", "".join(f"[[t.x{i}]]\nposition = [1]\n" for i in range(10_000))),
        ("a.json", '{"thrusters": [' + ",".join(['{"pose": [1,2,3,4,5,6,7]}'] * 4_000) + "]}"),
        ("a.lua", "Motors_6DoF:add_motor(0, " * 60_000),
        ("a.scn", "<robot><base_link name='a'/>" + "<joint><parent name='a'/><child name='a'/></joint>" * 30_000 + "</robot>"),
        ("a.scn", "<robot><base_link name='a'/>" + "<actuator type='thruster'/>" * 60_000 + "</robot>"),
        ("a.scn", "<scenario>" + '<robot name="r"><actuator type="thruster"><origin xyz="' + "${" * 100_000 + '"/></actuator></robot></scenario>'),
    ],
)  # fmt: skip
def test_hostile_files_take_linear_time(file: str, text: str) -> None:
    start = time.thread_time()  # of this thread: other tests' threads may still be busy
    with pytest.raises(LayoutError):
        read(file, text)
    assert time.thread_time() - start < 2.0
