"""Parts of the default method by themselves: bounds that are put together, starts around a command,
what is driven under losses."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.dual import bound as dual_bound
from finlab.allocation.dual.bound import TABLE_ERROR, bound_by_laws, power_bound
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.dual.method import MAX_BASES
from finlab.allocation.levenberg_marquardt import _starts_around, cheapest_exact
from finlab.allocation.question import MethodQuestion
from finlab.arrays import NEARLY, Array
from finlab.core.calls import NOMINAL, Conditions
from finlab.layout import Layout, Limits, load_layout
from finlab.layout.load import parse_layout
from finlab.physics.plant import Plant
from tests.random_robots import random_robot


def dual_of(layout: Layout, **settings: float) -> Any:
    """The default method of a robot."""
    return Allocator(layout, **settings)._whole.method  # type: ignore[arg-type]


@pytest.fixture
def heavy() -> Any:
    """That of a robot of eight thrusters; each test gets its own."""
    return dual_of(load_layout("bluerov2_heavy"))


def bounds_of(method: Any, command: Array, **said: Any) -> Array:
    """The bounds (N,) of commands whose wrenches are the served ones, over their power."""
    wrench = method.plant.wrench(command)
    served = said.get("served", wrench)
    gaps = said.get("gaps", np.zeros(len(command)))
    force = method.plant.force(command)
    bound = method.bound(served, np.zeros((len(command), 6)), gaps, NOMINAL, command, force)
    return np.asarray(bound / method.plant.power(command).sum(axis=-1))


def with_bound_by_laws(
    method: Any, monkeypatch: pytest.MonkeyPatch, shares: list[float]
) -> Callable[..., Array]:
    """Has the laws prove some shares of the power, as those of a robot with tables do."""
    vars(method.compiled)["is_certified"] = False
    command = method.plant.sample(np.random.default_rng(1), (len(shares),))
    power = method.plant.power(command).sum(axis=-1)
    monkeypatch.setattr(dual_bound, "bound_by_laws", lambda *_: power * shares)
    return lambda **said: bounds_of(method, command, **said)


def test_bounds_of_measured_tables_are_raised_where_they_are_low(
    heavy: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    vars(heavy)["_reads_tables"] = True
    bounds = with_bound_by_laws(heavy, monkeypatch, [0.5, 1.0 - 0.5 * TABLE_ERROR, 0.7, 0.9])
    asked = list[int]()

    def raised(
        compiled: Compiled,
        plant: Plant,
        scale: Array,
        wrench: Array,
        lam: Array,
        command: Array,
        _: Conditions,
    ) -> Array:
        assert compiled is heavy.compiled and plant is heavy.plant and scale is heavy.scale
        asked.append(len(wrench))
        np.testing.assert_allclose(heavy.plant.wrench(command), wrench, atol=1e-9)
        power = np.asarray(heavy.plant.power(command).sum(axis=-1))
        return power * [0.8, 0.6, 0.95]

    monkeypatch.setattr(dual_bound, "bound_by_measured_tables", raised)
    np.testing.assert_allclose(bounds(), [0.8, 1.0 - 0.5 * TABLE_ERROR, 0.7, 0.95], rtol=1e-9)
    assert asked == [3]


def test_a_bound_above_the_power_is_cut_off_or_proves_nothing(
    heavy: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    bounds = with_bound_by_laws(heavy, monkeypatch, [0.9, 1.0005, 1.1, -0.3])
    found = bounds()
    np.testing.assert_allclose(found, [0.9, 1.0, 0.0, 0.0], rtol=1e-9)
    assert (found <= 1.0).all()


def test_what_gaps_are_proved_to_need_counts_for_the_served_wrench_alone(
    heavy: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    bounds = with_bound_by_laws(heavy, monkeypatch, [0.5, 0.5, 0.5])
    command = heavy.plant.sample(np.random.default_rng(1), (3,))
    power = heavy.plant.power(command).sum(axis=-1)
    gaps = power * [0.8, 0.3, 2.0]
    table_error = NEARLY * heavy.compiled.largest_power
    by_gaps = (1.0 - TABLE_ERROR) * 0.8 - table_error / power[0]
    np.testing.assert_allclose(bounds(gaps=gaps), [by_gaps, 0.5, 1.0], rtol=1e-9)
    served = heavy.plant.wrench(command)
    served[0, 4] += 10.0 * NEARLY * heavy.scale[4]
    np.testing.assert_allclose(bounds(gaps=gaps, served=served)[0], 0.5, rtol=1e-9)


@pytest.mark.parametrize("kind", ["thrusters", "azimuths", "fins", "holes", "rudders"])
def test_any_multipliers_prove_no_more_than_the_power_of_any_command(kind: str) -> None:
    layout = parse_layout(random_robot(kind, 1, 71))
    method = dual_of(layout)
    rng = np.random.default_rng(2)
    command = method.plant.sample(rng, (30,))
    wrench = method.plant.wrench(command)
    power = method.plant.power(command).sum(axis=-1)
    mean = power.mean()
    lam = rng.normal(size=(30, 6)) * mean / method.scale * 10.0 ** rng.uniform(-2, 0, (30, 1))
    bound = power_bound(method.compiled, wrench, lam)
    assert (bound <= power * (1.0 + 1e-6) + 1e-9).all()
    # The multiplier 0 proves what all take at rest or at their least forces, and nothing more.
    at_zero = power_bound(method.compiled, wrench, np.zeros((30, 6)))
    assert (at_zero <= power + 1e-9).all() and (at_zero >= -1e-9).all()
    lost = np.arange(layout.n) == 0
    without = power_bound(
        method.compiled,
        method.plant.wrench(np.where(lost[:, None], np.nan, command)),
        lam,
        Conditions(lost=lost),
    )
    least = power_bound(method.compiled, wrench * 0.0, np.zeros((1, 6)), Conditions(lost=lost))
    own = method.plant.power(command)[:, ~lost].sum(axis=-1)
    assert (without <= own * (1.0 + 1e-6) + 1e-9).all() and least[0] >= -1e-9


def test_a_bound_of_many_takes_the_better_of_its_own_multipliers_and_none(heavy: Any) -> None:
    command = heavy.plant.sample(np.random.default_rng(3), (4,))
    wrench = heavy.plant.wrench(command)
    rng = np.random.default_rng(4)
    lam = 1e3 * rng.normal(size=(4, 6))
    answered = heavy.solve(MethodQuestion(wrench))
    assert answered.multipliers is not None
    lam[1] = answered.multipliers[1]
    bound = bound_by_laws(heavy.compiled, wrench, lam, NOMINAL)
    alone = power_bound(heavy.compiled, wrench, lam)
    assert bound.shape == (4,)
    np.testing.assert_allclose(bound, np.maximum(alone, 0.0), atol=1e-9)
    assert bound[1] > 0.0


def test_starts_around_a_command_reach_from_near_to_the_whole_range_both_ways(heavy: Any) -> None:
    command = heavy.plant.sample(np.random.default_rng(5), ())
    width = heavy.plant.width[:, 0]
    moved = ((_starts_around(heavy.problem, command) - command)[..., 0]) / width
    assert np.abs(moved[0]).max() <= 1e-3
    assert 0.5 < np.abs(moved[-1]).max() <= 1.0
    assert 0.3 < (moved > 0.0).mean() < 0.7


def test_of_exact_commands_the_cheapest_is_taken(heavy: Any) -> None:
    rng = np.random.default_rng(6)
    wrench = 0.3 * heavy.plant.wrench(heavy.plant.sample(rng, ())) / heavy.scale
    starts = heavy.plant.sample(rng, (12,))
    found = cheapest_exact(heavy.problem, wrench, starts)
    each = [cheapest_exact(heavy.problem, wrench, start[None]) for start in starts]
    powers = [heavy.plant.power(one).sum() for one in each if one is not None]
    assert len(powers) > 3 and max(powers) > min(powers)
    assert heavy.plant.power(found).sum() == pytest.approx(min(powers), rel=1e-6)
    assert cheapest_exact(heavy.problem, 100.0 * np.ones(6), starts) is None


def test_an_error_leaves_out_free_axes_and_lost_actuators(heavy: Any) -> None:
    def error(command: Array, wrench: Array, conditions: Conditions = NOMINAL) -> Array:
        """Normalized errors (3,) of commands, given wrenches [N, N m]."""
        return np.asarray(heavy.problem_under(conditions).error(command, wrench / heavy.scale))

    command = heavy.plant.sample(np.random.default_rng(7), (3,))
    wrench = heavy.plant.wrench(command)
    np.testing.assert_allclose(error(command, wrench), 0.0, atol=1e-9)
    off = wrench + [3.0, 0, 0, 0, -1.0, 0]
    both = np.hypot(3.0 / heavy.scale[0], 1.0 / heavy.scale[4])
    np.testing.assert_allclose(error(command, off), both)
    free = np.arange(6) == 0
    np.testing.assert_allclose(error(command, off, Conditions(free=free)), 1.0 / heavy.scale[4])
    lost = np.arange(8) == 2
    without = command.copy()
    without[:, 2] = 0.0
    np.testing.assert_allclose(
        error(command, heavy.plant.wrench(without), Conditions(lost=lost)), 0.0, atol=1e-9
    )


def test_what_is_driven_is_kept_for_the_last_states_of_losses(heavy: Any) -> None:
    rng = np.random.default_rng(8)
    for _ in range(2 * MAX_BASES):
        lost = rng.random(8) < 0.4
        free = rng.random(6) < 0.3
        conditions = Conditions(lost=lost, free=free)
        basis = heavy._basis_under(conditions)
        assert heavy._basis_under(conditions) is basis
        assert len(heavy._bases) <= MAX_BASES
        counts = ~free
        columns = heavy.compiled.effectiveness[~lost, 0] / heavy.compiled.axis_scale
        driven = np.where(counts, columns, 0.0)
        rank = np.linalg.matrix_rank(driven, tol=1e-6)
        assert basis.shape == (6, rank)
        np.testing.assert_allclose(driven @ basis @ basis.T, driven, atol=1e-6)
    assert len(heavy._bases) == MAX_BASES


def test_fins_of_one_model_and_limits_share_a_margin_which_is_made_once() -> None:
    alike = load_layout("A").fins
    other = replace(alike[1], limits=Limits((0.05, 0.4), (0.1, 2.1)))
    ((_, group),) = dual_of(Layout("fins", (alike[0], other, alike[2]))).compiled.groups
    first, second, third = group.conjugate_margins
    assert first is not None and first is third and first is not second
    ((_, again),) = dual_of(Layout("again", alike[:1])).compiled.groups
    assert again.conjugate_margins[0] is first
