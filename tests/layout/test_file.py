"""Layout files: what is accepted, and how each refusal names file, key and expectation."""

import copy
import json
import math
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from finlab.actuators.fin.fin_model import FIN_MODELS
from finlab.errors import LayoutError
from finlab.layout import (
    Fin,
    FinModelSpec,
    Layout,
    Limits,
    layout_to_dict,
    load_layout,
    parse_layout,
    save_layout,
)
from finlab.layout.layout import Bus

GOOD_LAYOUT = {
    "format": "finlab-layout",
    "version": 2,
    "name": "good",
    "description": "two fins",
    "frame": {"convention": "FLU", "origin": "center_of_gravity"},
    "actuators": [
        {
            "name": "left",
            "type": "fin",
            "position_m": [0.0, 0.2, 0.0],
            "mounting_angle_deg": 90,
            "limits": {
                "amplitude_rad": [0.05, 0.6],
                "frequency_hz": [0.1, 2.1],
                "zero_direction_rad": [-1, 2],
            },
            "model": {"type": "drag", "area": 0.03},
        },
        {"name": "right", "type": "fin", "position_m": [0, -0.2, 0], "mounting_angle_deg": -90.0},
    ],
    "body": {"hull": {"shape": "box", "size_m": [0.4, 0.2, 0.2]}, "mass_kg": 4.5},
}
"""A layout file that is read."""


def edited(*path, value):
    """A copy of GOOD with the value at a path replaced, or removed if the value is `...`."""
    data = copy.deepcopy(GOOD_LAYOUT)
    inner = data
    for key in path[:-1]:
        inner = inner.setdefault(key, {}) if isinstance(inner, dict) else inner[key]
    if value is ...:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    return data


def changed(key, value):
    """The same at a key path in the words of a refusal."""
    return edited(
        *(int(part) if part.isdigit() else part for part in re.findall(r"\w+", key)), value=value
    )


BAD_VALUES = [
    ("actuators", [], "expected a list of 1 to 256 values, got 0"),
    ("actuators", "left", "expected a list, got 'left'"),
    ("actuators", ..., "required key is missing"),
    ("version", 99, "this finlab reads version 2, got 99"),
    ("version", "1", "this finlab reads version 2"),
    ("version", True, "this finlab reads version 2"),
    ("format", "urdf", "expected finlab-layout, got 'urdf'"),
    ("name", ..., "required key is missing"),
    ("name", 7, "expected text, got 7"),
    ("name", "", "1 to 64 characters, got 0"),
    ("name", "a\nb", "on one line"),
    ("description", ["x"], "expected text"),
    ("surprise", 1, "unknown key"),
    ("frame.convention", "NED", "got 'NED'; y points left and z up: change the sign of y and z"),
    ("frame.convention", "XYZ", "expected FLU, got 'XYZ'"),
    ("frame.up", "z", "unknown key"),
    ("actuators[1]", 3, "expected keys and values"),
    ("actuators[1].name", "left", "already the name of actuator 1"),
    ("actuators[1].name", "x" * 65, "1 to 64 characters, got 65"),
    ("actuators[1].nmae", "x", "unknown key"),
    ("actuators[1].position_m", [0.1, 0.2], "a list of 3 values, got 2"),
    ("actuators[1].position_m", ..., "required key is missing"),
    ("actuators[1].position_m[0]", math.nan, "expected a number, got '.nan'"),
    ("actuators[1].position_m[2]", 1e308, "must lie within -10 .. 10"),
    ("actuators[1].position_m[1]", True, "expected a number, got True"),
    ("actuators[1].position_m[1]", 10**90, "must lie within"),
    ("actuators[1].mounting_angle_deg", "north", "got 'north'"),
    ("actuators[1].mounting_angle_deg", math.inf, "got '.inf'"),
    ("actuators[1].mounting_angle_deg", 720, "-360 .. 360, got 720"),
    ("actuators[0].limits", [1, 2], "expected keys and values"),
    ("actuators[0].limits.amplitude", [0, 1], "unknown key"),
    ("actuators[0].servo", [1, 2], "expected keys and values"),
    ("actuators[0].servo.speed", 3, "unknown key"),
    ("actuators[0].servo.speed_limit_rad_s", 0, "must lie within"),
    (
        "actuators[0].limits.amplitude_rad",
        [0.6, 0.05],
        "minimum 0.6 is above maximum 0.05; swap them",
    ),
    ("actuators[0].limits.amplitude_rad", [], "2 values, got 0"),
    ("actuators[0].limits.amplitude_rad[1]", 2, "must lie within"),
    ("actuators[0].limits.amplitude_rad", [0, 0], "the maximum must be at least 0.0001"),
    ("actuators[0].limits.frequency_hz[0]", -1, "must lie within"),
    ("actuators[0].limits.zero_direction_rad", [-4, 4], "one turn"),
    ("actuators[0].model", "drag", "expected keys and values, got 'drag'"),
    ("actuators[0].model.type", "jet", f"expected one of {', '.join(FIN_MODELS)}"),
    ("actuators[0].model.type", ..., "required key is missing"),
    ("actuators[0].model.area", -1, "must lie within 1e-05 .. 10, got -1"),
    ("actuators[0].model.width", 1, "expected one of density, drag_coefficient"),
    ("body.mass_kg", 0, "must lie within"),
    ("body.weight", 1, "unknown key"),
    ("body.added_mass", [1, 2, 3], "6 values, got 3"),
    ("body.hull.shape", "sphere", "expected one of box"),
    ("body.hull.size_m", ..., "missing beside shape"),
    ("body.hull.size_m[1]", -1, "must lie within"),
    ("body.hull", {"scale": 2}, "either a shape"),
]
"""Key, value, and what the refusal says."""


BAD_LAYOUTS = [(key, changed(key, value), why) for key, value, why in BAD_VALUES]
"""Key, a layout file in which it is wrong, and what the refusal says."""
BAD_LAYOUTS += [
    (
        "actuators[0].model.path",
        edited("actuators", 0, "model", value={"type": "table"}),
        "required key is missing",
    ),
    (
        "body.added_mass[5]",
        edited("body", "added_mass", value=[1, 2, 3, 4, 5, -6]),
        "must lie within",
    ),
    ("body.inertia_kgm2[0]", edited("body", "inertia_kgm2", value=[0, 1, 1]), "must lie within"),
    ("body.hull.mesh", edited("body", "hull", value={"mesh": "hull.exe"}), "expected a .stl"),
]


@pytest.mark.parametrize(("key", "data", "why"), BAD_LAYOUTS)
def test_a_bad_value_is_refused_with_file_key_and_reason(key, data, why, tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(yaml.safe_dump(data))
    with pytest.raises(LayoutError) as caught:
        load_layout(path)
    place, said = str(caught.value).removeprefix(f"{path}: ").split(": ", 1)
    index = re.match(r"actuators\[(\d)\]", key)
    part = data["actuators"][int(index[1])] if index else None
    whose = ""
    if isinstance(part, dict) and "name" in part and isinstance(part["name"], str):
        whose = f" of fin {part['name']!r:.66}"
    assert place == key + whose
    assert why in said
    assert "\n" not in str(caught.value)


ALIAS_BOMB = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{this}: &{this} [{','.join(['*' + last] * 9)}]\n"
    for last, this in zip("abcdefgh", "bcdefghi", strict=True)
)
"""A small file of YAML that grows to 9^9 values."""
HOSTILE_FILES = {
    "bomb": (ALIAS_BOMB, "anchors and aliases"),
    "anchor": ("a: &x 1\n", "anchors and aliases"),
    "python": ('!!python/object/apply:os.system ["touch pwned"]\n', "tags (!) are not allowed"),
    "tag": ("name: !custom x\n", "tags (!) are not allowed"),
    "binary": (bytes(range(256)) * 50, "not UTF-8 text"),
    "nul": (b"name: a\0b", "binary"),
    "big": ("a" * 3_000_000, "larger than 1,000,000 bytes"),
    "deep": ("[" * 400_000, "nested deeper"),
    "wide": ("[" + "1," * 400_000 + "1]", "too many to be read"),
    "many": (
        yaml.safe_dump(edited("actuators", value=[{"name": f"f{i}"} for i in range(5000)])),
        "1 to 256 values, got 5000",
    ),
    "twice": ("name: a\nversion: 1\nname: b\n", "line 3: key 'name' is given twice"),
    "list_key": ("? [1, 2]\n: 3\n", "a key must be plain text"),
    "syntax": ("fins: [1, 2\nname: x\n", "is not valid YAML: line 2"),
    "control": ("name: \x07\n", "is not valid YAML"),
    "two_documents": ("a: 1\n---\nb: 2\n", "is not valid YAML"),
    "empty": ("", "expected a file of keys and values"),
    "scalar": ("just words", "finlab layout convert reads"),
    "date": ("2026-13-45", ""),
}
"""Name of a damaged or hostile file -> its text, and what the refusal says."""


@pytest.mark.parametrize("name", HOSTILE_FILES)
def test_a_hostile_file_is_refused_quickly_and_runs_nothing(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    content, why = HOSTILE_FILES[name]
    path = tmp_path / f"{name}.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    start = time.perf_counter()
    with pytest.raises(LayoutError) as caught:
        load_layout(path)
    assert time.perf_counter() - start < 5.0
    assert str(caught.value).startswith(f"{path}: ")
    assert why in str(caught.value)
    assert len(str(caught.value)) < 600
    assert not (tmp_path / "pwned").exists()


def test_json_is_accepted_and_its_errors_are_as_plain(tmp_path):
    path = tmp_path / "layout.json"
    path.write_text(json.dumps(GOOD_LAYOUT))
    assert load_layout(path) == parse_layout(GOOD_LAYOUT)
    for content, why in [
        ('{"name": "a", "name": "b"}', "key 'name' is given twice"),
        ('{"name": ', "is not valid JSON: line 1"),
        ("[" * 200_000, "nested too deeply"),
        (
            json.dumps(edited("actuators", 0, "position_m", value=[math.nan, 0, 0])),
            "holds NaN, expected a finite number",
        ),
        ('{"version": ' + "9" * 5000 + "}", ""),
    ]:
        path.write_text(content)
        with pytest.raises(LayoutError) as caught:
            load_layout(path)
        assert why in str(caught.value)


def test_missing_file_folder_and_device_are_refused(tmp_path):
    for path, why in [
        (tmp_path / "no.yaml", "no such file"),
        (tmp_path, "is a folder"),
        ("/dev/zero", "not a regular file"),
        (tmp_path / ("x" * 300), ""),
        ("nul\0byte.yaml", ""),
    ]:
        with pytest.raises(LayoutError) as caught:
            load_layout(path)
        assert why in str(caught.value)


def test_what_a_file_may_leave_out_has_the_nominal_value():
    layout = parse_layout(GOOD_LAYOUT)
    assert layout.fins[1].limits == Limits() == Limits((0.05, 0.6), (0.1, 2.1), (-math.pi, math.pi))
    assert layout.fins[1].model == FinModelSpec("drag")
    assert layout.fins[0].limits.zero_direction == (-1.0, 2.0)
    assert layout.fins[0].model.values()["area"] == 0.03
    assert layout.fins[0].mounting_angle == pytest.approx(math.pi / 2)


def test_numbers_written_in_any_usual_way_are_numbers(tmp_path):
    path = tmp_path / "x.yaml"
    text = yaml.safe_dump(GOOD_LAYOUT).replace("mass_kg: 4.5", "mass_kg: 45e-1")
    path.write_text(text)
    assert load_layout(path).body.mass_kg == 4.5


def test_limits_of_zero_width_are_allowed():
    data = edited(
        "actuators", 0, "limits", value={"frequency_hz": [2, 2], "zero_direction_rad": [0, 0]}
    )
    assert parse_layout(data).fins[0].limits.frequency == (2.0, 2.0)


def test_relative_paths_start_at_the_layout_file(tmp_path):
    data = edited("actuators", 0, "model", value={"type": "table", "path": "tables/fin.csv"})
    data["body"]["hull"] = {"mesh": "hull.stl", "scale": 0.001}
    (tmp_path / "x.json").write_text(json.dumps(data))
    layout = load_layout(tmp_path / "x.json")
    assert dict(layout.fins[0].model.parameters)["path"] == str(tmp_path / "tables" / "fin.csv")
    assert layout.body.hull.mesh == str(tmp_path / "hull.stl")


def test_a_layout_that_cannot_be_written_leaves_nothing_behind(tmp_path):
    layout = Layout("x", (Fin("a", (0, 0, 0), 0.0),))
    (tmp_path / "folder.yaml").mkdir()
    with pytest.raises(LayoutError, match="cannot be written"):
        save_layout(layout, tmp_path / "folder.yaml")
    with pytest.raises(LayoutError, match="cannot be written"):
        save_layout(layout, tmp_path / "missing" / "x.yaml")
    assert [p.name for p in tmp_path.iterdir()] == ["folder.yaml"]


def test_power_buses_of_a_file_come_back(tmp_path: Path) -> None:
    layout = load_layout("bluerov2")
    front = layout.names[:2]
    buses = (Bus("front", 150.0, front), Bus("rest of it", 80.5, layout.names[2:4]))
    for changed in (replace(layout, buses=buses), replace(layout, power_w=216.0)):
        for name in ("robot.yaml", "robot.json"):
            save_layout(changed, tmp_path / name)
            assert load_layout(tmp_path / name) == changed
    lost = replace(layout, buses=buses).without([front[0]])
    assert lost.buses[0].actuators == (front[1],)


def test_power_buses_that_make_no_sense() -> None:
    layout = load_layout("bluerov2")
    bus = Bus("front", 150.0, layout.names[:2])
    with pytest.raises(LayoutError, match="there is no actuator 'nobody'"):
        replace(layout, buses=(Bus("front", 150.0, ("nobody",)),))
    with pytest.raises(LayoutError, match="an actuator has one bus"):
        replace(layout, buses=(bus, Bus("other", 10.0, layout.names[1:3])))
    with pytest.raises(LayoutError, match="already the name of a bus"):
        replace(layout, buses=(bus, Bus("front", 10.0, layout.names[2:3])))
    with pytest.raises(LayoutError, match="got both"):
        replace(layout, buses=(bus,), power_w=100.0)
    with pytest.raises(LayoutError, match="power_w"):
        Bus("front", -1.0, layout.names[:2])


@pytest.mark.parametrize(
    ("buses", "says"),
    [
        (
            {"aft": {"power_w": -4, "actuators": ["left"]}},
            "buses.aft.power_w: .*more than 0, got -4",
        ),
        ({"aft": {"power_w": 4, "actuators": []}}, "buses.aft.actuators: .*1 to 256 values, got 0"),
        ({"aft": {"power_w": 4, "actuators": [7]}}, r"buses.aft.actuators\[0\]: .*text, got 7"),
        ({"aft": {"power_w": 4}}, "buses.aft.actuators: required key is missing"),
        (
            {"aft": {"power_w": 4, "actuators": ["left"], "volts": 3}},
            "buses.aft.volts: unknown key",
        ),
        ({"aft": 4}, "buses.aft: expected keys and values, got 4"),
        ({"aft": {"power_w": 4, "actuators": ["left"]}, "bow": 5}, "buses.bow: .*got 5"),
        ({"a.b": {"power_w": 0, "actuators": ["left"]}}, "buses.a.b.power_w: .*got 0"),
        ({"": {"power_w": 4, "actuators": ["left"]}}, "buses: as a key.*1 to 64 characters, got 0"),
        ({" a": {"power_w": 4, "actuators": ["left"]}}, "buses: as a key in it, .*got ' a'"),
        ({"a\tb": {"power_w": 4, "actuators": ["left"]}}, "buses.*printable"),
    ],
)
def test_a_refused_bus_is_named_with_what_the_file_has(buses: dict[str, Any], says: str) -> None:
    with pytest.raises(LayoutError, match=says):
        parse_layout({**GOOD_LAYOUT, "buses": buses})


def test_mirror_pairs_of_a_file_come_back_and_follow_their_actuators(tmp_path: Path) -> None:
    layout = load_layout("ucat")
    front, back = ("front_right", "front_left"), ("back_left", "back_right")
    paired = replace(layout, mirror_pairs=(front, back))
    for name in ("robot.yaml", "robot.json"):
        save_layout(paired, tmp_path / name)
        assert load_layout(tmp_path / name) == paired
    assert paired != layout and paired.unpaired == layout
    assert paired.without(["front_left"]).mirror_pairs == (back,)
    renamed = paired.replace_actuator("front_left", name="bow")
    assert renamed.mirror_pairs == (("front_right", "bow"), back)


@pytest.mark.parametrize(
    ("pairs", "says"),
    [
        ([["front_left", "nobody"]], r"mirror_pairs\[0\]\[1\]: there is no actuator 'nobody'"),
        ([["front_left", "front_left"]], r"\[0\]\[1\]: 'front_left' is in a pair already"),
        ([["front_left", "back_left"], ["front_left", "front_right"]], r"\[1\]\[0\]: 'front_left'"),
        ([["front_left"]], r"mirror_pairs\[0\]: expected a list of 2 values"),
    ],
)
def test_mirror_pairs_that_make_no_sense(pairs: list[list[str]], says: str) -> None:
    data = {**layout_to_dict(load_layout("ucat")), "mirror_pairs": pairs}
    with pytest.raises(LayoutError, match=says):
        parse_layout(data)
