"""Layout files: actuators of any type, fins with shafts in any direction."""

import copy
import json
import math
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
import yaml

from finlab.actuators.thrust_model import PowerLaw
from finlab.errors import AllocationError, LayoutError
from finlab.layout import (
    Fin,
    Layout,
    Thruster,
    Uncertainty,
    layout_to_dict,
    load_layout,
    own_effectiveness,
    parse_layout,
)
from finlab.layout.damage import Damage
from finlab.layout.layout import MAX_ACTUATORS
from finlab.physics.plant import Plant
from tests.layout.test_other_actuators import AZIMUTH_DATA, RUDDER_DATA, THRUSTER_DATA, TILT_DATA
from tools.schemas import PACKAGE

LIFT = {**THRUSTER_DATA, "axis": [0, 0, 1], "torque_per_newton_m": 0.0}
"""A thruster that pushes upward."""
GOOD_LAYOUT = {
    "format": "finlab-layout",
    "version": 2,
    "name": "all types",
    "actuators": [
        {"name": "side", "type": "fin", "position_m": [0.2, -0.1, 0], "mounting_angle_deg": -60.0},
        {
            "name": "tail",
            "type": "fin",
            "position_m": [-0.4, 0, 0],
            "shaft": [0, 0, 1],
            "zero": [1, 0, 0],
        },
        LIFT,
        {**AZIMUTH_DATA, "name": "pod"},
        {**TILT_DATA, "name": "nose"},
        RUDDER_DATA,
    ],
}
"""A layout file with an actuator of each type."""


def plain_yaml(data):
    """YAML without anchors."""
    return yaml.safe_dump(json.loads(json.dumps(data)))


def edited(i, **changes):
    """A copy of GOOD with some keys of one actuator changed, or removed if the value is `...`."""
    data = copy.deepcopy(GOOD_LAYOUT)
    part = data["actuators"][i]
    part.update(changes)
    for key in [key for key, value in changes.items() if value is ...]:
        del part[key]
    return data


def test_all_types_are_read_and_written(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(plain_yaml(GOOD_LAYOUT))
    layout = load_layout(path)
    assert [part.type for part in layout.actuators] == [
        "fin",
        "fin",
        "thruster",
        "azimuth",
        "tilt",
        "rudder",
    ]
    assert (layout.n, layout.n_fins, layout.is_of_fins) == (6, 2, False)
    assert layout.names == ("side", "tail", "lift", "pod", "nose", "rudder")
    assert layout.lower.shape == layout.upper.shape == layout.position.shape == (6, 3)
    assert layout.upper[2].tolist() == [51.44, 0.0, 0.0]
    assert layout.upper[4].tolist() == [math.radians(30), 20.0, 0.0]
    written = layout_to_dict(layout)
    assert written["version"] == 2 and parse_layout(json.loads(json.dumps(written))) == layout
    jsonschema.validate(
        GOOD_LAYOUT, json.loads((PACKAGE / "layout/layout.schema.json").read_text())
    )
    np.testing.assert_allclose(
        layout.frames @ layout.frames.swapaxes(1, 2), [np.eye(3)] * 6, atol=1e-15
    )
    assert np.linalg.det(layout.frames) == pytest.approx(1.0)
    assert layout.without(["side", "lift"]).names == ("tail", "pod", "nose", "rudder")
    assert layout.replace_actuator("lift", force=(0.0, 9.0)).upper[2, 0] == 9.0


@pytest.mark.parametrize("version", [{"version": 1}, {}], ids=["said", "left out"])
def test_a_file_of_version_1_is_refused_with_how_to_convert_it(version):
    """What the sentence says to do is done here, and the file is read."""
    fin = {"name": "side", "position_m": [0.2, -0.1, 0], "mounting_angle_deg": -60.0}
    old = {"format": "finlab-layout", **version, "name": "old", "fins": [fin]}
    said = (
        "version: version 1, .* write version: 2, actuators: in place of fins:, and type: fin in "
        "each"
    )
    with pytest.raises(LayoutError, match=said):
        parse_layout(old)
    new = {
        "format": "finlab-layout",
        "version": 2,
        "name": "old",
        "actuators": [{**fin, "type": "fin"}],
    }
    layout = parse_layout(new)
    assert layout.names == ("side",) and layout_to_dict(layout)["version"] == 2
    assert parse_layout(layout_to_dict(layout)) == layout


def test_a_horizontal_shaft_has_one_description():
    c = math.cos(0.7)
    s = math.sin(0.7)
    by_axes = Fin("a", (0.1, 0.2, 0.0), shaft=(c, s, 0.0), zero=(-s, c, 0.0))
    by_angle = Fin("a", (0.1, 0.2, 0.0), 0.7)
    assert by_axes == replace(by_angle, mounting_angle=by_axes.mounting_angle)
    assert by_axes.mounting_angle == pytest.approx(0.7, abs=1e-15)
    # The other side forward at zero direction 0: no mounting angle says this.
    assert Fin("a", (0.1, 0.2, 0.0), shaft=(c, s, 0.0), zero=(s, -c, 0.0)).mounting_angle is None


def test_rounded_axes_become_exact():
    fin = Fin("a", (0.0, 0.0, 0.0), shaft=(0.577, 0.577, 0.577), zero=(0.707, -0.707, 0.0))
    np.testing.assert_allclose(np.array(fin.frame) @ np.transpose(fin.frame), np.eye(3), atol=1e-15)
    np.testing.assert_allclose(fin.frame[0], [3**-0.5] * 3, atol=1e-15)


def test_a_mounting_angle_is_a_frame():
    angle = 0.7
    by_angle = Fin("a", (0.1, 0.2, 0.3), angle).frame
    c = math.cos(angle)
    s = math.sin(angle)
    np.testing.assert_allclose(by_angle, [(c, s, 0), (-s, c, 0), (0, 0, 1)])


def test_fins_with_any_shaft_push_as_a_formula_of_its_own_says():
    rng = np.random.default_rng(4)
    n = 5
    shaft = rng.normal(size=(n, 3))
    shaft /= np.linalg.norm(shaft, axis=1, keepdims=True)
    zero = np.cross(shaft, rng.normal(size=(n, 3)))
    zero /= np.linalg.norm(zero, axis=1, keepdims=True)
    place = rng.uniform(-0.3, 0.3, (n, 3))
    fins = [
        Fin(f"f{i}", tuple(place[i]), shaft=tuple(shaft[i]), zero=tuple(zero[i])) for i in range(n)
    ]
    layout = Layout("any", tuple(fins))
    command = rng.uniform(layout.lower, layout.upper, (7, n, 3))
    a, f, phi = np.moveaxis(command, -1, 0)[..., None]
    thrust = 2 * 1000 * 0.15 * 0.02 * 0.1**2 * (2 * np.pi * f) ** 2 * (1 - np.cos(2 * a))
    force = thrust * (np.cos(phi) * zero + np.sin(phi) * np.cross(shaft, zero))
    wrench = np.concatenate([force.sum(1), np.cross(place, force).sum(1)], axis=-1)
    np.testing.assert_allclose(Plant(layout).wrench(command), wrench, atol=1e-12)
    np.testing.assert_allclose(Plant(layout).body_forces(command), force, atol=1e-12)


def test_the_effectiveness_is_force_and_lever():
    layout = parse_layout(GOOD_LAYOUT)
    columns = own_effectiveness(layout)
    np.testing.assert_allclose(columns[2, 0], [0, 0, 1, 0.2, 0, 0], atol=1e-15)
    np.testing.assert_allclose(columns[1, 1], [1, 0, 0, 0, 0, 0], atol=1e-15)
    np.testing.assert_allclose(columns[1, 2], [0, 1, 0, 0, 0, -0.4], atol=1e-15)


BAD_LAYOUTS = [
    ("actuators[2].name", edited(2, name="tail"), "'tail' is already the name of actuator 2"),
    ("actuators", {**GOOD_LAYOUT, "actuators": []}, "a list of 1 to 256 values, got 0"),
    (
        "actuators",
        {**GOOD_LAYOUT, "actuators": [{**LIFT, "name": f"t{i}"} for i in range(257)]},
        "values, got 257",
    ),
    ("fins", {**GOOD_LAYOUT, "fins": []}, "unknown key"),
    (
        "version",
        {**GOOD_LAYOUT, "version": 1},
        "version 1, with fins:, is no longer read; write version: 2",
    ),
    ("version", {**GOOD_LAYOUT, "version": 3}, "reads version 2, got 3"),
    (
        "version",
        {key: value for key, value in GOOD_LAYOUT.items() if key != "version"},
        "required key is missing",
    ),
    (
        "actuators[0].type",
        edited(0, type="paddle"),
        "expected one of fin, thruster, azimuth, tilt, rudder, propeller_rudder",
    ),
    ("actuators[0].type", edited(0, type=...), "required key is missing"),
    ("actuators[0].mounting_angle_deg", edited(0, mounting_angle_deg=...), "or shaft and zero"),
    ("actuators[0].shaft", edited(0, shaft=[1, 0, 0], zero=[0, 1, 0]), "not both"),
    ("actuators[0].axis", edited(0, axis=[1, 0, 0]), "unknown key"),
    ("actuators[1].zero", edited(1, zero=...), "is missing, expected a unit vector"),
    ("actuators[1].shaft", edited(1, shaft=...), "is missing, expected a unit vector"),
    ("actuators[1].shaft", edited(1, shaft=[0, 0, 0.9]), "a unit vector, got one of length 0.9"),
    ("actuators[1].shaft", edited(1, shaft=[0, 0, 0]), "a unit vector, got one of length 0"),
    ("actuators[1].shaft[2]", edited(1, shaft=[0, 0, math.nan]), ""),
    (
        "actuators[1].zero",
        edited(1, zero=[0.6, 0, 0.8]),
        "must stand across shaft, got 36.87 degrees",
    ),
    ("actuators[1].zero", edited(1, zero=[1, 0]), "a list of 3 values, got 2"),
    ("actuators[2].axis", edited(2, axis=[0, 1, 1]), "a unit vector, got one of length 1.41421"),
    ("actuators[2].axis", edited(2, axis=...), "required key is missing"),
    ("actuators[2].force_n", edited(2, force_n=[3, 2]), ""),
    (
        "actuators[2].model.exponent",
        edited(2, model={**LIFT["model"], "exponent": 1.0}),
        "must lie within",
    ),
    ("actuators[3].turn_axis", edited(3, turn_axis=[0, 0, 2]), ""),
    ("actuators[5].deflection_deg", edited(5, deflection_deg=[25, -25]), "25 and -25"),
]
"""Key, a layout file in which it is wrong, and what the refusal says."""


@pytest.mark.parametrize(
    ("key", "data", "why"),
    BAD_LAYOUTS,
    ids=[f"{key}-{i}" for i, (key, *_) in enumerate(BAD_LAYOUTS)],
)
def test_a_bad_value_is_refused_with_file_key_and_reason(key, data, why, tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(plain_yaml(data))
    with pytest.raises(LayoutError) as caught:
        load_layout(path)
    assert str(caught.value).startswith(f"{path}: {key}"), caught.value
    assert why in str(caught.value)
    assert "\n" not in str(caught.value)


def test_as_many_actuators_as_are_allowed():
    model = PowerLaw(1.0)
    parts = [Thruster(f"t{i}", (0, 0, 0), (0, 0, 1), (-9, 9), model) for i in range(MAX_ACTUATORS)]
    layout = Layout("many", tuple(parts))
    assert parse_layout(layout_to_dict(layout)) == layout
    with pytest.raises(LayoutError, match="expected 1 to 256 actuators, got 257"):
        Layout("more", (*parts, replace(parts[0], name="one more")))


def test_what_works_for_fins_only_says_so():
    layout = parse_layout(GOOD_LAYOUT)
    with pytest.raises(LayoutError, match="simulate works for .* 'lift' of .* is of type thruster"):
        layout.require_kind("simulate")
    tail = layout.without(["side", "lift", "pod", "nose", "rudder"])
    tail.require_kind("simulate")
    with pytest.raises(
        LayoutError, match="the app works for .* 'tail' .* has a shaft of its own direction"
    ):
        tail.require_kind("the app", horizontal=True)
    with pytest.raises(LayoutError, match="'tail'"):
        _ = tail.mounting_angle


def test_damage_leaves_the_other_actuators_as_they_are():
    layout = parse_layout(GOOD_LAYOUT)
    health = Damage(weak={"side": 0.5, "lift": 0.5, "pod": 0.5}, stuck={"nose": 0.1})
    damaged = health.applied_to(layout)
    assert damaged.names == layout.names
    assert damaged.upper[[0, 2, 3], [0, 0, 1]].tolist() == [0.3, 25.72, 10.0]
    assert damaged.lower[2, 0] == pytest.approx(-19.955)
    assert (damaged.lower[4, 0], damaged.upper[4, 0]) == (0.1, 0.1)
    assert (damaged.actuators[1], damaged.actuators[5]) == (
        layout.actuators[1],
        layout.actuators[5],
    )


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        ({"stuck": {"rudder": 0.1}}, "'rudder': rudders may be torn, lost, got stuck"),
        ({"stuck": {"lift": 60.0}}, "'lift': expected a force from -39.91 to 51.44 N.*, got 60 N"),
        ({"weak": {"rudder": 0.5}}, "'rudder': rudders may be torn, lost"),
        ({"torn": {"lift": 0.5}}, "'lift': thrusters may be weak, stuck, running, lost"),
        (
            {"running": {"pod": (0.1, 1.0, 0.0)}},
            r"'pod': running: .* azimuths have \(angle \[rad\], force \[N\]\), 2 in all, got 3",
        ),
        (
            {"running": {"side": (0.1, 1.0)}},
            r"'side': running: expected the command that fins have .* got 2",
        ),
        ({"running": {"pod": (0.1, 30.0)}}, "'pod': expected a force from 0 to 20 N.*, got 30 N"),
        (
            {"weak": {"lift": 0.5}, "running": {"lift": (30.0,)}},
            "'lift': expected a force from .* to 25.72 N",
        ),
        ({"running": {"side": (9.0, 1.0, 0.0)}}, "damage of 'side'"),
    ],
)
def test_damage_that_an_actuator_cannot_have_is_refused(damage, why):
    with pytest.raises((AllocationError, LayoutError), match=why):
        Damage(**damage).applied_to(parse_layout(GOOD_LAYOUT))


UNCERTAINTY = {"share": 0.05, "floor_n": 0.1, "common": "bench", "correlation": 0.4}
"""How uncertain an actuator's force is, as a layout file says it."""


@pytest.mark.parametrize("i", range(6))
def test_any_actuator_may_be_uncertain(i: int) -> None:
    data = copy.deepcopy(GOOD_LAYOUT)
    data["actuators"][i]["uncertainty"] = UNCERTAINTY
    layout = parse_layout(data)
    assert layout.actuators[i].uncertainty == Uncertainty(0.05, 0.1, "bench", 0.4)
    assert [part.uncertainty for k, part in enumerate(layout.actuators) if k != i] == [None] * 5
    assert parse_layout(layout_to_dict(layout)) == layout != parse_layout(GOOD_LAYOUT)


@pytest.mark.parametrize(
    ("key", "value"),
    [("share", -0.1), ("floor_n", math.inf), ("common", ""), ("correlation", 1.1), ("x", 1)],
)
def test_uncertainty_that_cannot_be_is_refused_with_its_key(key: str, value: object) -> None:
    data = copy.deepcopy(GOOD_LAYOUT)
    data["actuators"][2]["uncertainty"] = {**UNCERTAINTY, key: value}
    with pytest.raises(
        LayoutError, match=rf"actuators\[2\]\.uncertainty\.{key} of thruster 'lift': "
    ):
        parse_layout(data)


def test_fins_with_a_mounting_angle_may_be_uncertain() -> None:
    layout = load_layout("A").replace_actuator("front_right", uncertainty=Uncertainty(0.02))
    assert parse_layout(layout_to_dict(layout)) == layout
