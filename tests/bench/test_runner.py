"""Whatever a method does, each question ends in a command or in a failure that is counted."""

import sys
from pathlib import Path

import numpy as np
import pytest

from finlab.bench.metrics import figures
from finlab.bench.problems import Problems
from finlab.bench.runner import Answers, BenchMethod, run_method
from finlab.errors import AllocationError
from finlab.physics import plant_of
from tests.any_robot import AnyRobot

METHODS = Path(__file__).with_name("methods.py")


def run(name: str, problems: Problems, limit_s: float = 5.0) -> Answers:
    return run_method(BenchMethod.of(f"{METHODS}:{name}"), problems, limit_s)


@pytest.mark.parametrize(
    ("name", "kind", "words"),
    [
        ("raises", "exception", "RuntimeError: no idea"),
        ("ends", "died", "no word on stderr"),
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
    # Not all of them: on a busy machine the process is lost now and then, and a new one has time to start.
    assert found["failures"]["late"] > 0.8 * found["summary"]["calls"]
    assert found["summary"]["failed"] > 0.9 and found["summary"]["p50_ms"] >= 60.0


def test_the_processors_time_leaves_waiting_out(few: Problems, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finlab.bench.runner.PATIENCE", 1000.0)  # other work may hold a call up for long
    method = BenchMethod.of(f"{METHODS}:is_slow", cpu=True)
    found = figures(few, run_method(method, few, 0.05))
    assert found["summary"]["failed"] == 0.0 and found["summary"]["p50_ms"] < 20.0


def test_a_method_that_hangs_is_ended(few: Problems, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finlab.bench.runner.FIRST_S", 1.0)
    found = figures(few, run("sleeps", few, limit_s=0.1))
    assert found["summary"]["failed"] == 1.0 and found["failures"]["died"] > 20


def test_a_method_that_ends_once_is_started_again(few: Problems) -> None:
    answers = run("ends_at_eighth", few)
    failed = [answer for answer in answers.targets if answer.failure is not None]
    assert 1 <= len(failed) <= len(answers.targets) / 2


def test_what_a_method_prints_is_no_answer(few: Problems) -> None:
    for answer in run("rests", few).targets:
        assert answer.command is not None and np.array_equal(answer.command, few.layout(0).lower)


def test_previous_command_comes_back_and_angles_go_round(few: Problems) -> None:
    noisy = figures(few, run("turns_on", few))["paths"]["noisy"]
    assert noisy["turn"] == pytest.approx(0.1)


def test_search_is_judged_by_the_plant(few: Problems) -> None:
    answers = run_method(BenchMethod.of("dual"), few, 5.0)
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
def test_a_method_that_cannot_be_loaded_is_an_error(name: str, words: str, few: Problems) -> None:
    with pytest.raises(AllocationError, match="(?s)" + words.replace("(", r"\(")):
        run_method(BenchMethod.of(name), few)


@pytest.mark.parametrize(
    ("program", "kind"),
    [
        ("import sys\nfor line in sys.stdin: print('[1, 2', flush=True)", "malformed"),
        ("import sys\nfor line in sys.stdin: print('{\"id\": 0}', flush=True)", "malformed"),
        ("import sys\nfor line in sys.stdin: print(line.strip(), flush=True)", "exception"),
        ("import sys\nsys.stdin.close()\nprint(flush=True)", "malformed"),
        ("raise SystemExit('out of service')", "died"),
    ],
)
def test_programs_that_speak_nonsense(program: str, kind: str, few: Problems) -> None:
    found = figures(few, run_method(BenchMethod("it", (sys.executable, "-c", program)), few, 5.0))
    assert found["summary"]["failed"] == 1.0 and kind in found["failures"]
