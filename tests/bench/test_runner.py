"""Whatever a method does, each question ends in a command or in a failure that is counted."""

import time
from pathlib import Path

import numpy as np
import pytest

from finlab.bench.methods import bench_method
from finlab.bench.metrics import figures
from finlab.bench.problems import Problems
from finlab.bench.runner import Answers, run_method
from finlab.errors import DataError
from finlab.physics import plant_of
from tests.any_robot import AnyRobot

METHODS = Path(__file__).with_name("methods.py")


def run(name: str, problems: Problems, limit_s: float = 5.0) -> Answers:
    return run_method(bench_method(f"{METHODS}:{name}"), problems, limit_s)


@pytest.mark.parametrize(
    ("name", "kind", "words"),
    [
        ("raises", "exception", "RuntimeError: no idea"),
        ("is_empty", "malformed", "expected (1, 4, 3), got (0,)"),
        ("says_nan", "not finite", "NaN"),
        ("leaves_limits", "out of limits", "amplitude of front_right by 0.01"),
    ],
)
def test_failures_are_counted(name: str, kind: str, words: str, few: Problems) -> None:
    found = figures(few, run(name, few))
    assert found["failures"] == {kind: found["summary"]["calls"]}
    assert found["summary"]["failed"] == 1.0 and found["summary"]["solved"] < 0.2
    assert any(words in example for example in found["examples"])


def test_late_answers_are_failures(few: Problems) -> None:
    found = figures(few, run("is_slow", few, limit_s=0.05))
    assert found["failures"] == {"late": found["summary"]["calls"]}
    assert found["summary"]["failed"] == 1.0 and found["summary"]["p50_ms"] >= 60.0


def test_the_processors_time_leaves_waiting_out(few: Problems) -> None:
    method = bench_method(f"{METHODS}:is_slow")
    found = figures(few, run_method(method, few, 0.05, clock=time.process_time))
    assert found["summary"]["failed"] == 0.0 and found["summary"]["p50_ms"] < 20.0


def test_what_a_method_prints_is_no_answer(few: Problems, capsys: pytest.CaptureFixture[str]) -> None:
    for answer in run("rests", few).targets:
        assert answer.command is not None and np.array_equal(answer.command, few.layout(0).lower)
    shown = capsys.readouterr()
    assert not shown.out and "an answer?" in shown.err


def test_previous_command_comes_back_and_angles_go_round(few: Problems) -> None:
    noisy = figures(few, run("turns_on", few))["paths"]["noisy"]
    assert noisy["turn"] == pytest.approx(0.1)


def test_search_is_judged_by_the_plant(few: Problems) -> None:
    answers = run_method(bench_method("dual"), few, 5.0)
    plant, allocator = plant_of(few.layout(0)), AnyRobot()
    for answer, wrench, kind in zip(answers.targets, few.targets.wrench, few.targets.kind, strict=True):
        assert answer.command is not None
        if kind == 0:
            assert np.allclose(plant.wrench(answer.command), wrench, atol=1e-5)
            same = allocator.allocate(few.layout(0), wrench).power
            assert plant.power(answer.command).sum() == pytest.approx(same, rel=1e-3)
    summary = figures(few, answers)["summary"]
    assert summary["solved"] == 1.0 and summary["power"] == pytest.approx(1.0, abs=2e-3)
    assert summary["beyond"] < 1e-4 and summary["failed"] == 0.0


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (f"{METHODS}:wants_more", "got 'weather'"),
        (f"{METHODS}:nothing", "holds no function 'nothing'"),
        ("nowhere.py:f", "nowhere.py: cannot be loaded"),
        ("no.such.module:f", "cannot be loaded: ModuleNotFoundError"),
    ],
)
def test_a_method_that_cannot_be_loaded_is_an_error(name: str, words: str) -> None:
    with pytest.raises(DataError, match=words):
        bench_method(name)
