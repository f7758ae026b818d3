"""Where another distribution owns the name `finlab`, the first start says so, and no other one."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from finlab import assets
from finlab.assets import DISTRIBUTION, other_distribution, warning_of_other_distribution

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def both(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An environment with both distributions, and a user's cache that is empty."""
    folder = tmp_path / "site-packages"
    for name in ("finlab_marine-0.1.0.dist-info", "finlab-1.5.0.dist-info", "numpy"):
        (folder / name).mkdir(parents=True)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(assets.sys, "path", [str(tmp_path / "nowhere"), str(folder)])
    return folder


def test_the_other_distribution_is_found_by_its_name_alone(both: Path) -> None:
    assert other_distribution() == str(both / "finlab-1.5.0.dist-info")
    (both / "finlab-1.5.0.dist-info").rmdir()
    assert other_distribution() is None
    (both / "finlab-0.3.egg-info").touch()
    assert other_distribution([str(both)]) == str(both / "finlab-0.3.egg-info")


def test_it_is_said_once(both: Path) -> None:
    said = warning_of_other_distribution()
    assert said is not None and "finlab-1.5.0.dist-info" in said
    assert f"script {DISTRIBUTION}" in said and "\n" not in said
    assert warning_of_other_distribution() is None
    (both / "finlab-1.5.0.dist-info").rename(both / "finlab-1.6.0.dist-info")
    assert warning_of_other_distribution() is not None


def test_where_no_cache_can_be_written_it_is_said_again(
    both: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert warning_of_other_distribution() is not None
    assert warning_of_other_distribution() is not None


def test_a_look_takes_no_time(both: Path) -> None:
    for k in range(1000):
        (both / f"package_{k}-1.0.dist-info").mkdir()
    begin = time.thread_time()
    for _ in range(10):
        other_distribution()
    assert time.thread_time() - begin < 0.1


def test_the_first_start_says_it_on_stderr(tmp_path: Path) -> None:
    folder = tmp_path / "packages"
    (folder / "finlab-1.5.0.dist-info").mkdir(parents=True)
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(folder)]),
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
    }
    runs = []
    for _ in range(2):
        command = [sys.executable, "-m", "finlab", "--version"]
        run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        runs.append(run)
    assert runs[0].stderr.startswith("finlab: ") and "another distribution" in runs[0].stderr
    assert runs[1].stderr == "" and runs[0].stdout == runs[1].stdout
