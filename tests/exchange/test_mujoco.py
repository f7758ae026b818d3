"""Models of MuJoCo (MJCF), read and written: MuJoCo itself judges wrenches and masses."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.arrays import Array
from finlab.assets import shipped_layouts
from finlab.errors import LayoutError
from finlab.exchange import Exchange, convert, mujoco_control, read_any, read_robot
from finlab.exchange.mjcf_write import write_mjcf
from finlab.layout import Azimuth, Fin, Hull, Layout, Thruster, own_effectiveness
from tests.random_robots import KINDS, load, random_robot

mujoco = pytest.importorskip("mujoco")

TIGHT = 1e-9
"""Largest difference from MuJoCo [N, N m, kg, kg m^2]."""


def read(text: str, **said: Any) -> tuple[Layout, str]:
    """The layout of a model, and the notes on it."""
    exchange = Exchange(**said)
    return read_robot(text, "robot.xml", exchange), " ".join(exchange.notes)


def wrench_of_mujoco(model: Any, ctrl: Array) -> Array:
    """The wrench (6,) of the actuators at the free joint of body 1, about that body's frame, for a
    ctrl (nu,); what a hinge's servo turns stands at the angle that is asked of it."""
    data = mujoco.MjData(model)
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    data.ctrl[:] = ctrl
    for i in range(model.nu):
        joint = model.actuator_trnid[i, 0]
        if model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE:
            data.qpos[model.jnt_qposadr[joint]] = ctrl[i]
    mujoco.mj_forward(model, data)
    return data.qfrc_actuator[:6].copy()


def center_and_inertia(model: Any) -> tuple[Array, Array]:
    """Centre of gravity (3,) of the tree of body 1 in its frame, and inertia (3, 3) about it."""
    data = mujoco.MjData(model)
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    center = data.subtree_com[1].copy()
    total = float(model.body_subtreemass[1])
    shift = total * (center @ center * np.eye(3) - np.outer(center, center))
    return center, mass[3:6, 3:6] - shift


def wrench_of_layout(layout: Layout, names: list[str], force: Array, center: Array) -> Array:
    """The wrench (6,) about the frame of the base of forces (n,) of named thrusters, whose layout
    has its origin at a centre (3,)."""
    matrix = own_effectiveness(layout)[:, 0]
    wrench = np.zeros(6)
    for name, newtons in zip(names, force, strict=True):
        wrench += matrix[layout.names.index(name)] * newtons
    wrench[3:] += np.cross(center, wrench[:3])
    return wrench


def hull(inside: str, head: str = "", actuators: str = "", body: str = "") -> str:
    """A model of one free body with a mass of 12 kg."""
    return (
        f'<mujoco model="rov">{head}<worldbody><body name="hull" pos="1 2 3" {body}><freejoint/>'
        f'<inertial pos="0.1 0 -0.02" mass="12" diaginertia="0.2 0.3 0.3"/>{inside}</body>'
        f"</worldbody><actuator>{actuators}</actuator></mujoco>"
    )


def text(values: Array) -> str:
    """Numbers as an attribute has them."""
    return " ".join(repr(float(value)) for value in values)


def random_orientation(rng: np.random.Generator, degrees: bool) -> str:
    """An orientation in one of the forms of MJCF."""
    turn = 180.0 if degrees else np.pi
    values = rng.normal(size=6)
    forms = [
        f'quat="{text(values[:4])}"',
        f'euler="{text(turn * rng.uniform(-1, 1, 3))}"',
        f'axisangle="{text([*values[:3], turn * rng.uniform(-1, 1)])}"',
        f'xyaxes="{text(values)}"',
        f'zaxis="{text(values[:3])}"',
        'zaxis="0 0 -1"',
        "",
    ]
    return forms[rng.integers(len(forms))]


def random_geom(rng: np.random.Generator, degrees: bool) -> str:
    """A geom that has a mass."""
    size = rng.uniform(0.05, 0.4, 3)
    pos = f'pos="{text(rng.normal(size=3))}"'
    ends = f'fromto="{text(rng.normal(size=6))}"'
    mass = ("", 'density="700"', 'mass="3"')[rng.integers(3)]
    where = f"{pos} {random_orientation(rng, degrees)}"
    shapes = [
        f'size="{size[0]}" {where}',
        f'type="box" size="{text(size)}" {where}',
        f'type="ellipsoid" size="{text(size)}" {where}',
        f'type="cylinder" size="{text(size[:2])}" {where}',
        f'type="capsule" size="{text(size[:2])}" {where}',
        f'type="capsule" size="{size[0]}" {ends}',
        f'type="cylinder" size="{size[0]}" {ends}',
        f'type="box" size="{size[0]}" {ends}',
        f'class="shell" {where}',
        'type="sphere" size="9" group="5"',
    ]
    return f"<geom {shapes[rng.integers(len(shapes))]} {mass}/>"


def random_model(seed: int) -> tuple[str, list[str]]:
    """A model with bodies in bodies, frames, classes and all forms of orientation, and the names of
    its thrusters."""
    rng = np.random.default_rng(seed)
    degrees = bool(rng.integers(2))
    sequence = "".join(rng.permutation([*"xyz"]))
    sequence = "".join(letter.upper() if rng.integers(2) else letter for letter in sequence)
    head = (
        f'<compiler eulerseq="{sequence}" inertiagrouprange="0 4" '
        f"{'' if degrees else 'angle=' + chr(34) + 'radian' + chr(34)}/>"
        '<default><geom density="400"/><general gear="0 0 2"/><default class="shell">'
        '<geom type="box" size="0.1 0.2 0.3"/><site euler="0.1 0.2 0.3"/>'
        '<default class="strong"><motor gear="1 2 3 0.1 0.2 0.3" ctrlrange="-7 9"/></default>'
        "</default></default>"
    )
    sites = 0

    def body(depth: int) -> str:
        nonlocal sites
        parts = [random_geom(rng, degrees) for _ in range(rng.integers(1, 3))]
        if depth and rng.integers(2):
            parts.append(
                f'<inertial pos="{text(rng.normal(size=3))}" mass="2" '
                'fullinertia="0.5 0.6 0.7 0.01 0.02 0.03"/>'
            )
        for _ in range(rng.integers(1, 4)):
            kind = ("", 'class="shell"')[rng.integers(2)]
            where = f'pos="{text(rng.normal(size=3))}" {random_orientation(rng, degrees)}'
            parts.append(f'<site name="s{sites}" {kind} {where}/>')
            sites += 1
        if depth < 3:
            where = f'pos="{text(rng.normal(size=3))}" {random_orientation(rng, degrees)}'
            child = ("", 'childclass="shell"')[rng.integers(2)]
            inner = f"<body {where} {child}>{body(depth + 1)}</body>"
            if rng.integers(2):
                inner = f"<frame {random_orientation(rng, degrees)} {child}>{inner}</frame>"
            parts.append(inner)
        return "".join(parts)

    content = body(0)
    actuators = []
    names = []
    for i in range(sites):
        name = f"a{i}"
        gear = rng.normal(size=6)
        forms = [
            f'<motor name="{name}" site="s{i}" gear="{text(gear)}" ctrlrange="-1 2"/>',
            f'<motor name="{name}" site="s{i}" gear="{text(gear[:3])}" ctrlrange="-20 20" '
            'forcerange="-3 4"/>',
            f'<motor name="{name}" site="s{i}" class="strong"/>',
            f'<motor name="{name}" site="s{i}" class="strong" gear="5"/>',
            f'<general name="{name}" site="s{i}" gainprm="-4" ctrlrange="-1 1"/>',
            f'<general name="{name}" site="s{i}" class="strong" gainprm="0.5 7"/>',
            f'<motor name="{name}" site="s{i}" gear="{text(gear)}"/>',
        ]
        actuators.append(forms[rng.integers(len(forms))])
        names.append(name)
    model = (
        f'<mujoco model="random">{head}<worldbody><geom type="plane" size="9 9 1"/>'
        f'<body name="base" pos="3 2 1"><freejoint/>{content}</body></worldbody>'
        f"<actuator>{''.join(actuators)}</actuator></mujoco>"
    )
    return model, names


@pytest.mark.parametrize("seed", range(20))
def test_random_models_give_the_wrench_and_the_mass_of_mujoco(seed: int) -> None:
    model_text, names = random_model(seed)
    layout, _ = read(model_text)
    model = mujoco.MjModel.from_xml_string(model_text)
    center, inertia = center_and_inertia(model)
    body = layout.body
    assert body is not None and list(layout.names) == names
    assert body.mass_kg == pytest.approx(model.body_subtreemass[1], rel=1e-9)
    np.testing.assert_allclose(body.inertia_kgm2, np.diag(inertia), rtol=1e-9)
    rng = np.random.default_rng(seed)
    for _ in range(5):
        ctrl = rng.normal(size=model.nu) * 3
        forces = []
        for i, part in enumerate(layout.actuators):
            per_ctrl = np.linalg.norm(model.actuator_gear[i, :3]) * model.actuator_gainprm[i, 0]
            force = ctrl[i] * abs(per_ctrl)
            is_limited = model.actuator_ctrllimited[i] or model.actuator_forcelimited[i]
            forces.append(np.clip(force, *part.force) if is_limited else force)
        ours = wrench_of_layout(layout, names, np.array(forces), center)
        np.testing.assert_allclose(ours, wrench_of_mujoco(model, ctrl), rtol=0, atol=TIGHT)


@pytest.mark.parametrize("seed", range(20, 28))
def test_models_that_mujoco_saved_are_the_same(seed: int) -> None:
    model_text, names = random_model(seed)
    spec = mujoco.MjSpec.from_string(model_text)
    spec.compile()
    saved = read(spec.to_xml())[0]
    layout = read(model_text)[0]
    assert list(saved.names) == names
    np.testing.assert_allclose(own_effectiveness(saved), own_effectiveness(layout), atol=1e-4)
    assert saved.body is not None and layout.body is not None
    assert saved.body.mass_kg == pytest.approx(layout.body.mass_kg, rel=1e-4)


@pytest.mark.parametrize("name", shipped_layouts())
def test_shipped_robots_push_in_mujoco_as_here(name: str, tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    _, notes = convert(name, file, None, Exchange())
    check_written(finlab.load_layout(name), file)
    assert any("MJCF has no place for power" in note for note in notes)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "slipstreams"])
def test_any_robot_pushes_in_mujoco_as_here(kind: str, tmp_path: Path) -> None:
    layout = load(random_robot(kind, 0, 60))
    before = tmp_path / "robot.yaml"
    finlab.save_layout(layout, before)
    convert(str(before), tmp_path / "robot.xml", None, Exchange())
    check_written(layout, tmp_path / "robot.xml")


@pytest.mark.parametrize("name", ["catamaran", "ucat"])
def test_servos_turn_what_turns_and_leave_the_hull_in_peace(name: str, tmp_path: Path) -> None:
    convert(name, tmp_path / "robot.xml", None, Exchange())
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    servos = np.flatnonzero(model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE)
    data.ctrl[servos] = np.linspace(-0.8, 1.0, len(servos))
    for _ in range(500):
        mujoco.mj_step(model, data)
    joints = model.actuator_trnid[servos, 0]
    np.testing.assert_allclose(data.qpos[model.jnt_qposadr[joints]], data.ctrl[servos], atol=1e-4)
    np.testing.assert_allclose(data.qpos[:7], [0, 0, 0, 1, 0, 0, 0], atol=1e-6)


def test_a_plate_has_its_moments_and_no_solid_is_said(tmp_path: Path) -> None:
    layout = finlab.load_layout("ucat")
    for moments, said in (((0.1, 0.1, 0.2), False), ((0.1, 0.1, 0.5), True)):
        body = finlab.Body(mass_kg=10.0, inertia_kgm2=moments)
        finlab.save_layout(replace(layout, body=body), tmp_path / "plate.yaml")
        file = tmp_path / "plate.xml"
        _, notes = convert(str(tmp_path / "plate.yaml"), file, None, Exchange())
        model = mujoco.MjModel.from_xml_path(str(file))
        assert any("No solid has its moments" in note for note in notes) == said
        assert said or sorted(model.body_inertia[1]) == pytest.approx(sorted(moments))


def check_written(layout: Layout, file: Path) -> None:
    """What MuJoCo makes of a written model is the robot, and so is what is read of it."""
    model = mujoco.MjModel.from_xml_path(str(file))
    rng = np.random.default_rng(1)
    is_rudder = np.array([part.type == "rudder" for part in layout.actuators])
    flow = [1.0, 0, 0, 0, 0, 0] if is_rudder.any() else None
    allocator = finlab.Allocator(layout)
    for wrench in rng.normal(size=(4, 6)) * 2.0:
        result = allocator.allocate(wrench, flow=flow)
        forces = np.where(is_rudder[:, None], 0.0, result.forces)
        own = np.einsum("nk,njk->nj", forces, layout.frames)
        expected = np.einsum("nj,njk->k", own, own_effectiveness(layout))
        got = wrench_of_mujoco(model, mujoco_control(result))
        np.testing.assert_allclose(got, expected, rtol=0, atol=TIGHT)
    batch = allocator.allocate_batch(rng.normal(size=(3, 6)), flow=flow)
    assert mujoco_control(batch).shape == (3, model.nu)
    fins = [part.name for part in layout.actuators if part.type == "fin"]
    again = read_any(str(file), Exchange(fins=fins))
    kept = {part.name: part for part in again.actuators}
    for part in layout.actuators:
        if isinstance(part, Thruster | Azimuth):
            back = kept[part.name]
            assert isinstance(back, Thruster | Azimuth) and back.force == part.force
            i, k = layout.names.index(part.name), again.names.index(part.name)
            np.testing.assert_allclose(
                own_effectiveness(again)[k], own_effectiveness(layout)[i], atol=TIGHT
            )
        elif part.type == "fin":
            back = kept[part.name]
            assert isinstance(back, Fin)
            np.testing.assert_allclose(back.position, part.position, atol=TIGHT)
    if layout.body is not None and layout.body.inertia_kgm2 is not None:
        assert again.body is not None
        assert again.body.mass_kg == pytest.approx(layout.body.mass_kg, rel=1e-9)
        assert again.body.inertia_kgm2 == pytest.approx(layout.body.inertia_kgm2, rel=1e-9)


SITES = (
    '<site name="port" pos="-0.5 0.3 0" zaxis="1 0 0"/><site name="bow" pos="0.4 0 0.1" '
    'zaxis="0 1 0"/>'
)
"""Two places on a hull."""
MOTORS = (
    '<motor name="port" site="port" gear="0 0 1" ctrlrange="-30 40"/>'
    '<motor name="bow" site="bow" gear="0 0 20" ctrlrange="-1 1"/>'
)
"""Motors there."""
ROBOTS = {
    "plain": hull(SITES, "", MOTORS),
    "radians": hull(
        '<site name="port" euler="0 1.5707963 0"/>' + SITES[SITES.index("<site", 5) :],
        '<compiler angle="radian"/>',
        MOTORS,
    ),
    "degrees, fixed axes": hull(
        '<site name="port" euler="30 40 50"/><site name="bow"/>',
        '<compiler eulerseq="XYZ"/>',
        MOTORS,
    ),
    "class of motors": hull(
        SITES,
        '<default><default class="t200"><motor gear="0 0 1" ctrlrange="-39.91 51.44"/></default>'
        "</default>",
        '<motor name="port" class="t200" site="port"/><motor name="bow" class="t200" site="bow"/>',
    ),
    "class of sites": hull(
        '<site name="port" pos="-0.5 0.3 0"/><site class="side" name="bow" pos="0.4 0 0"/>',
        '<default><site zaxis="1 0 0"/><default class="side"><site zaxis="0 1 0"/></default>'
        "</default>",
        MOTORS,
    ),
    "child class": hull(
        SITES.replace(' zaxis="1 0 0"', ""),
        '<default><default class="rov"><site axisangle="0 1 0 90"/></default></default>',
        MOTORS,
        'childclass="rov"',
    ),
    "general with a gain": hull(
        SITES, "", '<general name="port" site="port" gear="1 0 0" gainprm="-8" ctrlrange="-1 2"/>'
    ),
    "lag": hull(
        SITES,
        "",
        '<general name="port" site="port" gear="0 0 1" dyntype="filterexact" dynprm="0.3" '
        'ctrlrange="-30 40"/>',
    ),
    "force range": hull(
        SITES, "", '<motor name="port" site="port" gear="0 0 3" forcerange="-5 6"/>'
    ),
    "limits off": hull(
        SITES,
        '<compiler autolimits="false"/>',
        '<motor name="port" site="port" gear="0 0 3" ctrllimited="false" ctrlrange="-5 6"/>',
    ),
    "limits on": hull(
        SITES,
        '<compiler autolimits="false"/>',
        '<motor name="port" site="port" gear="0 0 3" ctrllimited="true" ctrlrange="-5 6"/>',
    ),
    "reaction torque": hull(
        SITES, "", '<motor name="port" site="port" gear="0 0 1 0 0 -0.02" ctrlrange="-30 40"/>'
    ),
    "torque across": hull(
        SITES, "", '<motor name="port" site="port" gear="0 0 2 0.3 0.1 -0.02" ctrlrange="-3 4"/>'
    ),
    "six on one site": hull(
        SITES,
        "",
        "".join(
            f'<motor name="m{i}" site="bow" gear="{text(np.eye(6)[i])}" ctrlrange="-3 4"/>'
            for i in range(6)
        ),
    ),
    "arm": hull(
        f'<body pos="0.2 0 0" euler="0 0 90"><inertial pos="0 0 0.3" mass="2" '
        f'fullinertia=".1 .1 .1 0 0 .02"/>{SITES}</body>',
        "",
        MOTORS,
    ),
    "frame": hull(f'<frame pos="0.2 0 0" euler="0 0 90">{SITES}</frame>', "", MOTORS),
    "hull of geoms": hull(SITES, "", MOTORS).replace(
        '<inertial pos="0.1 0 -0.02" mass="12" diaginertia="0.2 0.3 0.3"/>',
        '<geom type="capsule" fromto="-0.4 0 0 0.5 0 0.1" size="0.12"/><geom size="0.1" mass="2"/>',
    ),
    "class of another name": hull(
        SITES,
        '<default class="main"><motor gear="0 0 1"/><default class="a"><motor ctrlrange="-3 4"/>'
        "</default></default>",
        '<motor name="port" site="port" class="a"/><motor name="bow" site="bow" class="main"/>',
    ),
    "masses of geoms": hull(
        SITES + '<geom type="box" size="0.2 0.1 0.1" pos="0.3 0 0"/><geom size="0.1" group="3"/>',
        '<compiler inertiafromgeom="true" inertiagrouprange="0 2"/>',
        MOTORS,
    ),
    "joint of class free": hull(SITES, "", MOTORS)
    .replace("<freejoint/>", '<joint class="root"/>')
    .replace(
        "<worldbody>",
        '<default><default class="root"><joint type="free"/></default></default><worldbody>',
    ),
    "propeller that spins": hull(
        '<body name="screw" pos="-0.5 0 0"><joint name="spin" axis="1 0 0"/><inertial pos="0 0 0" '
        'mass="0.1" diaginertia="1e-4 1e-4 1e-4"/><site name="port" zaxis="1 0 0"/></body>',
        "",
        '<motor name="port" site="port" gear="0 0 1 0 0 0.01" ctrlrange="-30 40"/>'
        '<velocity name="spin" joint="spin" kv="0.1"/>',
    ),
}
"""Robots as people write them, each with another habit."""


@pytest.mark.parametrize("kind", ROBOTS)
def test_models_as_people_write_them(kind: str) -> None:
    layout, notes = read(ROBOTS[kind])
    model = mujoco.MjModel.from_xml_string(ROBOTS[kind])
    center, inertia = center_and_inertia(model)
    assert layout.body is not None
    assert layout.body.mass_kg == pytest.approx(model.body_subtreemass[1], rel=1e-9)
    np.testing.assert_allclose(layout.body.inertia_kgm2, np.diag(inertia), rtol=1e-6)
    names = [model.actuator(i).name for i in range(model.nu)]
    for i, name in enumerate(names):
        if name not in layout.names:
            assert name in notes
            continue
        part = layout.actuators[layout.names.index(name)]
        assert isinstance(part, Thruster)
        scale = np.linalg.norm(model.actuator_gear[i, :3]) * abs(model.actuator_gainprm[i, 0])
        for ctrl in (-0.3, 0.7, 100.0):
            if model.actuator_dyntype[i] or (ctrl == 100.0 and "no limits of force" in notes):
                continue
            ctrls = np.zeros(model.nu)
            ctrls[i] = ctrl
            force = np.clip(ctrl * scale, *part.force)
            ours = wrench_of_layout(layout, [name], np.array([force]), center)
            np.testing.assert_allclose(ours, wrench_of_mujoco(model, ctrls), rtol=0, atol=TIGHT)


def test_what_the_habits_say() -> None:
    layout, _ = read(ROBOTS["lag"])
    assert layout.actuators[0].time_constant == 0.3  # type: ignore[attr-defined]
    _, notes = read(ROBOTS["limits off"])
    assert "no limits of force: those of a T200" in notes
    _, notes = read(ROBOTS["general with a gain"])
    assert "A ctrl of 1 is 8 N of port" in notes
    layout, notes = read(ROBOTS["six on one site"])
    assert layout.names == ("m0", "m1", "m2")
    assert "m3 (no force, but a torque)" in notes
    _, notes = read(ROBOTS["propeller that spins"])
    assert "spin (velocity of joint spin)" in notes
    _, notes = read(hull(SITES, '<option density="1000"/>', MOTORS))
    assert "added mass and damping are unknown" in notes
    layout, _ = read(ROBOTS["arm"], origin="base")
    assert layout.body is None and "frame of body hull" in layout.description


def half_extents_of(model: Any, data: Any, geom: int) -> Array:
    """Half of the sides (3,) of the box around a geom along the axes of the world [m]."""
    axes = data.geom_xmat[geom].reshape(3, 3)
    size = model.geom_size[geom]
    kind = mujoco.mjtGeom(model.geom_type[geom]).name
    if kind == "mjGEOM_BOX":
        return np.abs(axes) @ size
    if kind == "mjGEOM_SPHERE":
        return np.full(3, size[0])
    if kind == "mjGEOM_ELLIPSOID":
        return np.sqrt((axes**2) @ size**2)
    along = size[1] * np.abs(axes[:, 2])
    if kind == "mjGEOM_CAPSULE":
        return along + size[0]
    return along + size[0] * np.hypot(axes[:, 0], axes[:, 1])


@pytest.mark.parametrize("seed", range(12))
def test_the_hull_is_the_box_around_the_geoms_of_mujoco(seed: int) -> None:
    content, _ = random_model(seed)
    content = content.replace('size="9"', 'size="0.3"')  # that would hide all others
    model = mujoco.MjModel.from_xml_string(content)
    data = mujoco.MjData(model)
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    mujoco.mj_forward(model, data)
    geoms = np.flatnonzero(model.geom_bodyid)  # but the plane of the world
    half = np.array([half_extents_of(model, data, geom) for geom in geoms])
    place = data.geom_xpos[geoms]
    lower = (place - half).min(axis=0)
    upper = (place + half).max(axis=0)
    largest = int(np.argmax(half.prod(axis=1)))
    if 8.0 * half[largest].prod() >= 0.5 * (upper - lower).prod():  # it is the hull by itself
        lower = place[largest] - half[largest]
        upper = place[largest] + half[largest]
    layout, _ = read(content)
    center, _ = center_and_inertia(model)
    assert layout.body is not None and layout.body.hull is not None
    np.testing.assert_allclose(layout.body.hull.size_m, upper - lower, rtol=0, atol=1e-8)
    middle = 0.5 * (lower + upper) - center
    np.testing.assert_allclose(layout.body.hull.center_m, middle, rtol=0, atol=1e-8)


MOVING_ARM = (
    '<body name="arm"><joint name="elbow" axis="0 1 0"/><geom type="box" size="3 3 3" mass="0"/>'
    '<body name="hand"><geom type="box" size="4 4 4" mass="0"/></body></body>'
)
"""A body that moves, and one that is fixed to it."""


def test_what_moves_is_no_part_of_the_hull_and_meshes_are_named() -> None:
    box = '<geom type="box" pos="0.2 0 0" size="0.5 0.2 0.1"/>'
    layout, notes = read(hull(SITES + box + MOVING_ARM, "", MOTORS))
    assert layout.body is not None and layout.body.mass_kg == pytest.approx(12.0)
    drawn = layout.body.hull
    assert drawn == Hull(shape="box", size_m=(1.0, 0.4, 0.2), center_m=(0.1, 0.0, 0.02))
    assert "The hull is the box of body hull" in notes

    at_base, _ = read(hull(SITES + box, "", MOTORS), origin="base")
    assert at_base.body is not None and at_base.body.mass_kg is None
    assert at_base.body.hull == Hull(shape="box", size_m=(1.0, 0.4, 0.2), center_m=(0.2, 0.0, 0.0))

    mesh = '<geom type="mesh" mesh="shell"/><geom type="plane" size="9 9 1"/>'
    layout, notes = read(hull(SITES + mesh, "", MOTORS))
    assert layout.body is not None and layout.body.hull is None
    assert "The mesh of body hull is not opened" in notes


POD = (
    '<body name="pod" pos="-0.6 0.2 0"><joint name="turn" axis="0 0 1" range="-60 60"/><inertial '
    'pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/><body name="screw"><joint name="spin" '
    'axis="1 0 0"/><inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/><site '
    'name="push" zaxis="1 0 0"/></body></body>'
)
"""A pod that turns, with a propeller that spins on it."""
POD_ACTUATORS = (
    '<motor name="pod" site="push" gear="0 0 1 0 0 0.01" ctrlrange="-20 30"/>'
    '<position name="helm" joint="turn" kp="5"/>'
)
"""Its thrust, and its servo."""


def test_what_turns_is_an_azimuth() -> None:
    layout, notes = read(hull(POD, "", POD_ACTUATORS))
    (pod,) = layout.actuators
    assert isinstance(pod, Azimuth) and pod.force == (-20.0, 30.0)
    np.testing.assert_allclose(np.degrees(pod.arc), [-60, 60])
    assert pod.torque_per_newton == pytest.approx(0.01)
    assert "helm" not in notes and "spin" not in notes


def test_fins_and_thrusters_may_be_named() -> None:
    fin = (
        '<body name="flipper" pos="0.3 -0.2 0"><joint name="flap" axis="0 1 0"/><inertial '
        'pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/></body>'
    )
    text_of_model = hull(fin + POD, "", '<position name="flap" joint="flap"/>')
    layout, notes = read(text_of_model, fins=["flipper"], thrusters=["screw"])
    pod, flipper = layout.actuators
    assert isinstance(pod, Azimuth) and isinstance(flipper, Fin)
    assert flipper.mounting_angle == pytest.approx(-np.pi / 2) and "Left out" not in notes
    with pytest.raises(LayoutError, match="no motor or general .* flap .position of joint flap"):
        read(text_of_model)
    with pytest.raises(LayoutError, match="has no body 'wing' that a joint moves; .* flipper"):
        read(text_of_model, fins=["wing"])


def test_masses_of_meshes_are_asked_for() -> None:
    mesh = '<geom name="shell" type="mesh" mesh="hull"/>'
    without = (
        hull(SITES + mesh, "", MOTORS).replace("<inertial", "<a").replace("/><site", "/><site", 1)
    )
    with pytest.raises(
        LayoutError, match=r"that of a mesh is not computed \(shell of hull\); give"
    ):
        read(without)
    layout, _ = read(without, origin="base")
    assert layout.actuators[0].position == (-0.5, 0.3, 0.0) and layout.body is None
    weightless = without.replace('mesh="hull"', 'mesh="hull" mass="0"')
    with pytest.raises(LayoutError, match="has no mass of body 'hull'; give it an <inertial>"):
        read(weightless)


def test_a_world_that_is_no_robot() -> None:
    fixed = hull(SITES, "", MOTORS).replace("<freejoint/>", '<joint name="x" type="slide"/>')
    assert "Body hull has no free joint, and is taken as the robot" in read(fixed)[1]
    cart = (
        '<mujoco><worldbody><body name="cart"><joint name="x" type="slide"/><geom size="1"/></body>'
        '</worldbody><actuator><motor joint="x"/></actuator></mujoco>'
    )
    with pytest.raises(LayoutError, match="no motor or general that pushes at a site .* joint x"):
        read(cart)
    with pytest.raises(LayoutError, match="is a part of a model of MuJoCo, <mujocoinclude>"):
        read("<mujocoinclude/>")


def test_of_two_robots_one_is_read() -> None:
    second = '<body name="buoy"><freejoint/><geom size="0.1"/></body>'
    model = hull(SITES, "", MOTORS).replace("<worldbody>", f"<worldbody>{second}")
    layout, notes = read(model)
    assert layout.names == ("port", "bow") and "other" not in notes
    with pytest.raises(LayoutError, match="port .site port is not on body buoy"):
        read(model, model="buoy")
    with pytest.raises(LayoutError, match="has no body 'sub'; it has buoy, hull"):
        read(model, model="sub")


def test_includes_stand_in_the_folder(tmp_path: Path) -> None:
    (tmp_path / "parts" / "more").mkdir(parents=True)
    (tmp_path / "parts" / "motors.xml").write_text(
        f'<mujocoinclude><actuator>{MOTORS}</actuator><include file="more/defaults.xml"/>'
        "</mujocoinclude>"
    )
    (tmp_path / "parts" / "more" / "defaults.xml").write_text(
        '<mujocoinclude><compiler angle="radian"/></mujocoinclude>'
    )
    file = tmp_path / "rov.xml"
    file.write_text(
        hull(SITES, "", "").replace("<worldbody>", '<include file="parts/motors.xml"/><worldbody>')
    )
    layout = read_any(str(file), Exchange())
    assert layout.names == ("port", "bow")
    model = mujoco.MjModel.from_xml_path(str(file))
    center, _ = center_and_inertia(model)
    ours = wrench_of_layout(layout, ["port", "bow"], np.array([3.0, 20.0]), center)
    np.testing.assert_allclose(ours, wrench_of_mujoco(model, np.array([3.0, 1.0])), atol=TIGHT)
    with pytest.raises(LayoutError, match="did not come along; paste it in"):
        read(file.read_text())


def test_a_fin_may_have_the_name_of_mujocos_world() -> None:
    layout = finlab.load_layout("A")
    names = ("world", "world_", "base_link", "world_joint")
    parts = [replace(part, name=name) for part, name in zip(layout.actuators, names, strict=True)]
    named = layout.with_actuators(tuple(parts))
    model = mujoco.MjModel.from_xml_string(write_mjcf(named, Exchange(), ""))
    assert [model.actuator(2 * i).name for i in range(4)] == list(names)
    assert len({model.body(i).name for i in range(model.nbody)}) == 6
