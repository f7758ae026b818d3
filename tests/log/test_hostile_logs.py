"""Logs that are damaged, or made to do harm: they end in a judgement or in a sentence, in two seconds
and 300 MB, and neither run code nor write a file."""

import os
import resource
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.files.worker import in_worker
from finlab.layout import Layout
from finlab.log import Log, judge, read_log
from tests.log.conftest import Dive, sub_motion
from tests.log.telemetry_writer import telemetry_of, write_telemetry
from tests.log.test_readers import bag_of

FORBIDDEN = ("os.system", "os.exec", "os.posix_spawn", "subprocess.Popen", "socket.connect")
"""Events of Python's audit that no reader causes."""
MOST_S = 2.0
"""Processor time that one log may take [s]."""
MOST_BYTES = 200e6
"""Memory that reading it may take [bytes], beside what the process has before."""


def watched_read(path: Path, robot: Layout) -> tuple[Log, int]:
    """Reads a log in a process of its own that nothing forbidden happens in; returns the log, and
    the memory that it takes [bytes]."""

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        writes = event == "open" and isinstance(arguments[2], int) and arguments[2] & os.O_WRONLY
        if event in FORBIDDEN or writes:
            os.write(2, f"forbidden: {event} {arguments}\n".encode())
            os._exit(99)

    sys.addaudithook(hook)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    log = read_log(path, robot)
    growth = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return log, growth * 1024


@pytest.fixture(scope="module")
def telemetry(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A telemetry log."""
    said = telemetry_of(sub_motion(600, 0.02))
    return write_telemetry(tmp_path_factory.mktemp("telemetry") / "dive.tlog", said)


@pytest.fixture(scope="module")
def bag(px4: Dive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of ROS 2 in one file of MCAP."""
    short = Dive(px4.robot, px4.path, px4.time[:600], px4.demand[:600], px4.given[:600])
    return next(bag_of(short, tmp_path_factory.mktemp("bag") / "bag").glob("*.mcap"))


def mutated(content: bytes, seed: int) -> bytes:
    """A log with random damage: wrong bytes, pieces cut out, doubled or made of one byte, numbers as
    large as their bytes allow, and an end too early."""
    rng = np.random.default_rng(seed)
    octets = bytearray(content[: rng.integers(64, len(content))])
    for _ in range(1 + seed):
        place = int(rng.integers(8, len(octets)))
        size = int(rng.integers(1, 200))
        kind = rng.integers(5)
        if kind == 0:
            octets[place] = rng.integers(256)
        elif kind == 1:
            del octets[place : place + size]
        elif kind == 2:
            octets[place:place] = octets[place : place + size]
        elif kind == 3:
            octets[place : place + 8] = b"\xff" * 8
        else:
            octets[place : place + size] = bytes([rng.integers(256)]) * size
        if len(octets) <= 64:
            break
    return bytes(octets)


@pytest.mark.parametrize("kind", ["px4", "sub", "telemetry", "bag"])
def test_damaged_logs_end_in_a_judgement_or_a_sentence(
    kind: str,
    px4: Dive,
    request: pytest.FixtureRequest,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    made: Any = request.getfixturevalue(kind)
    source: Path = made.path if isinstance(made, Dive) else made
    content = source.read_bytes()[:60_000]
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    n_judged = 0
    for seed in range(15):
        path = folder / f"log{source.suffix}"
        path.write_bytes(mutated(content, seed))
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begin = time.process_time()
        try:
            log, memory = in_worker(watched_read, path, px4.robot)
            judge(log, improve=False)
            assert memory < MOST_BYTES
            n_judged += 1
        except FinlabError as error:
            assert len(str(error)) < 1000 and "\n" not in str(error)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        child_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        assert child_s + time.process_time() - begin < MOST_S + 0.5
        path.unlink()
    assert not [*folder.iterdir()]
    assert capfd.readouterr().err == ""
    assert n_judged > 0 or kind == "bag"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("all-heads.tlog", (b"\0\5\xb0\0\0\0\0\0\xfd" + b"\xff" * 9) * 20_000),
        ("one-byte.tlog", b"\0\5\xb0\0\0\0\0\0" + b"\xfd" * 300_000),
        ("no-frame.tlog", b"\0\5\xb0\0\0\0\0\0" + b"\xfe" + b"\0" * 300_000),
        ("formats.bin", (b"\xa3\x95\x80" + b"\x80" * 86) * 4_000),
        ("heads.ulg", b"ULog\x01\x125" + b"\x01" + b"\0" * 8 + b"\xff\xffD" * 100_000),
        ("zeros.mcap", b"\x89MCAP0\r\n" + b"\0" * 300_000),
    ],
)
def test_logs_made_to_take_long_end_in_a_sentence(
    name: str, content: bytes, px4: Dive, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with pytest.raises(FinlabError, match=f"{name}|takes too much time"):
        in_worker(watched_read, path, px4.robot)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime - before.ru_utime < MOST_S
