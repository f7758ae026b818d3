"""Logs whose losses are known are judged: how much, when, which axis, why, and what would have held
it."""

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pymavlink import DFReader

import finlab
from finlab.analysis import second_losses
from finlab.log import Judgement, judge, read_log
from finlab.log.ardusub_log import read_dataflash
from finlab.log.judgement_text import judgement_text
from finlab.log.replay import demands_of, replay
from finlab.physics.objective import wrench_scale_of
from tests.log.conftest import SUB_UNIT, Dive, columns, px4_dive, sub_dive, sub_motion
from tests.log.telemetry_writer import telemetry_of, write_telemetry

YAW = 5
"""Index of yaw in a wrench."""


@pytest.fixture(params=["px4", "sub"])
def dive(request: pytest.FixtureRequest) -> Dive:
    """The dive of a log, by the name of its fixture."""
    made: Dive = request.getfixturevalue(request.param)
    return made


def check(dive: Dive, judged: Judgement) -> None:
    """Yaw was lost as put in, over the hard sixth, and priority of yaw would have held it."""
    hard = slice(len(dive.time) // 2, len(dive.time) // 2 + len(dive.time) // 6)
    begin, end = dive.time[hard][[0, -1]]
    put_in = 0.02 * np.abs(dive.demand - dive.given)[hard].sum(0)
    np.testing.assert_allclose(judged.missing, put_in, rtol=0.01, atol=0.01 * put_in[YAW])
    assert judged.axis == "Tz" and judged.n_spells == 1
    assert (judged.spells[0].start, judged.spells[0].end) == pytest.approx((begin, end), abs=0.05)
    assert judged.lost_s[YAW] == pytest.approx(end - begin, abs=0.05)
    assert judged.spells[0].gave[YAW] == pytest.approx(dive.given[hard, YAW].mean(), rel=0.01)
    assert (
        len(judged.spells[0].limits) == 2
        and "front_" in judged.sentence
        and "at full thrust" in judged.sentence
    )
    held = judged.held_by
    assert held is not None and (held.method, held.robot) == ("dual", "as it is")
    assert held.policy.startswith("priority Tz") and "dual priority Tz" in judged.sentence
    assert held.missing[YAW] < 0.01 * put_in[YAW] and "of surge" in judged.sentence


def test_a_lost_yaw_is_measured_and_the_policy_named_that_holds_it(dive: Dive) -> None:
    log = read_log(dive.path, dive.robot)
    np.testing.assert_allclose(log.demand, dive.demand, atol=1e-3)
    judged = judge(log, improve=False)
    check(dive, judged)
    lost = {(each.lost, each.name) for each in judged.replays}
    assert {(name, "px4") for name in (None, *dive.robot.names)} <= lost and len(lost) == 5 * 9
    assert json.loads(json.dumps(judged.to_dict(), allow_nan=False))["axis"] == "Tz"


def test_the_replay_of_px4_is_what_its_log_shows(px4: Dive) -> None:
    judged = judge(read_log(px4.path, px4.robot), improve=False)
    own = next(each for each in judged.replays if each.method == "px4" and each.lost is None)
    np.testing.assert_allclose(own.missing, px4.missing, rtol=1e-3, atol=1e-3)
    assert judged.watts == pytest.approx(own.watts, rel=1e-3)


def test_the_geometry_comes_from_the_log(px4: Dive, sub: Dive) -> None:
    log = read_log(px4.path)
    check(replace(px4, robot=log.robot), replace_names(judge(log, improve=False)))
    assert not log.asks
    assert any("--robot" in each for each in read_log(sub.path).asks)
    assert "Leak Detected" in [event.words for event in read_log(sub.path).events]


def replace_names(judged: Judgement) -> Judgement:
    """Parameters have no names of thrusters."""
    parts = (replace(part, name=f"front_{i}") for i, part in enumerate(judged.robot.actuators))
    spells = (
        replace(each, limits=("front_0 at full thrust",) * len(each.limits))
        for each in judged.spells
    )
    robot = replace(judged.robot, actuators=tuple(parts))
    return replace(judged, robot=robot, spells=tuple(spells))


def test_without_outputs_the_autopilots_own_word_counts(tmp_path: Path) -> None:
    dive = px4_dive(tmp_path / "dive.ulg", n=600, outputs="")
    log = read_log(dive.path, dive.robot)
    judged = judge(log, improve=False)
    np.testing.assert_allclose(judged.missing, dive.missing, rtol=0.01, atol=0.01)
    assert judged.watts is None and any("no outputs" in each for each in judged.asks)


def test_widths_of_pulses_stand_for_outputs(tmp_path: Path) -> None:
    dive = px4_dive(tmp_path / "dive.ulg", n=600, outputs="pulses")
    judged = judge(read_log(dive.path, dive.robot), improve=False)
    np.testing.assert_allclose(judged.missing, dive.missing, rtol=0.01, atol=0.01)
    assert judged.watts is not None


def test_the_robots_health_is_told(px4: Dive) -> None:
    judged = judge(read_log(px4.path, px4.robot), improve=False)
    words = ["rear_right failed, says PX4", "lift_rear_left has an ESC offline"]
    assert sorted(said for _, said in judged.events) == sorted(words)
    assert judged.events[0][0] == pytest.approx(px4.time[len(px4.time) // 3], abs=0.1)


@pytest.mark.parametrize("rest", [0.0, np.nan])
def test_a_thruster_at_rest_all_along_is_named_and_replays_do_without_it(
    rest: float, px4: Dive
) -> None:
    log = read_log(px4.path, px4.robot)
    name = px4.robot.names[1]
    easy = slice(0, len(log) // 2 - 10)
    some = {key: getattr(log, key)[easy] for key in ("time", "span", "demand", "command")}
    assert judge(replace(log, **some), improve=False).stopped == ()
    force = some["command"][:, 1, 0].copy()
    some["command"][:, 1] = rest
    judged = judge(replace(log, **some), improve=False)
    assert judged.stopped == (name,) and f"with {name} at rest all along" in judged.sentence
    np.testing.assert_allclose(
        judged.missing, some["span"] @ np.abs(force) * np.abs(columns(px4.robot)[1]), 1e-3
    )
    assert (
        judged.held_by is not None
        and judged.held_by.lost == name
        and f"without {name}" in judged.sentence
    )


@pytest.mark.parametrize("write", [px4_dive, sub_dive])
def test_a_thruster_that_ceases_to_turn_is_named_and_its_force_is_missing(
    write: Callable[..., Dive], tmp_path: Path
) -> None:
    speed = np.full((600, 8), 900.0)
    speed[200:, 2] = 0.0
    dive = write(tmp_path / "dive", n=600, speed=speed)
    log = read_log(dive.path, dive.robot)
    name = dive.robot.names[2]
    (event,) = (each for each in log.events if "stood still" in each.words)
    assert event.actuator == 2 and 0.0 <= event.time - dive.time[200] < 0.5
    whole = read_log(write(tmp_path / "whole", n=600).path, dive.robot)
    judged = judge(log, improve=False)
    late = log.time >= event.time
    force = np.outer(whole.command[:, 2, 0], columns(dive.robot)[2])
    missing = whole.span[late] @ np.abs(dive.demand - dive.given + force)[late]
    np.testing.assert_allclose(judged.missing, missing, rtol=0.01, atol=0.01)
    assert judged.stopped == (name,) and f"{name} stopped" in judged.sentence
    assert f"without {name}" in judged.sentence
    assert judge(whole, improve=False).stopped == ()


def test_pairs_of_losses_are_told_and_the_next_loss_of_a_damaged_robot(px4: Dive) -> None:
    log = read_log(px4.path, px4.robot)
    judged = judge(log, improve=False)
    assert judged.second_losses == second_losses(px4.robot)
    assert "of 28:" in judgement_text(judged)
    name = px4.robot.names[1]
    assert log.command is not None
    log.command[:, 1] = np.nan
    damaged = judge(log, improve=False)
    assert damaged.stopped == (name,)
    assert all(name in (pair.first, pair.second) for pair in damaged.second_losses)
    assert f"Without {name}, the loss of one of these takes away:" in judgement_text(damaged)


def test_the_scale_is_the_users_where_it_is_given(sub: Dive) -> None:
    log = read_log(sub.path, sub.robot, scale=2.0 * SUB_UNIT)
    np.testing.assert_allclose(log.demand, 2.0 * sub.demand, atol=1e-3)
    assert any("--scale" in note for note in judge(log, improve=False).notes)


def test_a_robot_turned_round_is_the_same_robot(px4: Dive) -> None:
    turned = tuple(replace(p, axis=tuple(-x for x in p.axis)) for p in px4.robot.actuators)
    log = read_log(px4.path, replace(px4.robot, actuators=turned))
    check(px4, judge(log, improve=False))


def test_a_better_layout_is_proposed_and_replayed(px4: Dive) -> None:
    judged = judge(read_log(px4.path, px4.robot))
    assert judged.improved is not None and judged.improved.names == px4.robot.names
    size = {where: [] for where in ("as it is", "improved")}
    for each in judged.replays:
        if each.name == "dual closest" and each.lost is None:
            size[each.robot].append(np.sum(each.missing / judged.scale))
    assert size["improved"] < size["as it is"]


@pytest.mark.parametrize("seed", range(3))
def test_demands_taken_together_keep_their_impulse(seed: int, px4: Dive) -> None:
    rng = np.random.default_rng(seed)
    scale = wrench_scale_of(px4.robot)
    wrench = px4.demand + 0.02 * scale * rng.normal(size=px4.demand.shape)
    wrench[rng.random(len(wrench)) < 0.2, 1] = np.nan
    span = rng.uniform(0.01, 0.03, len(wrench))
    few = demands_of(wrench, span, scale, 200)
    assert len(few.wrench) <= 200 and few.span.sum() == pytest.approx(span.sum())
    np.testing.assert_allclose(few.span @ np.nan_to_num(few.wrench), span @ np.nan_to_num(wrench))
    few_asked, all_asked = (
        next(replay(px4.robot, *rows, [finlab.Policy()])).missing
        for rows in ((few.wrench, few.span), (wrench, span))
    )
    np.testing.assert_allclose(few_asked, all_asked, rtol=0.03, atol=0.01 * np.sum(all_asked))
    same = demands_of(np.repeat(wrench[:50], 9, axis=0), np.ones(450), scale, 60)
    assert same.spread == 0.0 and len(same.wrench) == 50 and (same.span == 9.0).all()


def telemetry_dive(path: Path, n: int) -> Dive:
    """A telemetry log of ArduSub in mode MANUAL."""
    motion = sub_motion(n, 0.02)
    written = write_telemetry(path, telemetry_of(motion))
    time_s = motion.time - motion.time[0]
    return Dive(motion.robot, written, time_s, motion.demand, motion.given)


@pytest.mark.parametrize(
    "write",
    [
        sub_dive,
        pytest.param(px4_dive, marks=pytest.mark.exhaustive),
        pytest.param(telemetry_dive, marks=pytest.mark.exhaustive),
    ],
)
def test_twenty_minutes_at_fifty_hertz_are_judged_in_four_seconds(
    write: Callable[..., Dive], tmp_path: Path
) -> None:
    """It takes 1.3 to 1.8 s on a quiet machine, half of it the search for a better layout."""
    dive = write(tmp_path / "dive", n=60_000)
    begin = time.process_time()
    judged = judge(read_log(dive.path, dive.robot))
    assert time.process_time() - begin < 4.0
    check(dive, judged)


def test_dataflash_is_read_as_quickly_as_by_its_library_alone(tmp_path: Path) -> None:
    path = sub_dive(tmp_path / "dive.bin", n=10_000).path

    def seconds(read: Callable[[], object]) -> float:
        times = []
        for _ in range(3):
            begin = time.thread_time()
            read()
            times.append(time.thread_time() - begin)
        return min(times)

    def by_library() -> None:
        with DFReader.DFReader_binary(str(path)):
            pass

    assert seconds(lambda: read_dataflash(path)) < seconds(by_library)
