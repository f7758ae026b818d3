"""The drive of a fin, in layouts, layout files and bundles."""

import json
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.deploy.bundle import make_bundle
from finlab.errors import LayoutError
from finlab.layout import Layout, Servo, layout_to_dict, load_layout, parse_layout, save_layout

SLOW_SERVO = Servo(amplitude_pole=3.0, speed_limit=6.0)
"""A drive that is slower than the default."""


@pytest.fixture(scope="module")
def slow() -> Layout:
    """Robot A, one fin of which has this drive."""
    return load_layout("A").replace_actuator("back_left", servo=SLOW_SERVO)


def test_arrays_follow_the_order_of_commands(slow: Layout) -> None:
    i = slow.index("back_left")
    assert slow.servo_poles[i].tolist() == [3.0, 7.5, 3.5] and slow.speed_limit[i] == 6.0
    np.testing.assert_allclose(slow.servo_poles[slow.index("front_left")], [7.5, 7.5, 3.5])
    assert slow.without(["front_left"]).speed_limit.tolist().count(6.0) == 1
    with pytest.raises(ValueError, match="read-only"):
        slow.servo_poles[0, 0] = 1.0


@pytest.mark.parametrize("suffix", ["yaml", "json"])
def test_files_hold_what_is_not_usual(slow: Layout, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"robot.{suffix}"
    save_layout(slow, path)
    assert load_layout(path) == slow
    own = {fin["name"]: fin.get("servo") for fin in layout_to_dict(slow)["actuators"]}
    assert own.pop("back_left") == {"amplitude_pole_rad_s": 3.0, "speed_limit_rad_s": 6.0}
    assert set(own.values()) == {None}


def test_bundles_take_it_along(slow: Layout, tmp_path: Path) -> None:
    make_bundle(Allocator(slow)).write(tmp_path / "bundle")
    assert load_layout(tmp_path / "bundle") == slow
    robot = json.loads((tmp_path / "bundle" / "robot.json").read_text())
    assert [fin["name"] for fin in robot["layout"]["actuators"] if "servo" in fin] == ["back_left"]


@pytest.mark.parametrize(
    "field", ["amplitude_pole", "frequency_pole", "direction_pole", "speed_limit"]
)
def test_a_servo_has_positive_numbers(field: str) -> None:
    for wrong in (0.0, -1.0, float("nan"), 2000.0, "fast"):
        with pytest.raises(LayoutError, match=f"^{field}: "):
            Servo(**{field: wrong})


def test_layouts_with_other_servos_are_two(slow: Layout) -> None:
    assert slow != load_layout("A") and hash(slow) != hash(load_layout("A"))
    data = layout_to_dict(slow)
    for fin in data["actuators"]:
        fin["servo"] = None
    assert parse_layout(data) == load_layout("A")
