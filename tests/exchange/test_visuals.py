"""What robot descriptions draw becomes the hull; judges are hand-made boxes, and points on the
solids by formulas of their own."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from finlab.errors import LayoutError
from finlab.exchange import Exchange, read_any
from finlab.exchange.visuals import Solid
from finlab.layout import Layout
from finlab.layout.body import Hull

JOINTS = """
  <link name="port"/><link name="starboard"/>
  <joint name="p" type="fixed"><parent link="base"/><child link="port"/><origin xyz="-0.4 0.3 0"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="s" type="fixed"><parent link="base"/><child link="starboard"/>
    <origin xyz="-0.4 -0.3 0"/><axis xyz="1 0 0"/></joint>"""
"""Two thrusters."""
GRIPPER = """<link name="gripper"><visual><geometry><box size="3 3 3"/></geometry></visual></link>
  <link name="claw"><visual><geometry><box size="4 4 4"/></geometry></visual></link>
  <joint name="g" type="revolute"><parent link="base"/><child link="gripper"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1"/></joint>
  <joint name="c" type="fixed"><parent link="gripper"/><child link="claw"/></joint>"""
"""What turns is no part of the hull."""


def urdf(visuals: str, others: str = "") -> str:
    """A robot of two thrusters, whose centre of gravity is 0.1 m ahead of its base."""
    return f"""<robot name="drawn"><link name="base"><inertial><origin xyz="0.1 0 0"/>
      <mass value="12"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
      {visuals}</link>{JOINTS}{others}</robot>"""


def read(text: str, path: Path, origin: str = "gravity") -> tuple[Layout, list[str]]:
    """The layout of a description, and its notes."""
    path.write_text(text)
    exchange = Exchange(thrusters=("port", "starboard"), origin=origin)
    return read_any(str(path), exchange), [str(note) for note in exchange.notes]


def hull_in(text: str, path: Path, origin: str = "gravity") -> Hull | None:
    """The hull of a description."""
    layout, _ = read(text, path, origin)
    return None if layout.body is None else layout.body.hull


def test_a_box_is_the_hull_as_seen_from_the_origin(tmp_path: Path) -> None:
    box = """<visual><origin xyz="0 0.02 -0.05" rpy="0 0 1.5707963"/>
      <geometry><box size="0.4 1.0 0.3"/></geometry></visual>"""
    hull = hull_in(urdf(box, GRIPPER), tmp_path / "a.urdf")
    assert hull == Hull(shape="box", size_m=(1.0, 0.4, 0.3), center_m=(-0.1, 0.02, -0.05))
    at_base = hull_in(urdf(box), tmp_path / "a.urdf", "base")
    assert at_base is not None and at_base.center_m == (0.0, 0.02, -0.05)


def test_a_cylinder_along_x_is_a_torpedo_whatever_stands_on_it(tmp_path: Path) -> None:
    text = urdf(
        """<visual><origin rpy="0 1.5707963 0"/>
        <geometry><cylinder radius="0.1" length="1.4"/></geometry></visual>
        <visual><origin xyz="0.2 0 0.12"/><geometry><box size="0.2 0.02 0.1"/></geometry></visual>"""
    )
    hull = hull_in(text, tmp_path / "a.urdf")
    assert hull is not None and hull.shape == "torpedo" and hull.size_m == (1.4, 0.2, 0.2)


def test_several_solids_have_a_box_around_them(tmp_path: Path) -> None:
    boxes = "".join(
        f'<visual><origin xyz="0 {y} 0"/><geometry><box size="1 0.1 0.2"/></geometry></visual>'
        for y in (-0.3, 0.3)
    )
    layout, notes = read(urdf(boxes), tmp_path / "a.urdf")
    assert layout.body is not None and layout.body.mass_kg == 12.0
    assert layout.body.hull == Hull(shape="box", size_m=(1.0, 0.7, 0.2), center_m=(-0.1, 0.0, 0.0))
    assert any("the box around 2 solids" in note for note in notes)


def test_sdf_says_the_same_in_elements_and_collisions_stand_for_meshes(tmp_path: Path) -> None:
    text = """<sdf version="1.9"><model name="drawn"><link name="base">
      <inertial><mass>5</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
      <visual name="v"><geometry><mesh><uri>hull.dae</uri></mesh></geometry></visual>
      <collision name="c"><pose>0 0 0.1 0 0 0</pose>
        <geometry><ellipsoid><radii>0.5 0.2 0.1</radii></ellipsoid></geometry></collision></link>
      <link name="port"><pose>-0.4 0.3 0 0 0 0</pose></link>
      <link name="starboard"><pose>-0.4 -0.3 0 0 0 0</pose></link>
      <joint name="p" type="revolute"><parent>base</parent><child>port</child>
        <axis><xyz>1 0 0</xyz></axis></joint>
      <joint name="s" type="revolute"><parent>base</parent><child>starboard</child>
        <axis><xyz>1 0 0</xyz></axis></joint></model></sdf>"""
    layout, notes = read(text, tmp_path / "a.sdf")
    assert layout.body is not None
    hull = layout.body.hull
    assert hull == Hull(shape="ellipsoid", size_m=(1.0, 0.4, 0.2), center_m=(0.0, 0.0, 0.1))
    assert any("mesh of link base is not opened" in note for note in notes)


def test_nothing_drawn_is_no_hull_and_a_wrong_size_is_refused(tmp_path: Path) -> None:
    assert hull_in(urdf(""), tmp_path / "a.urdf") is None
    assert hull_in(urdf("", GRIPPER), tmp_path / "a.urdf") is None
    wrong = '<visual><geometry><box size="1 2"/></geometry></visual>'
    with pytest.raises(LayoutError, match="the size of the box of link 'base' is not 3 numbers"):
        hull_in(urdf(wrong), tmp_path / "a.urdf")
    huge = '<visual><geometry><box size="5000 1 1"/></geometry></visual>'
    layout, notes = read(urdf(huge), tmp_path / "a.urdf")
    assert layout.body is not None and layout.body.hull is None
    assert any("5000 m long" in note for note in notes)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", ["box", "ellipsoid", "cylinder", "capsule"])
def test_the_box_around_a_solid_touches_it(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    axes = Rotation.random(random_state=seed).as_matrix()
    half = rng.uniform(0.1, 1.0, 3)
    if kind in ("cylinder", "capsule"):
        half[1] = half[0]
    center = rng.uniform(-1.0, 1.0, 3)
    solid = Solid(kind, "base", center, axes, half)
    # Points on its surface, in its own axes.
    ball = rng.standard_normal((200_000, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    points = {
        "box": np.sign(ball) * half,
        "ellipsoid": ball * half,
        "cylinder": np.column_stack(
            [
                half[0] * ball[:, :2] / np.linalg.norm(ball[:, :2], axis=1)[:, None],
                half[2] * np.sign(ball[:, 2]),
            ]
        ),
        "capsule": half[0] * ball + np.outer(np.sign(ball[:, 2]), [0.0, 0.0, half[2]]),
    }[kind]
    reached = np.abs(points @ axes.T).max(axis=0)
    assert (reached <= solid.half_extents + 1e-12).all()
    np.testing.assert_allclose(reached, solid.half_extents, rtol=2e-3)
