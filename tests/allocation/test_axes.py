"""Axes that do not count: of a layout, and of one question by their names."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation import Allocator, Policy
from finlab.allocation.policy import POLICY_NAMES
from finlab.axes import AXES
from finlab.cli import main
from finlab.errors import CommandError, LayoutError
from finlab.layout import Layout, load_layout
from finlab.layout.load import parse_layout
from finlab.layout.save import layout_to_dict
from tests.oracle_optima import lower_bound
from tests.oracle_plant import OraclePlant
from tests.random_robots import layout_of


@pytest.mark.parametrize("policy", POLICY_NAMES)
@pytest.mark.parametrize(
    ("name", "surge"),
    [("bluerov2", 20.0), ("torpedo", 60.0), ("catamaran", 60.0), ("bluerov2", 0.2)],
)
def test_an_axis_that_nobody_commands_decides_nothing(name: str, surge: float, policy: str) -> None:
    answer = Allocator(load_layout(name)).allocate([surge, 0, 0, 0, 0, 0], policy=policy)
    assert answer.reachable and answer.err_norm < 1e-9
    assert answer.wrench[0] == pytest.approx(surge, rel=1e-9, abs=1e-8)
    assert not any("not reached" in note for note in answer.notes)


@pytest.mark.parametrize("policy", POLICY_NAMES)
def test_an_axis_is_freed_by_name_for_one_question(policy: str) -> None:
    layout = load_layout("bluerov2_heavy")
    allocator = Allocator(layout)
    surge = [20.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    free = AXES[1:]
    one = allocator.allocate(surge, free=free, policy=policy)
    assert one.wrench[0] == pytest.approx(20.0) and one.reachable
    np.testing.assert_array_equal(np.isnan(one.target), [False] + 5 * [True])
    np.testing.assert_allclose(one.unallocated, 0.0, atol=1e-7)
    held = allocator.allocate([20.0, 0, 0, 0, 0, 0], policy=policy)
    assert one.power <= held.power * (1.0 + 1e-9)
    robot = Allocator(replace(layout, axes=("Fx",))).allocate(
        [20.0, 1.0, 2.0, 3.0, 4.0, 5.0], policy=policy
    )
    np.testing.assert_allclose(robot.command, one.command, atol=1e-9)


def test_a_free_axis_takes_what_the_cheapest_answer_gives() -> None:
    mapping = layout_of("robot", _three_thrusters())
    plant = OraclePlant(mapping)
    answer = Allocator(parse_layout(mapping)).allocate(
        [12.0, 0.0, 0.0, 0.0, 0.0, 9.0], free=("Tz",)
    )
    watts = [
        lower_bound(plant, np.array([12.0, 0, 0, 0, 0, yaw])) for yaw in np.linspace(-6, 6, 121)
    ]
    assert answer.power <= min(watts) * (1.0 + 1e-6)
    assert answer.power >= min(watts) * (1.0 - 1e-2)


def _three_thrusters() -> list[dict[str, object]]:
    """Three thrusters side by side, each with another law, as a layout file says them."""
    laws = [0.5, 1.0, 2.0]
    return [
        {"name": f"m{k}", "type": "thruster", "position_m": [0.0, y, 0.0], "axis": [1.0, 0.0, 0.0]}
        | {"force_n": [-40.0, 50.0], "model": {"type": "power_law", "forward": law, "reverse": law}}
        for k, (law, y) in enumerate(zip(laws, (-0.3, 0.1, 0.4), strict=True))
    ]


@pytest.mark.parametrize("policy", POLICY_NAMES)
def test_a_batch_with_free_axes_is_answered_as_each_alone(policy: str) -> None:
    rng = np.random.default_rng(7)
    for name in ("bluerov2", "A", "catamaran"):
        allocator = Allocator(load_layout(name))
        wrenches = rng.normal(size=(12, 6)) * allocator.scale * 10.0 ** rng.uniform(-1, 1, (12, 1))
        free = tuple(rng.choice(AXES[1:], 2, replace=False))
        batch = allocator.allocate_batch(wrenches, free=free, policy=policy)
        for k, wrench in enumerate(wrenches):
            one = allocator.allocate(wrench, free=free, policy=policy)
            assert batch.err_norm[k] == pytest.approx(one.err_norm, abs=1e-9)
            assert batch.power[k] == pytest.approx(one.power, rel=1e-7, abs=1e-9)
            np.testing.assert_array_equal(np.isnan(batch.target[k]), np.isnan(one.target))


def test_a_question_that_asks_for_nothing_is_refused() -> None:
    torpedo = load_layout("torpedo")
    with pytest.raises(CommandError, match="names each axis that layout torpedo commands"):
        Allocator(torpedo).allocate([1.0, 0, 0, 0, 0, 0], free=torpedo.axes)
    for free, sentence in (("Tz", "a list of axes"), (("yaw",), "got 'yaw'"), ((1,), "got 1")):
        with pytest.raises(CommandError, match=sentence):
            Allocator(torpedo).allocate([1.0, 0, 0, 0, 0, 0], free=free)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, None])
def test_what_is_no_number_is_an_error_that_names_free(value: float | None) -> None:
    allocator = Allocator(load_layout("A"))
    wrench = [1.0, 0.0, 0.5, 0.0, 0.0, value]
    for ask, asked in ((allocator.allocate, wrench), (allocator.allocate_batch, [wrench])):
        with pytest.raises(CommandError, match=r'free=\("Tz",\)'):
            ask(asked)


def test_an_axis_that_cannot_be_held_is_named() -> None:
    layout = load_layout("bluerov2")
    answer = Allocator(replace(layout, axes=AXES)).allocate([20.0, 0, 0, 0, 0, 0])
    assert any("Fx, Ty apart" in note or "Fx and Ty apart" in note for note in answer.notes), (
        answer.notes
    )
    asked = Allocator(layout).allocate([20.0, 0, 0, 0, 3.0, 0])
    assert any("Ty" in note and "not command" in note for note in asked.notes), asked.notes


def test_priority_of_a_robot_that_commands_three_axes() -> None:
    allocator = Allocator(load_layout("catamaran"))
    for order in ((("Tz",), ("Fx", "Fy")), (("Fz", "Tx"), ("Fx",)), (("Ty",),)):
        answer = allocator.allocate([1e4, 0, 0, 0, 0, 0], policy=Policy("priority", order=order))
        assert np.isfinite(answer.err_norm)


def test_axes_in_files() -> None:
    layout = replace(load_layout("bluerov2"), axes=("Tz", "Fx"))
    assert layout.axes == ("Fx", "Tz")
    layout_read_back: Layout = parse_layout(json.loads(json.dumps(layout_to_dict(layout))))
    assert layout_read_back == layout and layout_read_back != load_layout("bluerov2")
    with pytest.raises(LayoutError, match="named once"):
        replace(layout, axes=("Fx", "Fx"))
    with pytest.raises(LayoutError, match="axes"):
        parse_layout(layout_to_dict(layout) | {"axes": ["surge"]})


def test_the_command_line_and_json_say_which_axes_are_free(
    capsys: pytest.CaptureFixture[str],
) -> None:
    wrench = ["20", "0", "0", "0", "3", "0", "--free", "Ty"]
    assert main(["allocate", "bluerov2_heavy", "--wrench", *wrench, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["target"] == [20.0, 0.0, 0.0, 0.0, None, 0.0]
    assert answer["unallocated"][4] == 0.0
    assert main(["allocate", "bluerov2_heavy", "--wrench", *wrench]) == 0
    assert "free" in capsys.readouterr().out
