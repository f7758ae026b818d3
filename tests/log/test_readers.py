"""Logs that lack something, are damaged, or are bags of ROS; and the command."""

import json
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.cli import main
from finlab.errors import FinlabError
from finlab.log import judge, read_log
from tests.log.bag_writer import write_bag
from tests.log.conftest import Dive
from tests.log.test_judge import check


def bag_of(dive: Dive, path: Path, topics: tuple[str, ...] = ("/wrench",)) -> Path:
    """A bag of a dive's wrenches, on several topics, and of forces of thrusters."""
    columns = np.array([[*p.axis, *np.cross(p.position, p.axis)] for p in dive.robot.actuators])
    forces = dive.given @ np.linalg.pinv(columns)
    write_bag(path, dive.time - dive.time[0], dive.demand, forces, topics)
    return path


def test_a_bag_of_wrenches_and_forces_is_judged(px4: Dive, tmp_path: Path) -> None:
    bag = bag_of(px4, tmp_path / "bag")
    judged = judge(read_log(bag, px4.robot), improve=False)
    shifted = Dive(px4.robot, bag, px4.time - px4.time[0], px4.demand, px4.given)
    check(shifted, judged)
    alone = next(bag.glob("*.mcap"))
    assert read_log(alone, px4.robot) == replace(read_log(bag, px4.robot), source=alone.name)
    with pytest.raises(FinlabError, match="--robot"):
        read_log(bag)


def test_a_bag_of_two_wrenches_asks_which(px4: Dive, tmp_path: Path) -> None:
    short = Dive(px4.robot, px4.path, px4.time[:50], px4.demand[:50], px4.given[:50])
    bag = bag_of(short, tmp_path / "bag", ("/a", "/b"))
    with pytest.raises(FinlabError, match="--demand TOPIC"):
        read_log(bag, px4.robot)
    assert len(read_log(bag, px4.robot, demand="/b")) > 40
    with pytest.raises(FinlabError, match="no topic '/c'"):
        read_log(bag, px4.robot, demand="/c")


def test_a_log_of_ardusub_that_ends_in_zeros_is_read_in_silence(
    sub: Dive, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dive.bin").write_bytes(sub.path.read_bytes() + bytes(2000))
    assert read_log(tmp_path / "dive.bin", sub.robot) == read_log(sub.path, sub.robot)
    assert capfd.readouterr() == ("", "")
    with ThreadPoolExecutor(1) as other:
        other.submit(read_log, tmp_path / "dive.bin", sub.robot)
        for _ in range(50):
            print("heard", flush=True)
            os.write(1, b"heard\n")
    assert capfd.readouterr() == ("heard\n" * 100, "")


@pytest.mark.parametrize("kind", ["px4", "sub"])
def test_a_log_that_is_cut_says_so(
    kind: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    dive: Dive = request.getfixturevalue(kind)
    assert not any("It ends" in note for note in read_log(dive.path, dive.robot).notes)
    (tmp_path / "cut").write_bytes(dive.path.read_bytes()[:150_001])
    assert any("It ends" in note for note in read_log(tmp_path / "cut", dive.robot).notes)


def test_a_clock_that_jumps_back_is_told(sub: Dive, tmp_path: Path) -> None:
    content = sub.path.read_bytes()
    half = content.index(bytes([0xA3, 0x95, 2]), len(content) // 2)
    (tmp_path / "a.bin").write_bytes(content[:half] + content[half - half // 4 :])
    notes = read_log(tmp_path / "a.bin", sub.robot).notes
    assert any("clock jumps back, by up to" in note for note in notes)


def test_a_demand_that_is_not_logged_is_not_judged(sub: Dive, tmp_path: Path) -> None:
    (tmp_path / "dive.bin").write_bytes(sub.path.read_bytes().replace(b"RCIN", b"SCIN"))
    log = read_log(tmp_path / "dive.bin", sub.robot)
    assert np.isnan(log.demand[:, :2]).all() and sum("not judged" in ask for ask in log.asks) == 2
    judged = judge(log, improve=False)
    assert judged.axis == "Tz" and judged.missing[:2] == (0.0, 0.0)


def test_another_vehicle_of_ardupilot_is_refused(sub: Dive, tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(
        sub.path.read_bytes().replace(b"Leak Detected", b"ArduCopter V4")
    )
    with pytest.raises(FinlabError, match="a log of ArduCopter, expected one of ArduSub"):
        read_log(tmp_path / "a.bin", sub.robot)


def test_what_is_no_log_is_said(tmp_path: Path) -> None:
    for name, content in (
        ("a.bin", b"hello"),
        ("a.mcap", b"hello"),
        ("a.ulg", b"ULog\x01\x125" + b"\0" * 9),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(FinlabError, match=name):
            read_log(tmp_path / name)


def test_a_robot_that_does_not_fit_is_refused(px4: Dive, sub: Dive) -> None:
    with pytest.raises(FinlabError, match="8 motors"):
        read_log(px4.path, "bluerov2")
    with pytest.raises(FinlabError, match="order of the motors"):
        parts = px4.robot.actuators
        read_log(sub.path, finlab.Layout("other", parts[::-1]))


def test_the_command_tells_draws_and_writes(
    px4: Dive, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = {
        key: tmp_path / name
        for key, name in (("plot", "a.svg"), ("json", "a.json"), ("output", "better.yaml"))
    }
    options = [word for key, path in files.items() for word in (f"--{key}", str(path))]
    assert main(["log", str(px4.path), "--priority", "Tz", *options]) == 0
    said = capsys.readouterr().out
    assert said.startswith("Yaw (Tz) was lost for 10") and "without rotor8" in said
    assert json.loads(files["json"].read_text())["sentence"][:40] == said[:40]
    assert "<svg" in files["plot"].read_text() and finlab.load_layout(files["output"]).n == 8


def test_a_missing_reader_is_named(px4: Dive, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyulog", None)
    with pytest.raises(FinlabError, match=r"finlab-marine\[logs\]"):
        read_log(px4.path)
