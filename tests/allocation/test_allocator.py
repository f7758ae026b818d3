"""What every method has in common: problems are checked, lost fins left out, answers judge
themselves."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

import finlab
from finlab.actuators.law import Blade
from finlab.allocation import METHODS, Allocation, Allocator, Candidates, Solution, allocator
from finlab.allocation.method import LeastErrorMethod
from finlab.allocation.methods import method_class
from finlab.cli.robot_verbs import allocate
from finlab.errors import AllocationError, CommandError, LayoutError
from finlab.layout import Fin, Layout, load_layout
from tests.allocator_cache import AllocatorCache

ROBOT = Layout(
    "robot",
    (
        Fin("bow", (0.2, 0.0, 0.0), math.pi / 2),
        Fin("left", (0.0, 0.15, 0.0), 0.0),
        Fin("stern", (-0.2, 0.0, 0.05), -1.0),
    ),
)
"""A robot of few fins, for which the method `Drawn` answers."""
SURGE = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
"""A wrench straight ahead [N, N m]."""


class Drawn(LeastErrorMethod):
    """Answers with commands drawn from seed and target; remembers what it was asked."""

    name = "drawn"
    asked: ClassVar[list[tuple[Layout, np.ndarray | None]]] = []

    def _solve(self, targets: np.ndarray, *, seed: int, previous: np.ndarray | None) -> Solution:
        self.asked.append((self.layout, previous))
        seeds = [
            np.random.default_rng([seed, *np.abs(t).view(np.uint64).tolist()]) for t in targets
        ]
        fraction = np.array([rng.uniform(size=(self.layout.n, 3)) for rng in seeds])
        command = np.array([0.05, 0.1, -3.0]) + fraction * [0.5, 1.9, 6.0]
        few = Candidates(command, targets * 0, np.zeros(1), np.zeros(1), np.zeros(1), ("drawn",))
        return Solution(command, wrench=0.5 * targets, candidates=lambda: few)


@pytest.fixture
def method() -> AllocatorCache:
    """The method `Drawn`, which has not been asked yet."""
    Drawn.asked.clear()
    return AllocatorCache(Drawn)


@pytest.mark.parametrize(
    ("wrench", "sentence"),
    [
        ([math.nan] * 6, "wrench: Fx must be a number of at most 1e+12 in size, got nan"),
        (
            [1, 0, 0, 0, 0, -math.inf],
            "Tz must be a number of at most 1e+12 in size, got -inf; an axis",
        ),
        (
            [1, 2e12, 0, 0, 0, 0],
            "Fy must be a number of at most 1e+12 in size, got 2000000000000.0",
        ),
        ([10**400, 0, 0, 0, 0, 0], "wrench: expected six numbers"),
        (
            [1, 0, 0],
            "wrench: expected six numbers [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m, got an array of "
            "shape (3,)",
        ),
        ([], "got an array of shape (0,)"),
        (1.0, "got an array of shape ()"),
        ([SURGE, SURGE], "got an array of shape (2, 6)"),
        (
            "forward",
            "wrench: expected six numbers [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m, got 'forward'",
        ),
        (["a", 0, 0, 0, 0, 0], "wrench: expected six numbers"),
        ([[1, 2], 3, 4, 5, 6, 7], "wrench: expected six numbers"),
        ({"Fx": 1}, "wrench: expected six numbers"),
    ],
)
def test_refuses_a_wrench_that_is_none(
    method: AllocatorCache, wrench: object, sentence: str
) -> None:
    with pytest.raises(CommandError) as caught:
        method.allocate(ROBOT, wrench)  # type: ignore[arg-type]
    assert sentence in str(caught.value) and "\n" not in str(caught.value)
    assert Drawn.asked == []


@pytest.mark.parametrize("wrenches", [SURGE, [[1.0, 2.0]], [[SURGE]], [[math.nan] * 6]])
def test_refuses_many_wrenches_that_are_none(method: AllocatorCache, wrenches: object) -> None:
    with pytest.raises(CommandError, match="wrench: "):
        method.allocate_batch(ROBOT, wrenches)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "kind", "sentence"),
    [
        (
            {"lost": ["bow", "keel"]},
            LayoutError,
            "robot has no fin 'keel', it has bow, left, stern",
        ),
        ({"lost": ["bow", "left", "stern"]}, LayoutError, "no fin left once all are lost"),
        ({"lost": "bow"}, AllocationError, r"expected a list of names, got the text 'bow'; write"),
        (
            {"previous": np.zeros((4, 3))},
            CommandError,
            r"previous: expected a command of shape \(3, 3\) for",
        ),
        ({"previous": "rest"}, CommandError, "previous: "),
        ({"previous": [[math.inf] * 3] * 3}, CommandError, "previous: "),
    ],
)
def test_refuses_what_is_no_question(
    method: AllocatorCache, options: dict[str, object], kind: type[Exception], sentence: str
) -> None:
    with pytest.raises(kind, match=sentence):
        method.allocate(ROBOT, SURGE, **options)  # type: ignore[arg-type]


def test_failed_fins_leave_the_graph_and_come_back_as_nan(method: AllocatorCache) -> None:
    result = method.allocate(ROBOT, SURGE, lost=["left"])
    assert Drawn.asked[0][0].names == ("bow", "stern")
    assert result.names == ("bow", "left", "stern") and result.lost == ("left",)
    assert np.isnan(result.command[1]).all()
    expected = method.allocate(ROBOT.without(["left"]), SURGE).command
    np.testing.assert_array_equal(result.command[[0, 2]], expected)
    assert result.candidates is not None
    assert np.isnan(result.candidates.command[:, 1]).all()
    np.testing.assert_array_equal(result.candidates.command[0, [0, 2]], expected)
    batch = method.allocate_batch(ROBOT, [SURGE, SURGE], lost=["left"])
    assert batch.command.shape == (2, 3, 3) and np.isnan(batch.command[:, 1]).all()


def test_previous_commands_reach_the_method_without_the_failed_fins(method: AllocatorCache) -> None:
    previous = np.arange(9.0).reshape(3, 3)
    previous[0] = np.nan
    method.allocate(ROBOT, SURGE, lost=["bow"], previous=previous)
    np.testing.assert_array_equal(Drawn.asked[0][1], [[3, 4, 5], [6, 7, 8]])


def test_the_same_seed_gives_the_same_answer(method: AllocatorCache) -> None:
    first, second, other = (method.allocate(ROBOT, SURGE, seed=seed).command for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(first, other)


def test_many_targets_get_the_answers_of_each(method: AllocatorCache) -> None:
    targets = np.random.default_rng(0).normal(size=(4, 6))
    batch = method.allocate_batch(ROBOT, targets, seed=2)
    for row, target in enumerate(targets):
        single = method.allocate(ROBOT, target, seed=2)
        np.testing.assert_array_equal(batch.command[row], single.command)
        np.testing.assert_array_equal(batch.wrench_expected[row], single.wrench_expected)  # type: ignore[index]
    assert batch.solve_ms.shape == (4,)


def test_the_target_is_a_copy(method: AllocatorCache) -> None:
    target = np.array(SURGE)
    result = method.allocate(ROBOT, target)
    target[0] = 99.0
    assert result.target[0] == 1.0


def test_energy_counts_the_working_fins(method: AllocatorCache) -> None:
    result = method.allocate(ROBOT, SURGE, lost=["left"])
    whole = 0.0
    for amplitude, frequency, direction in result.command[[0, 2]] / [0.6, 2.1, math.pi]:
        whole += amplitude**2 + frequency**2 + 0.1 * direction**2 + amplitude * frequency
    assert result.effort == pytest.approx(whole)
    working = result.command[[0, 2]]
    assert result.power == pytest.approx(Blade().power(working[:, 0], working[:, 1]).sum())
    batch = method.allocate_batch(ROBOT, [SURGE], lost=["left"])
    np.testing.assert_allclose([batch.power[0], batch.effort[0]], [result.power, result.effort])


def test_a_method_without_candidates_says_so(method: AllocatorCache) -> None:
    result: Allocation = method.allocate(ROBOT, SURGE)
    assert result.samples is None
    assert result.candidates is not None and result.candidates.source == ("drawn",)


def test_unknown_methods_are_refused_with_the_names_that_exist() -> None:
    with pytest.raises(AllocationError) as caught:
        AllocatorCache("magic")
    assert str(caught.value) == f"method: expected one of {', '.join(METHODS)}, got 'magic'"


def test_the_command_line_names_every_method() -> None:
    words = str(allocate.__doc__)
    assert all(name in words for name in METHODS)


def test_the_method_comes_first_and_the_checkpoint_by_keyword() -> None:
    for name in ("analytic", "qp"):
        assert AllocatorCache(name).name == name
    with pytest.raises(TypeError):
        Allocator(ROBOT, "dual", "default")  # type: ignore[misc]
    with pytest.raises(AllocationError, match="checkpoint: method 'dual' has no networks, only"):
        Allocator(ROBOT, checkpoint="default")
    with pytest.raises(
        AllocationError, match="layout: expected a Layout, got 'A'; read a file with"
    ):
        Allocator("A")  # type: ignore[arg-type]


def test_the_time_is_that_of_the_solver_shared_by_its_targets(
    method: AllocatorCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    def clock(*before: float) -> SimpleNamespace:
        return SimpleNamespace(perf_counter=iter([*before, 10.0, 40.0]).__next__)

    method.on(ROBOT)
    # A single question looks first whether it is prepared, which takes no time of the solver.
    monkeypatch.setattr(allocator, "time", clock(5.0))
    assert method.allocate(ROBOT, SURGE).solve_ms == 30_000.0
    monkeypatch.setattr(allocator, "time", clock())
    assert method.allocate_batch(ROBOT, [SURGE] * 3).solve_ms.tolist() == [10_000.0] * 3
    monkeypatch.setattr(allocator, "time", clock())
    assert method.allocate_batch(ROBOT, np.empty((0, 6))).solve_ms.tolist() == []


@pytest.mark.parametrize("method", [name for name in METHODS if "fins" in method_class(name).takes])
def test_a_thruster_is_named_with_its_type(method: str) -> None:
    with pytest.raises(
        LayoutError, match=f"method {method} works for .* 'lift_left' .* is of type thruster"
    ):
        finlab.Allocator(load_layout("turtle_hybrid"), method)


def test_the_papers_method_names_the_fin_whose_shaft_it_does_not_know() -> None:
    layout = load_layout("A")
    tail = Fin("tail", (-0.4, 0.0, 0.0), shaft=(0.0, 0.0, 1.0), zero=(1.0, 0.0, 0.0))
    with pytest.raises(LayoutError, match="method paper works for .* 'tail' .* a shaft of its own"):
        finlab.Allocator(replace(layout, actuators=(*layout.fins, tail)), "paper")


@pytest.mark.parametrize("method", ["mdn", "qp", "sqp", "paper_sqp", "analytic", "fixed_frequency"])
def test_other_methods_take_shafts_in_any_direction(method: str) -> None:
    layout = load_layout("A")
    tail = Fin("tail", (-0.4, 0.0, 0.0), shaft=(0.0, 0.0, 1.0), zero=(1.0, 0.0, 0.0))
    allocator = finlab.Allocator(replace(layout, actuators=(*layout.fins, tail)), method)
    assert allocator.allocate([0.5, 0.3, 0.2, 0.0, 0.0, 0.1]).err_norm < 0.05
