"""Levenberg-Marquardt on commands: never worse, never outside the limits, never NaN."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from finlab import Azimuth, PowerLaw
from finlab.allocation.levenberg_marquardt import RIDGE, CommandProblem, _smallest_change, refine
from finlab.allocation.rates import Rates
from finlab.interaction.jets import Jets
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.physics import plant_of
from finlab.research.random_layouts import random_jet_robot, random_layout
from tests.allocator_cache import AllocatorCache


def problem_of(search: AllocatorCache, layout: Layout) -> CommandProblem:
    """The problem that Levenberg-Marquardt solves for a robot."""
    return CommandProblem.of(plant_of(layout), search.normalization.std)


def random_commands(problem: CommandProblem, rows: int, seed: int) -> np.ndarray:
    """Commands (rows, n, 3) within the limits."""
    fraction = np.random.default_rng(seed).uniform(size=(rows, *problem.lower.shape))
    return np.asarray(problem.lower + fraction * (problem.upper - problem.lower))


def wrench_error(problem: CommandProblem, target: np.ndarray, command: np.ndarray) -> np.ndarray:
    """Length (rows,) of what commands leave of the targets, in units of the wrench scale."""
    return np.asarray(np.linalg.norm(target - problem.wrench(command), axis=-1))


def is_within_limits(problem: CommandProblem, command: np.ndarray) -> bool:
    """Whether commands are within the limits."""
    return bool((command >= problem.lower).all() and (command <= problem.upper).all())


SHARED_POSITION = (0.1, 0.05, 0.0)
"""Position of two fins that stand at one place [m]."""
HOSTILE_LAYOUTS = {
    "one fin": Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),)),
    "two at one place": Layout(
        "twins", (Fin("a", SHARED_POSITION, 0.3), Fin("b", SHARED_POSITION, 0.3))
    ),
    "all parallel": Layout("rake", tuple(Fin(f"f{i}", (0.1 * i, 0.0, 0.0), 0.5) for i in range(3))),
    "no width": Layout(
        "stiff",
        (
            Fin("a", (0.1, 0.0, 0.0), 0.0, Limits((0.3, 0.3), (1.0, 1.0), (0.5, 0.5))),
            Fin("b", (-0.1, 0.0, 0.0), 1.0, Limits((0.05, 0.6), (2.0, 2.0), (-1.0, 1.0))),
        ),
    ),
    "may rest": Layout(
        "rest",
        (Fin("a", SHARED_POSITION, 0.0, Limits((0.0, 0.6), (0.0, 2.1))), Fin("b", (0, 0, 0), 2.0)),
    ),
}
"""Robots whose Jacobian is singular somewhere, or whose ranges have no width."""


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_never_makes_it_worse_and_mostly_much_better(limits: str, search: AllocatorCache) -> None:
    before = []
    after = []
    for seed in range(5000, 5010):
        layout = random_layout(np.random.default_rng(seed), limits=limits)  # type: ignore[arg-type]
        problem = problem_of(search, layout)
        target = problem.wrench(random_commands(problem, 20, 1))
        start = random_commands(problem, 20, 2)
        refined = refine(problem, target, start, 30)
        assert is_within_limits(problem, refined.command)
        before.append(wrench_error(problem, target, start))
        after.append(wrench_error(problem, target, refined.command))
        np.testing.assert_allclose(refined.error, after[-1], atol=1e-9)
        np.testing.assert_allclose(refined.wrench, problem.wrench(refined.command), atol=1e-9)
    first = np.concatenate(before)
    last = np.concatenate(after)
    assert (last <= first + 1e-12).all()
    assert np.median(first) > 0.5 and (last < 0.05 * first).mean() > 0.7


def test_finds_the_way_back_from_nearby(search: AllocatorCache) -> None:
    problem = problem_of(search, random_layout(np.random.default_rng(5003), n_fins=5))
    middle = problem.lower + (0.3 + 0.4 * np.random.default_rng(0).uniform(size=(30, 5, 3))) * (
        problem.upper - problem.lower
    )
    start = problem.feasible(middle + 0.02 * np.random.default_rng(1).normal(size=middle.shape))
    target = problem.wrench(middle)
    assert wrench_error(problem, target, start).min() > 1e-3
    refined = refine(problem, target, start, 12)
    assert np.quantile(refined.error, 0.9) < 1e-7


STRONG_FINS = {
    "drag": (FinModelSpec(), Limits((0.0, 1.5), (0.0, 20.0))),
    "soft": (FinModelSpec("soft", (("k", 20.0),)), Limits((1.5, 1.5), (0.1, 20.0), (0.3, 0.3))),
}
"""Models of fins with limits at which forces grow large."""


@pytest.mark.parametrize(("model", "limits"), STRONG_FINS.values(), ids=list(STRONG_FINS))
def test_strong_fins_on_long_levers_give_numbers(
    model: FinModelSpec, limits: Limits, search: AllocatorCache
) -> None:
    """Their derivatives are large and of too low a rank: without a relative ridge a step is no
    number.

    The force of soft fins at their upper limits is nothing beside their largest.
    """
    layout = Layout(
        "far", tuple(Fin(f"f{i}", (8.0, 5.0, 1.0), 0.3 + i, limits, model) for i in range(3))
    )
    problem = problem_of(search, layout)
    target = 1e3 * np.random.default_rng(0).normal(size=(200, 6))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refined = refine(problem, target, random_commands(problem, 200, 1), 40)
    assert np.isfinite(refined.command).all() and np.isfinite(refined.error).all()


def test_a_start_a_whole_turn_off_is_the_same_start(search: AllocatorCache) -> None:
    limits = Limits(zero_direction=(0.0, 2.0 * math.pi))
    problem = problem_of(search, Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0, limits),)))
    start = np.array([[[0.4, 1.5, -1.0]]])
    refined = refine(problem, problem.wrench(start), start, 0)
    np.testing.assert_allclose(refined.command[0, 0], [0.4, 1.5, 2.0 * math.pi - 1.0])
    assert refined.error[0] < 1e-9


def test_commands_without_room_stay_bit_for_bit(search: AllocatorCache) -> None:
    problem = problem_of(search, HOSTILE_LAYOUTS["no width"])
    refined = refine(
        problem, np.random.default_rng(0).normal(size=(10, 6)), random_commands(problem, 10, 1), 10
    )
    assert (refined.command[:, 0] == [0.3, 1.0, 0.5]).all()
    assert (refined.command[:, 1, 1] == 2.0).all()
    assert np.ptp(refined.command[:, 1, 0]) > 0.01  # what has room moves


def test_rows_do_not_see_each_other(search: AllocatorCache) -> None:
    problem = problem_of(search, random_layout(np.random.default_rng(5004), n_fins=4))
    target = problem.wrench(random_commands(problem, 6, 1))
    start = random_commands(problem, 6, 2)
    together = refine(problem, target, start, 8)
    for row in range(6):
        alone = refine(problem, target[row : row + 1], start[row : row + 1], 8)
        np.testing.assert_allclose(together.error[row], alone.error[0], rtol=1e-3, atol=1e-6)


def test_a_direction_may_cross_the_seam(search: AllocatorCache) -> None:
    # The answer lies just across +-pi from the start, and nearly a full turn away the other way
    # round.
    problem = problem_of(search, Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),)))
    start = np.array([[[0.4, 1.5, math.pi - 0.1]]])
    target = problem.wrench(np.array([[[0.4, 1.5, -math.pi + 0.1]]]))
    refined = refine(problem, target, start, 15)
    assert refined.error[0] < 1e-6
    assert refined.command[0, 0, 2] == pytest.approx(-math.pi + 0.1, abs=1e-3)


POD = Azimuth(
    name="pod",
    position=(0.0, 0.0, 0.0),
    turn_axis=(0.0, 0.0, 1.0),
    zero=(1.0, 0.0, 0.0),
    force=(0.0, 40.0),
    model=PowerLaw(1.0),
)
"""A pod, whose command is an angle and a force."""


@pytest.mark.parametrize(
    ("start", "answer"),
    [(math.pi - 0.1, -math.pi + 0.1), (math.pi, -math.pi + 0.3), (-math.pi, math.pi - 0.3)],
)
def test_a_pod_that_turns_all_round_has_no_limit_at_the_seam(start: float, answer: float) -> None:
    problem = CommandProblem.of(plant_of(Layout("one", (POD,))), np.full(6, 40.0))
    target = problem.wrench(np.array([[[answer, 20.0, 0.0]]]))
    refined = refine(problem, target, np.array([[[start, 20.0, 0.0]]]), 15)
    assert refined.error[0] < 1e-9
    assert refined.command[0, 0] == pytest.approx([answer, 20.0, 0.0], abs=1e-6)


def test_a_pod_follows_its_angle_across_the_seam_in_a_tick() -> None:
    plant = plant_of(Layout("one", (POD,)))
    box = Rates(plant, np.array([[0.2, np.inf, np.inf]])).box(
        np.array([[math.pi - 0.1, 20.0, 0.0]])
    )
    problem = CommandProblem.of(plant, np.full(6, 40.0)).in_tick(box)
    target = problem.wrench(np.array([[[-math.pi + 0.05, 20.0, 0.0]]]))
    refined = refine(problem, target, np.array([[[-math.pi + 0.02, 20.0, 0.0]]]), 15)
    assert refined.error[0] < 1e-9
    assert refined.command[0, 0, 0] == pytest.approx(math.pi + 0.05, abs=1e-6)
    beyond = problem.wrench(np.array([[[-math.pi + 0.5, 20.0, 0.0]]]))
    held = refine(problem, beyond, refined.command, 15)
    assert held.command[0, 0, 0] == pytest.approx(math.pi + 0.1, abs=1e-9)  # the end of the rate


FINS_WITH_ARCS = (
    Fin("full", (0.1, 0.0, 0.0), 0.0, Limits((0.05, 0.6), (0.1, 2.1))),
    Fin("arc", (0.0, 0.1, 0.0), 0.0, Limits((0.1, 0.5), (0.2, 1.0), (0.5, 2.0))),
    Fin("narrow", (0.0, 0.0, 0.1), 0.0, Limits((0.3, 0.3), (0.7, 0.7), (-2.5, -2.0))),
)
"""Fins of which one beats in any direction, one in an arc and one at a single command."""
PROBLEM_OF_ARCS = CommandProblem.of(plant_of(Layout("arcs", FINS_WITH_ARCS)), np.ones(6))
"""The problem of a robot of these fins, asked for its limits alone."""


@pytest.mark.parametrize(
    ("fin", "direction", "expected"),
    [
        (0, 3.5, 3.5 - 2 * math.pi),  # a full circle: only the turn changes
        (0, -10.0, -10.0 + 4 * math.pi),
        (1, 1.2, 1.2),
        (1, 1.2 - 2 * math.pi, 1.2),
        (1, 2.4, 2.0),
        (1, 0.1, 0.5),
        (1, -2.0, 2.0),  # 2.5 before the start of the arc, but 2.28 after its end
        (1, -1.0, 0.5),
        (1, -math.pi + 0.1, 2.0),
        (2, math.pi, -2.5),  # across the seam, -2.5 is the nearer end of the arc
        (2, 0.0, -2.0),
    ],
)
def test_directions_are_clamped_as_angles(fin: int, direction: float, expected: float) -> None:
    clamped = PROBLEM_OF_ARCS.feasible(np.array([[0.3, 0.7, direction]] * 3))
    assert clamped[fin, 2] == pytest.approx(expected)


def test_clamped_commands_keep_their_limits_and_inner_ones_stay() -> None:
    rng = np.random.default_rng(0)
    lower = PROBLEM_OF_ARCS.lower
    upper = PROBLEM_OF_ARCS.upper
    clamped = PROBLEM_OF_ARCS.feasible(5.0 * rng.standard_normal((500, 3, 3)))
    assert (clamped >= lower).all() and (clamped <= upper).all()
    inner = lower + rng.random((500, 3, 3)) * (upper - lower)
    np.testing.assert_allclose(PROBLEM_OF_ARCS.feasible(inner), inner, atol=1e-12)


def _singular_weak() -> np.ndarray:
    """A Jacobian (6, 6) of rank 2 whose squared singular values are about the absolute ridge."""
    rng = np.random.default_rng(0)
    return np.asarray(3e-5 * rng.normal(size=(6, 2)) @ rng.normal(size=(2, 6)) / np.sqrt(6.0))


def _singular_strong() -> np.ndarray:
    """A Jacobian (6, 6) of rank 2 whose smaller squared singular value is the relative ridge, one
    hundred-trillionth of the larger one."""
    return np.diag([1e6, 0.1, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("damping", [0.0, 1e-9])
@pytest.mark.parametrize("jacobian", [_singular_weak(), _singular_strong()], ids=["weak", "strong"])
def test_steps_solve_the_ridge_system_where_the_jacobian_is_singular(
    jacobian: np.ndarray, damping: float
) -> None:
    """x = J^T (J J^T + mu I)^-1 r is the least squares solution of J x = r and sqrt(mu) x = 0."""
    residual = np.array([1.0, -2.0, 0.5, 3.0, -1.0, 2.0])
    mu = damping + RIDGE[0] + RIDGE[1] * (jacobian**2).sum()
    system = np.concatenate([jacobian, np.sqrt(mu) * np.eye(6)])
    right = np.concatenate([residual, np.zeros(6)])
    expected = np.linalg.lstsq(system, right, rcond=None)[0]
    step = _smallest_change(jacobian.T[None], residual[None, :, None], np.array([damping]))
    np.testing.assert_allclose(step[0, :, 0], expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("restricted", [False, True])
@pytest.mark.parametrize("coupled", [False, True])
def test_wrenches_and_derivatives_are_those_of_the_plant(restricted: bool, coupled: bool) -> None:
    """With what jets take and without, of all actuators and axes or of some."""
    rng = np.random.default_rng(3)
    layout = replace(
        random_jet_robot(rng, "robot", (4, 6)), interaction=Jets() if coupled else None
    )
    plant = plant_of(layout)
    scale = rng.uniform(1.0, 10.0, 6)
    problem = CommandProblem.of(plant, scale)
    works = np.ones(layout.n, bool)
    counts = np.ones(6, bool)
    if restricted:
        works[1] = False
        counts[[2, 4]] = False
        problem = problem.restricted(works, counts)
    command = random_commands(problem, 3, 4)
    wrench, jacobian = problem.wrench_and_jacobian(command)
    np.testing.assert_allclose(wrench, problem.wrench(command), atol=1e-12)
    known = plant.wrench(np.where(works[:, None], command, np.nan)) / scale
    np.testing.assert_allclose(wrench, np.where(counts, known, 0.0), atol=1e-9)
    for i in range(layout.n):
        for k in range(3):
            step = np.zeros(command.shape)
            step[:, i, k] = 1e-6
            ahead, back = problem.wrench(command + step), problem.wrench(command - step)
            np.testing.assert_allclose(
                jacobian[:, i, k], (ahead - back) / 2e-6, atol=1e-4 * np.abs(jacobian).max()
            )


def test_commands_that_all_angles_may_follow_are_at_no_limit() -> None:
    pod = Azimuth("pod", (0.0, 0.0, 0.0), (0, 0, 1), (1, 0, 0), (0.0, 40.0), PowerLaw(1.0))
    plant = plant_of(Layout("pod", (pod,)))
    problem = CommandProblem.of(plant, np.ones(6))
    low, high = problem.edges
    assert low[0, 0] == -np.inf and high[0, 0] == np.inf
    assert 0.0 < low[0, 1] < 1e-6 and 40.0 - 1e-6 < high[0, 1] < 40.0
    np.testing.assert_array_equal(problem.width, [[2.0 * math.pi, 40.0, 0.0]])
    rates = Rates(plant, np.array([[0.2, 5.0, 0.0]]))
    in_tick = problem.in_tick(rates.box(np.array([[3.1, 10.0, 0.0]])))
    low, high = in_tick.edges
    np.testing.assert_allclose([low[0, :2], high[0, :2]], [[2.9, 5.0], [3.3, 15.0]], atol=1e-6)
