"""Hostile robots: no method fails on a few of them, and each kind of fault is seen."""

import time
import warnings
from collections.abc import Callable

import numpy as np
import pytest

from finlab.allocation import Allocator, load_allocator
from finlab.allocation.solution import Solution
from finlab.errors import AllocationError
from finlab.evaluation.experiments.fuzz import FuzzCount, fuzz_methods, fuzz_report
from finlab.evaluation.hostile_cases import hostile_robot, hostile_targets
from finlab.inference.normalization import Normalization
from finlab.layout import Layout

QUICK = ("search", "mdn", "paper", "qp", "analytic", "sqp")


@pytest.mark.parametrize("method", QUICK)
def test_quick_methods_survive(method: str) -> None:
    (count,) = fuzz_methods({method: load_allocator(method)}, n_robots=8, n_targets=12, n_single=4, seed=1)
    assert count.clean, fuzz_report([count])
    assert count.targets == 8 * (12 + 4) and count.calls == 8 * (1 + 4) and count.refused == 0


@pytest.mark.parametrize("method", ["ipopt"])
def test_slow_methods_survive(method: str) -> None:
    if method == "ipopt":
        pytest.importorskip("casadi", reason="method ipopt is an optional extra")
    allocator = load_allocator(method, n_starts=1)
    (count,) = fuzz_methods({method: allocator}, n_robots=3, n_targets=2, n_single=2, seed=1)
    assert count.clean, fuzz_report([count])


class Faulty(Allocator):
    """Answers with the lower limits after a fault was added."""

    name = "faulty"
    normalization = Normalization(np.zeros(6), np.ones(6))

    def __init__(self, fault: Callable[[np.ndarray], None]) -> None:
        self.fault = fault

    def _solve(
        self, layout: Layout, targets: np.ndarray, *, seed: int, previous: np.ndarray | None
    ) -> Solution:
        command = np.tile(layout.lower, (len(targets), 1, 1))
        self.fault(command)
        return Solution(command)


def not_finite(command: np.ndarray) -> None:
    command[0] = np.nan


def outside(command: np.ndarray) -> None:
    command[0, 0, 2] -= 1e-12


def failing(command: np.ndarray) -> None:
    raise ValueError("not ours")


def refusing(command: np.ndarray) -> None:
    raise AllocationError("ours")


def warning(command: np.ndarray) -> None:
    warnings.warn("careful", RuntimeWarning, stacklevel=2)


def late(command: np.ndarray) -> None:
    start = time.process_time()
    while time.process_time() < start + 1.01:
        sum(range(1000))


@pytest.mark.parametrize(
    ("fault", "field"),
    [
        (not_finite, "nan"),
        (outside, "broken_limits"),
        (failing, "foreign_errors"),
        (warning, "warnings"),
        (late, "late"),
    ],
)
def test_every_fault_is_counted(fault: Callable[[np.ndarray], None], field: str) -> None:
    (count,) = fuzz_methods({"faulty": Faulty(fault)}, n_robots=1, n_targets=2, n_single=1, seed=3)
    assert getattr(count, field) > 0 and not count.clean
    faults = {"nan", "broken_limits", "foreign_errors", "warnings", "late"} - {field}
    assert all(getattr(count, other) == 0 for other in faults)
    assert "robot 'hostile 0'" in fuzz_report([count])


def test_a_refusal_is_no_fault() -> None:
    (count,) = fuzz_methods({"faulty": Faulty(refusing)}, n_robots=1, n_targets=2, n_single=1)
    assert count.clean and count.refused == count.calls == 2 and count.targets == 0


def test_robots_are_drawn_again_from_their_numbers() -> None:
    assert hostile_robot(3, 5) == hostile_robot(3, 5) != hostile_robot(4, 5)
    layout = hostile_robot(3, 5)
    np.testing.assert_array_equal(hostile_targets(layout, 12, 3, 5), hostile_targets(layout, 12, 3, 5))


def test_robots_are_of_every_kind() -> None:
    fins = [fin for number in range(200) for fin in hostile_robot(number, 0).fins]
    limits = [fin.limits for fin in fins]
    for ends in (
        [x.amplitude for x in limits],
        [x.frequency for x in limits],
        [x.zero_direction for x in limits],
    ):
        assert any(low == high for low, high in ends)
    assert any(fin.position == (0.0, 0.0, 0.0) for fin in fins)
    assert any(max(map(abs, fin.position)) > 3.0 for fin in fins)
    assert {fin.model.type for fin in fins} == {"drag", "lighthill", "soft"}
    assert any(x.frequency[1] == 20.0 for x in limits) and any(x.frequency[1] < 1e-3 for x in limits)
    assert {hostile_robot(number, 0).n_fins for number in range(200)} >= {1, 2, 16}


def test_the_report_tells_of_no_faults_where_there_are_none() -> None:
    assert "first faults" not in fuzz_report([FuzzCount("clean")])
