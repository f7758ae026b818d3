"""MCAP of judged logs, read back by the package `mcap`; schemas judge the messages by `jsonschema`."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from mcap.reader import make_reader

from finlab.cli import main
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.log import Judgement, Log, judge, read_log
from finlab.log.mcap_file import check_mcap_file, write_mcap
from tests.log.conftest import Dive, px4_dive

Channels = dict[str, list[tuple[int, Any]]]
"""Times [ns] and values of the messages by topic."""


def read_back(path: Path) -> Channels:
    """The channels of a file; each message keeps the schema of its channel."""
    channels: Channels = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            assert schema is not None and schema.encoding == "jsonschema"
            assert channel.message_encoding == "json"
            value = json.loads(message.data)
            rows = channels.setdefault(channel.topic, [])
            if len(rows) % 50 == 0:
                Draft202012Validator(json.loads(schema.data)).validate(value)
            rows.append((message.log_time, value))
    return channels


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> tuple[Dive, Log, Judgement]:
    """A dive in which yaw was lost, and the third thruster stands still at last."""
    speed = np.full((600, 8), 900.0)
    speed[200:, 2] = 0.0
    dive = px4_dive(tmp_path_factory.mktemp("dive") / "dive.ulg", n=600, speed=speed)
    log = read_log(dive.path, dive.robot)
    return dive, log, judge(log, improve=False)


def wrench_of(value: Any) -> list[Any]:
    """The six numbers of a message of a wrench."""
    return [value[part][axis] for part in ("force", "torque") for axis in "xyz"]


def test_wrenches_and_forces_are_those_of_the_log(
    judged: tuple[Dive, Log, Judgement], tmp_path: Path
) -> None:
    dive, log, judgement = judged
    write_mcap(log, judgement, tmp_path / "dive.mcap")
    channels = read_back(tmp_path / "dive.mcap")
    asked = channels["/finlab/asked"]
    np.testing.assert_allclose([at * 1e-9 for at, _ in asked], log.time, atol=1e-8)
    np.testing.assert_allclose([wrench_of(value) for _, value in asked], log.demand, atol=1e-5)
    forces = channels["/finlab/forces"]
    names = dive.robot.names
    table = np.array([[value[name] for name in names] for _, value in forces], np.float64)
    np.testing.assert_allclose(table, log.command[..., 0], atol=1e-5)
    assert np.isnan(table[-1, 2]) and not np.isnan(table[0]).any()
    given = np.array([wrench_of(value) for _, value in channels["/finlab/given"]])
    np.testing.assert_allclose(given[:200], dive.given[:200], atol=1e-3)
    missing = np.array([wrench_of(value) for _, value in channels["/finlab/missing"]])
    np.testing.assert_allclose(log.span @ np.abs(missing), judgement.missing, rtol=1e-4, atol=1e-3)
    limits = channels["/finlab/at_limit"]
    assert any(value[name] for _, value in limits for name in names)


def test_the_verdict_is_what_foxglove_shows_as_log(
    judged: tuple[Dive, Log, Judgement], tmp_path: Path
) -> None:
    _, log, judgement = judged
    path = tmp_path / "dive.mcap"
    write_mcap(log, judgement, path)
    channels = read_back(path)
    time, verdict = channels["/finlab/verdict"][0]
    assert verdict["message"] == judgement.sentence and verdict["level"] == 3
    assert verdict["timestamp"] == {"sec": time // 10**9, "nsec": time % 10**9}
    spells = channels["/finlab/spells"]
    assert len(spells) == 2 * len(judgement.spells)
    assert "Tz" in spells[0][1]["message"] and spells[0][0] < spells[1][0]
    assert len(channels["/finlab/events"]) == len(judgement.events)
    with path.open("rb") as stream:
        reader = make_reader(stream)
        schemas = {schema.name for schema in reader.get_summary().schemas.values()}
        (attached,) = reader.iter_attachments()
    assert "foxglove.Log" in schemas
    assert json.loads(attached.data)["sentence"] == judgement.sentence


def test_forces_of_other_actuators_are_vectors_and_axes_that_do_not_count_are_null(
    tmp_path: Path,
) -> None:
    robot = load_layout("A")
    n = 5
    command = np.tile([0.4, 1.0, 0.3], (n, robot.n, 1))
    demand = np.tile([1.0, np.nan, 0.0, 0.0, 0.0, 0.1], (n, 1))
    log = Log(
        source="a",
        form="ros",
        robot=robot,
        time=np.arange(n) * 0.1,
        span=np.full(n, 0.1),
        demand=demand,
        command=command,
        unmet=None,
        events=(),
        notes=(),
        asks=(),
    )
    write_mcap(log, judge(log, improve=False), tmp_path / "a.mcap")
    channels = read_back(tmp_path / "a.mcap")
    assert channels["/finlab/asked"][0][1]["force"] == {"x": 1.0, "y": None, "z": 0.0}
    force = channels["/finlab/forces"][0][1][robot.names[0]]
    size = 4.737 * np.sin(0.4) ** 2
    assert np.linalg.norm([force[axis] for axis in "xyz"]) == pytest.approx(size, rel=1e-3)


def test_the_command_writes_it(px4: Dive, tmp_path: Path) -> None:
    path = tmp_path / "dive.mcap"
    assert main(["log", str(px4.path), "--no-improve", "--mcap", str(path)]) == 0
    assert len(read_back(path)["/finlab/asked"]) == len(read_log(px4.path))


@pytest.mark.parametrize("name", ["a.bag", "nowhere/a.mcap"])
def test_what_cannot_be_written_is_said_before_the_work(name: str, tmp_path: Path) -> None:
    with pytest.raises(FinlabError, match=r"ends in \.mcap"):
        check_mcap_file(tmp_path / name)


def test_a_missing_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(FinlabError, match=r"finlab-marine\[logs\]"):
        check_mcap_file(tmp_path / "a.mcap")
