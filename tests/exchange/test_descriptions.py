"""Layouts from and to robot descriptions: URDF and SDF."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.analysis.authority import authority
from finlab.errors import LayoutError
from finlab.exchange import Exchange, convert, read_any
from finlab.exchange.description import angles
from finlab.layout import Azimuth, Body, Layout, Thruster, own_effectiveness
from tests.allocator_cache import FIN_ROBOTS
from tests.random_robots import load, random_robot

HERE = Path(__file__).parent
"""Folder of the descriptions."""
TURTLE_URDF = HERE / "turtle.urdf"
"""A robot of three fins and a rudder."""
HEAVY_URDF = HERE / "bluerov2_heavy.urdf"
"""A BlueROV2 Heavy, eight thrusters."""
TURTLE_FINS = ("front_right_fin", "front_left_fin", "tail_fin")
"""Names of the turtle's links that are fins."""


def read(path: Path, **unsaid: Any) -> Layout:
    """The layout of a description; `unsaid` is what the description does not say."""
    return read_any(str(path), Exchange(**unsaid))


def written(layout: Layout, path: Path, **unsaid: Any) -> Layout:
    """A layout that went into a file and came back."""
    convert_layout(layout, path)
    return read(path, **unsaid)


def convert_layout(layout: Layout, path: Path) -> list[str]:
    """Write a layout as a description; what could not be written is returned."""
    finlab.layout.save_layout(layout, path.with_name("before.yaml"))
    exchange = Exchange()
    convert(str(path.with_name("before.yaml")), path, None, exchange)
    return exchange.notes


def test_a_bluerov2_comes_out_as_shipped() -> None:
    layout = read(HEAVY_URDF)
    shipped = finlab.load_layout("bluerov2_heavy")
    assert layout.names == tuple(f"thruster{i}" for i in range(1, 9))
    np.testing.assert_allclose(
        own_effectiveness(layout)[:, 0], own_effectiveness(shipped)[:, 0], atol=1e-7
    )
    np.testing.assert_array_equal([part.force for part in layout.actuators], [(-39.91, 51.44)] * 8)
    told = layout.body
    body = shipped.body
    assert told is not None and body is not None
    assert (told.mass_kg, told.inertia_kgm2) == (body.mass_kg, pytest.approx(body.inertia_kgm2))
    for field in ("added_mass", "linear_damping", "quadratic_damping"):
        assert getattr(told, field) == getattr(body, field)


def test_golden_forces_of_a_bluerov2() -> None:
    """Pseudo-inverse of places that were taken from the robot's public description, by other
    means."""
    inverse = np.linalg.pinv(own_effectiveness(read(HEAVY_URDF))[:, 0].T)
    for wrench, forces in (
        ((20, 0, 0, 0, 0, 0), (-7.0711, -7.0711, 7.0711, 7.0711, 0.4661, 0.4661, -0.4661, -0.4661)),
        ((0, 20, 0, 0, 0, 0), (-7.2202, 7.2202, -6.9219, 6.9219, -0.2558, 0.2558, -0.2558, 0.2558)),
        ((0, 0, 0, 0, 0, 2), (-2.9836, 2.9836, 2.9836, -2.9836, 0, 0, 0, 0)),
        (
            (30, 15, -20, 0, 1, 3),
            (-20.4971, -0.7161, 9.8905, 11.3227, 7.6259, 8.0097, 1.9903, 2.3741),
        ),
    ):
        np.testing.assert_allclose(inverse @ wrench, forces, atol=2e-4)


SDF_ROBOT = """<sdf version="1.9"><world name="sea"><model name="rov"><pose>9 9 9 0 0 1</pose>
  <link name="hull"><inertial><pose>0.1 0 0 0 0 0</pose><mass>10</mass>
    <inertia><ixx>1</ixx><iyy>2</iyy><izz>3</izz></inertia><fluid_added_mass><xx>4</xx><rr>0.5</rr></fluid_added_mass></inertial></link>
  <frame name="stern" attached_to="hull"><pose degrees="true">-0.5 0 0 0 0 180</pose></frame>
  <link name="a"><pose relative_to="stern">0.1 0.2 0 0 0 0</pose></link>
  <joint name="a_joint" type="revolute"><parent>hull</parent><child>a</child>
    <axis><xyz>1 0 0</xyz><limit><lower>-1e16</lower><upper>inf</upper></limit></axis></joint>
  <link name="b"><pose rotation_format="quat_xyzw">0 0 0.3 0 1 0 1</pose></link>
  <joint name="b_joint" type="continuous"><parent>hull</parent><child>b</child>
    <pose>0 0 0.1 0 0 0</pose><axis><xyz expressed_in="__model__">0 2 0</xyz></axis></joint>
  <plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster"><joint_name>a_joint</joint_name>
    <use_angvel_cmd>True</use_angvel_cmd><thrust_coefficient>-0.02</thrust_coefficient>
    <propeller_diameter>0.1</propeller_diameter><max_thrust_cmd>100</max_thrust_cmd><min_thrust_cmd>-50</min_thrust_cmd>
    <deadband>0.5</deadband></plugin>
  <plugin filename="ignition-gazebo-thruster-system" name="ignition::gazebo::systems::Thruster">
    <joint_name>b_joint</joint_name></plugin>
</model></world></sdf>"""
"""A robot in SDF with poses of frames, a hull and added mass."""


def test_frames_of_sdf(tmp_path: Path) -> None:
    path = tmp_path / "model.sdf"
    path.write_text(SDF_ROBOT)
    exchange = Exchange()
    layout = read_any(str(path), exchange)
    a, b = layout.actuators
    assert isinstance(a, Thruster) and isinstance(b, Thruster) and layout.name == "rov"
    # Half a turn about z at (-0.5, 0, 0), and the centre of gravity lies 0.1 m ahead.
    np.testing.assert_allclose(a.position, [-0.7, -0.2, 0.0], atol=1e-12)
    np.testing.assert_allclose(a.axis, [-1.0, 0.0, 0.0], atol=1e-12)
    # 0.02 * 1000 * 0.1^4 w |w|; the coefficient is negative, so forward is reverse.
    np.testing.assert_allclose(a.force, [-20.0, 5.0])
    assert a.dead_band == 0.5
    np.testing.assert_allclose((b.position, b.axis), [[0.0, 0.0, 0.3], [0.0, 1.0, 0.0]], atol=1e-12)
    assert b.force == (-39.91, 51.44) and any(
        "no limits of force" in note for note in exchange.notes
    )
    assert layout.body == Body(mass_kg=10.0, inertia_kgm2=(1.0, 2.0, 3.0), added_mass=None)
    assert (
        "added_mass is left out: the file says these alone of six: xx 4.0, rr 0.5."
        in exchange.notes
    )
    assert read(path, force=(-1.0, 2.0)).actuators[1].upper[0] == 2.0


def test_an_axis_may_be_expressed_in_any_frame(tmp_path: Path) -> None:
    path = tmp_path / "model.sdf"
    turned = SDF_ROBOT.replace(
        '<pose rotation_format="quat_xyzw">0 0 0.3 0 1 0 1', '<pose degrees="true">0 0 0.3 0 0 90'
    )
    for frame, axis in (
        ("__model__", (0, 1, 0)),
        ("stern", (0, -1, 0)),
        ("b", (-1, 0, 0)),
        ("a_joint", (0, -1, 0)),
    ):
        path.write_text(turned.replace('expressed_in="__model__"', f'expressed_in="{frame}"'))
        np.testing.assert_allclose(read(path).actuators[1].frame[0], axis, atol=1e-12)
    path.write_text(SDF_ROBOT.replace("__model__", "nowhere"))
    with pytest.raises(
        LayoutError, match="no frame 'nowhere', in which the axis of joint 'b_joint'"
    ):
        read(path)


UP = """<robot name="up"><link name="base"><inertial><mass value="12"/></inertial></link>
<link name="thruster_1"/><link name="thruster_2"/>
<joint name="a" type="fixed"><parent link="base"/><child link="thruster_1"/>
<origin xyz="0 0.2 0.05" rpy="{roll} {pitch} 0"/></joint>
<joint name="b" type="fixed"><parent link="base"/><child link="thruster_2"/>
<origin xyz="0 -0.2 0.05" rpy="{roll} {pitch} 0"/></joint></robot>"""
"""Two thrusters that point up, by angles as a file writes them."""


@pytest.mark.parametrize("pitch", ["-1.57", "-1.571", "-1.5708", "-1.57079", "-1.570796327"])
def test_decimals_of_a_right_angle_stand_for_it(pitch: str, tmp_path: Path) -> None:
    path = tmp_path / "up.urdf"
    path.write_text(UP.format(roll=0, pitch=pitch))
    layout = read(path, thrusters=("thruster_1", "thruster_2"), force=(-40.0, 40.0))
    held = authority(layout)
    assert held.reachable == ("heave", "roll")
    assert held.largest[2] == pytest.approx(80.0)


@pytest.mark.parametrize(
    ("written", "angle"),
    [
        ("0.785", math.pi / 4),
        ("-2.35619", -0.75 * math.pi),
        ("3.14", math.pi),
        ("0.79", 0.79),
        ("1.58", 1.58),
        ("1.5", 1.5),
        ("1.5709", 1.5709),
        ("0.001", 0.001),
        ("1.5708e0", 1.5708),
    ],
)
def test_only_decimals_of_eighths_of_a_turn_stand_for_them(written: str, angle: float) -> None:
    np.testing.assert_array_equal(angles(f"0 {written} 0", "the pose"), [0.0, angle, 0.0])


@pytest.mark.parametrize("suffix", ["urdf", "sdf"])
@pytest.mark.parametrize("kind", ["thrusters", "azimuths"])
def test_any_propellers_survive_the_way_there_and_back(
    kind: str, suffix: str, tmp_path: Path
) -> None:
    for number in range(5):
        layout = load(random_robot(kind, number, 35))
        body = Body(
            mass_kg=20.0, inertia_kgm2=(1.0, 2.0, 3.0), quadratic_damping=(1, 2, 3, 4, 5, 6)
        )
        layout = replace(layout, body=body)
        back = written(layout, tmp_path / f"robot.{suffix}")
        assert back.names == layout.names
        assert back.body is not None and back.body.quadratic_damping == body.quadratic_damping
        assert back.body.mass_kg == pytest.approx(20.0) and back.body.added_mass is None
        np.testing.assert_allclose(back.body.inertia_kgm2 or (), (1.0, 2.0, 3.0), rtol=1e-9)
        for one, other in zip(layout.actuators, back.actuators, strict=True):
            assert type(one) is type(other) and one.dead_band == other.dead_band  # type: ignore[union-attr]
            np.testing.assert_allclose(one.upper, other.upper, atol=1e-12)
            np.testing.assert_allclose(one.lower, other.lower, atol=1e-12)
            np.testing.assert_allclose(one.frame[0], other.frame[0], atol=1e-9)
            if isinstance(one, Azimuth):
                np.testing.assert_allclose(one.frame, other.frame, atol=1e-9)
            moments = (np.cross(part.position, part.frame) for part in (one, other))
            first, second = moments
            np.testing.assert_allclose(first[0], second[0], atol=1e-9)


@pytest.mark.parametrize("suffix", ["urdf", "sdf"])
def test_names_with_signs_of_xml(suffix: str, tmp_path: Path) -> None:
    layout = finlab.load_layout("bluerov2_heavy")
    path = tmp_path / f"robot.{suffix}"
    odd = replace(
        layout.replace_actuator(layout.names[0], name="a<\"&{0}'é"), name='<{name}> & "co"'
    )
    back = written(odd, path)
    assert (back.name, back.names) == (odd.name, odd.names)


def test_chains_of_joints_may_be_long(tmp_path: Path) -> None:
    """3000 fixed joints of 1 mm each, the last one first."""
    links = "".join(f'<link name="l{i}"/>' for i in range(3001))
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="l{i}"/><child link="l{i + 1}"/>'
        '<origin xyz="0.001 0 0"/></joint>'
        for i in reversed(range(3000))
    )
    (tmp_path / "chain.urdf").write_text(f'<robot name="chain">{links}{joints}</robot>')
    (last,) = read(tmp_path / "chain.urdf", thrusters=["l3000"], origin="base").actuators
    assert isinstance(last, Thruster)
    np.testing.assert_allclose(last.position, [3.0, 0.0, 0.0], atol=1e-9)


def test_an_azimuth_that_turns_about_a_line_beside_its_thrust(tmp_path: Path) -> None:
    """A stern drive: the propeller sits 0.3 m behind the turning axis, which changes no torque."""
    tag = '<gazebo><plugin name="gz::sim::systems::Thruster"><joint_name>p</joint_name></plugin></gazebo>'
    path = tmp_path / "boat.urdf"
    path.write_text(
        '<robot name="boat"><link name="hull"><inertial><mass value="5"/></inertial></link>'
        '<link name="engine"/><link name="prop"/>'
        '<joint name="e" type="revolute"><parent link="hull"/><child link="engine"/>'
        '<origin xyz="-1 0 0"/><axis xyz="0 0 1"/><limit lower="-0.5" upper="0.75"/></joint>'
        '<joint name="p" type="continuous"><parent link="engine"/><child link="prop"/>'
        f'<origin xyz="-0.3 0 -0.2"/><axis xyz="1 0 0"/></joint>{tag}</robot>'
    )
    (part,) = read(path).actuators
    assert isinstance(part, Azimuth) and part.arc == (-0.5, 0.75) and part.force == (-39.91, 51.44)
    np.testing.assert_allclose(
        [part.position, *part.frame[:2]], [[-1, 0, -0.2], [0, 0, 1], [1, 0, 0]], atol=1e-12
    )


def test_rotated_links_and_axes_of_fins_come_out_in_the_body_frame() -> None:
    layout = read(TURTLE_URDF, fins=(*TURTLE_FINS, "rudder"), origin="base")
    right, left, tail, upright = layout.fins
    c = math.cos(math.pi / 3)
    s = math.sin(math.pi / 3)
    np.testing.assert_allclose(right.position, [0.2 + 0.05 * c, -0.1 - 0.05 * s, 0.0], atol=1e-12)
    assert right.mounting_angle == pytest.approx(-math.pi / 3)
    np.testing.assert_allclose(left.position, [0.2, 0.1, 0.0], atol=1e-12)
    assert left.mounting_angle == pytest.approx(math.pi / 2), (
        "z of a frame turned about x, seen from the hull"
    )
    assert tail.mounting_angle is not None and abs(tail.mounting_angle) == pytest.approx(math.pi)
    assert (upright.shaft, upright.zero) == ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))


def test_origin_moves_to_the_centre_of_gravity() -> None:
    base = read(TURTLE_URDF, fins=TURTLE_FINS, origin="base")
    gravity = read(TURTLE_URDF, fins=TURTLE_FINS)
    for a, b in zip(base.fins, gravity.fins, strict=True):
        np.testing.assert_allclose(
            np.subtract(a.position, b.position), [0.02, 0.0, -0.01], atol=1e-12
        )
    assert gravity.body is not None and base.body is None
    assert gravity.body.mass_kg == 10.0
    np.testing.assert_allclose(gravity.body.inertia_kgm2 or (), [0.1, 0.2, 0.3])


def test_links_may_be_named_as_thrusters() -> None:
    layout = read(TURTLE_URDF, thrusters=["tail_fin", "mount"], force=(-5.0, 5.0))
    tail, mount = layout.actuators
    assert isinstance(tail, Thruster) and isinstance(mount, Thruster) and tail.force == (-5.0, 5.0)
    np.testing.assert_allclose(tail.axis, [-1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(mount.axis, [0.5, -math.sqrt(0.75), 0.0], atol=1e-12)


@pytest.mark.parametrize("suffix", ["urdf", "sdf"])
@pytest.mark.parametrize("name", sorted(FIN_ROBOTS))
def test_robots_of_fins_survive_the_way_there_and_back(
    name: str, suffix: str, tmp_path: Path
) -> None:
    layout = finlab.load_layout(name)
    back = written(layout, tmp_path / f"robot.{suffix}", fins=layout.names, origin="base")
    for a, b in zip(layout.fins, back.fins, strict=True):
        np.testing.assert_allclose(a.position, b.position, atol=1e-12)
        # A shaft that points into the hull comes back pointing out of it.
        apart = math.remainder((a.mounting_angle or 0.0) - (b.mounting_angle or 0.0), math.pi)
        assert apart == pytest.approx(0.0, abs=1e-9)


PLUGIN = '<gazebo><plugin name="gz::sim::systems::Thruster"><joint_name>x</joint_name></plugin></gazebo></robot>'
"""A plugin of a thruster whose joint is not there."""


@pytest.mark.parametrize(
    ("content", "fins", "message"),
    [
        ("<!DOCTYPE a [<!ENTITY x 'y'>]><robot name='a'/>", ("x",), "declares a DOCTYPE"),
        ('<robot xmlns:xacro="x"><xacro:property name="a"/></robot>', (), "has no masses"),
        ('<robot><link name="${prefix}a"/></robot>', (), "names .prefix., which is not defined"),
        ("<robot>", ("x",), "is not readable XML"),
        ("<svg/>", (), "expected a <robot> of URDF or a <model> of SDF, got <svg>"),
        (TURTLE_URDF.read_text(), ("nobody",), "has no link 'nobody' that a joint moves; such links: front"),
        (TURTLE_URDF.read_text(), ("mount",), "joint 'mount_joint' is fixed; a fin's joint is revolute or"),
        (TURTLE_URDF.read_text(), (), "has no thruster's plugin of gz-sim or uuv; name the links that are fins"),
        (TURTLE_URDF.read_text().replace('mass value="10"', 'mass value="0"'), TURTLE_FINS, "has no masses"),
        (TURTLE_URDF.read_text().replace('xyz="0.2 ', 'xyz="20e3 '), TURTLE_FINS, r"position\[0\] of fin .*: must lie"),
        (TURTLE_URDF.read_text().replace('xyz="0.2 ', 'xyz="west '), TURTLE_FINS, "pose of joint .* is not 6 numbers"),
        (TURTLE_URDF.read_text().replace("</robot>", PLUGIN), (), "joint 'x', which moves no link in it"),
        (TURTLE_URDF.read_text().replace('"base_link"/><child', '"tail_fin"/><child'), TURTLE_FINS, "itself in a circle"),
    ],
)  # fmt: skip
def test_refusals_say_what_is_wrong(
    content: str, fins: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "x.urdf"
    path.write_text(content)
    with pytest.raises(LayoutError, match=message) as caught:
        read(path, fins=fins)
    assert str(caught.value).startswith(f"{path}: ")
