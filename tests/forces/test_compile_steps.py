"""The steps by which a fin is compiled, one by one: lean, vertex, peak, polish, slopes and smoothing."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.arrays import Values
from finlab.forces import fin_envelope as steps
from finlab.forces.fin_envelope import (
    COST,
    DIRECTIONS,
    LEVELS,
    MOBILITY,
    STIFFNESS,
    WAVES,
    compile_fin,
    levels,
)
from finlab.layout import FinModelSpec, Limits
from finlab.physics import FinLaw, make_law
from finlab.physics.fin_law import PlanarLaw
from finlab.physics.objective import Objective

Array = NDArray[np.float64]
FULL = Limits((0.0, 0.6), (0.0, 2.0))


class Swirling(PlanarLaw):
    """A fin that leans the more, the harder it works, and is a little uneven; at rest it has no direction."""

    uniform = False

    def thrust(self, amplitude: Values, frequency: Values, zero_direction: Values) -> Values:
        x = amplitude * frequency
        self.offset = 0.3 + 0.2 * x
        return x**2 * (1.0 + 0.1 * np.cos(zero_direction))

    def thrust_slopes(self, amplitude: Array, frequency: Array, zero_direction: Array) -> Any:
        raise AssertionError("only its forces are asked for")


@pytest.mark.parametrize("arc", [(-np.pi, np.pi), (-1.0, 1.5)])
def test_each_turn_of_the_grid_points_the_force_where_it_is_said_to(arc: tuple[float, float]) -> None:
    limits = Limits((0.0, 0.6), (0.0, 2.0), arc)
    law = Swirling()
    grid = steps._force_grid(law, np.array(limits.lower), np.array(limits.upper))
    command = np.stack(
        np.broadcast_arrays(grid.amplitude[:, None, None], grid.frequency[:, None], grid.turn), axis=-1
    )
    force = law.force(command)
    size = np.hypot(force[..., 1], force[..., 2])
    felt = size > 0.01 * size.max()
    if arc[1] < 3.0:  # near the stops no turn points there, and the size says so
        felt &= grid.size > 0.0
        assert (grid.turn >= arc[0]).all() and (grid.turn <= arc[1]).all()
    off = np.arctan2(force[..., 2], force[..., 1]) - grid.direction
    assert felt.mean() > 0.5
    assert np.abs((off + np.pi) % (2 * np.pi) - np.pi)[felt].max() < 2e-3
    np.testing.assert_allclose(grid.size[felt], size[felt], rtol=2e-2)
    # At rest a force has no direction of its own: the fin waits where the strongest needs it.
    np.testing.assert_allclose(grid.turn[0, 0], grid.turn[-1, -1], atol=1e-9)
    assert grid.half == pytest.approx(np.pi if arc[1] > 3.0 else 0.5 * (arc[1] - arc[0]), abs=0.13)


def test_a_parabola_turns_at_its_vertex_but_never_beyond_half_a_step() -> None:
    for vertex in (-0.5, -0.3, 0.0, 0.2, 0.5):
        values = [np.array([3.0 - 2.0 * (x - vertex) ** 2]) for x in (-1.0, 0.0, 1.0)]
        offset, top = steps._vertex(*values)
        assert offset == pytest.approx([vertex]) and top == pytest.approx([3.0])
    for vertex in (-4.0, -0.7, 0.7, 1.2, 4.0):
        values = [np.array([(x - vertex) ** 2]) for x in (-1.0, 0.0, 1.0)]
        offset, least = steps._vertex(*values)
        assert offset == pytest.approx([0.5 * np.sign(vertex)])
        assert least == pytest.approx([(0.5 * np.sign(vertex) - vertex) ** 2])
    for before, at, after in ((2.0, 2.0, 2.0), (1.0, 2.0, 3.0), (np.inf, 2.0, 3.0), (np.nan, 2.0, 3.0)):
        offset, value = steps._vertex(np.array([before]), np.array([at]), np.array([after]))
        assert offset == [0.0] and value == [2.0], "a line, or what is not known, turns nowhere"


def test_a_size_that_falls_again_has_its_peak_between_grid_points() -> None:
    at = np.arange(6.0)
    peaks = np.array([0.0, 1.3, 2.5, 3.7, 5.0])
    size = 9.0 - (at[:, None] - peaks) ** 2
    found = steps._with_peaks(size[None])
    assert found.max(axis=1)[0] == pytest.approx([9.0] * 5)
    assert (found != size[None]).sum() == 3, "only the largest of a column whose peak lies within"
    three = 9.0 - (np.arange(3.0)[:, None] - 1.2) ** 2
    assert steps._with_peaks(three[None]).max() == pytest.approx(9.0)
    two = size[None, :2]
    assert (steps._with_peaks(two) == two).all()


def test_polishing_never_goes_farther_than_its_longest_steps() -> None:
    """A force that the fin cannot reach pulls all steps to their limits: a tenth of the range each."""
    law, lower, upper = make_law(FinModelSpec()), np.array(FULL.lower), np.array(FULL.upper)
    grid = steps._force_grid(law, lower, upper)
    strong = float(grid.size.max())
    start = np.array([[[0.6, 0.2, 0.0]]])
    found = steps._polished(law, start, grid, np.array([[100.0 * strong]]), lower, upper)
    assert found[0, 0, 1] == pytest.approx(0.2 + 0.1 * (2.0 - 0.0) * steps.POLISHES)
    assert found[0, 0, [0, 2]] == pytest.approx(start[0, 0, [0, 2]])
    # With one frequency the amplitude gives the size, by a tenth of its own range.
    lower[1] = upper[1] = 1.5
    start[0, 0] = 0.1, 1.5, 0.0
    found = steps._polished(law, start, grid, np.array([[100.0 * strong]]), lower, upper)
    assert found[0, 0] == pytest.approx([0.1 + 0.1 * 0.6 * steps.POLISHES, 1.5, 0.0])
    # What is near is met exactly; what would leave the limits ends at them.
    lower, upper = np.array(FULL.lower), np.array(FULL.upper)
    wanted = np.linalg.norm(law.force(np.array([0.6, 1.5, 0.0])))
    found = steps._polished(law, np.array([[[0.6, 1.4, 0.0]]]), grid, np.array([[wanted]]), lower, upper)
    assert found[0, 0] == pytest.approx([0.6, 1.5, 0.0], rel=1e-6)
    found = steps._polished(
        law, np.array([[[0.6, 1.9, 0.0]]]), grid, np.array([[100.0 * strong]]), lower, upper
    )
    assert found[0, 0] == pytest.approx([0.6, 2.0, 0.0])


def test_polishing_turns_a_tenth_of_a_radian_at_a_time_and_past_the_seam_of_a_circle() -> None:
    law = make_law(FinModelSpec("soft", (("e", 0.2),)))
    lower, upper = np.array(FULL.lower), np.array(FULL.upper)
    grid = steps._force_grid(law, lower, upper)
    k = DIRECTIONS - 1
    assert grid.direction[k] == pytest.approx(np.pi)
    wanted = np.full((DIRECTIONS, 1), 0.5 * float(grid.size[-1, -1].min()))
    start = np.tile([0.6, 1.0, 0.0], (DIRECTIONS, 1, 1))
    for turn, longest in ((np.pi - 1.0, 0.3), (np.pi + 0.5, -0.3), (np.pi - 0.05, 0.05)):
        start[..., 2] = turn
        found = steps._polished(law, start, grid, wanted, lower, upper)[k, 0]
        assert found[2] - turn == pytest.approx(longest, abs=1e-3)
    # A fin with stops does not turn past them.
    stops = np.array([-1.0, 1.0])
    lower[2], upper[2] = stops
    start[..., 2] = 0.95
    found = steps._polished(law, start, grid, wanted, lower, upper)[k, 0]
    assert found[2] == 1.0


def test_turns_between_the_frequencies_of_a_grid() -> None:
    limits = Limits((0.1, 0.6), (0.5, 2.0))
    grid = steps._force_grid(Swirling(), np.array(limits.lower), np.array(limits.upper))
    turn = grid.turn
    for j, part in ((0, 0.0), (0, 0.5), (7, 0.25), (len(grid.frequency) - 2, 1.0)):
        asked = grid.frequency[j] + part * (grid.frequency[1] - grid.frequency[0])
        frequency = np.full((*turn.shape[::2], 1), asked)
        between = turn[:, j] + part * (turn[:, j + 1] - turn[:, j])
        np.testing.assert_allclose(steps._turns_at(grid, frequency)[..., 0], between, atol=1e-9)
    nowhere = steps._turns_at(grid, np.full((*turn.shape[::2], 1), np.nan))
    np.testing.assert_array_equal(nowhere[..., 0], turn[:, 0])


class Scaled(FinLaw):
    """A fin whose forces and power are those of another one, times a number."""

    def __init__(self, law: FinLaw, scale: float) -> None:
        self._law, self._scale, self.uniform = law, scale, law.uniform

    def force(self, command: Values) -> Values:
        return self._scale * self._law.force(command)

    def force_and_slopes(self, command: Array) -> tuple[Array, Array]:
        force, slopes = self._law.force_and_slopes(command)
        return self._scale * force, self._scale * slopes

    def power(self, command: Values, copper_loss: float = 0.0) -> Values:
        return self._scale * self._law.power(command, copper_loss)


@pytest.mark.parametrize("numbers", [(), (("e", 0.2), ("phi_e", 1.0))])
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_what_is_compiled_knows_no_unit(scale: float, numbers: tuple[tuple[str, float], ...]) -> None:
    """Force and power in milli or kilo: the same commands, the same marginal cost, which is their ratio."""
    law = make_law(FinModelSpec("soft", numbers))
    one, other = (compile_fin(fin, FULL, Objective()) for fin in (law, Scaled(law, scale)))
    assert other.largest == pytest.approx(scale * one.largest, rel=1e-9)
    assert (other.middle, other.half) == pytest.approx((one.middle, one.half))
    strong = slice(5, -3)  # near rest and near the peak commands are hardly defined
    for column, factor in ((COST, scale), (STIFFNESS, 1.0)):
        found, expected = other.table[:, strong, column], factor * one.table[:, strong, column]
        np.testing.assert_allclose(found, expected, rtol=1e-4)
    mobility = other.table[:, strong, MOBILITY] - one.table[:, strong, MOBILITY]
    np.testing.assert_allclose(mobility, np.log(scale), atol=1e-4)


def grid_of(half: float) -> Any:
    """A grid as `_smooth` knows it: by its arc alone."""
    nothing = np.zeros(0)
    direction = np.linspace(-half, half, DIRECTIONS)
    return steps._Grid(nothing, nothing, direction, nothing, nothing, 0.0, half, False)


@pytest.mark.parametrize("half", [np.pi, 1.2])
def test_what_is_smooth_already_stays_and_finer_waves_go(half: float) -> None:
    angle, level = np.linspace(-np.pi, np.pi, DIRECTIONS), np.linspace(0.0, 1.0, LEVELS)
    rng = np.random.default_rng(0)

    def waves(*orders: int) -> Array:
        """Waves of these orders around the circle, or powers along the arc."""
        if half < np.pi:
            return sum((rng.normal() * (angle / np.pi) ** k for k in orders), np.zeros(DIRECTIONS))
        draws = [(rng.normal(), rng.normal(), k) for k in orders]
        return sum((a * np.cos(k * angle) + b * np.sin(k * angle) for a, b, k in draws), np.zeros(DIRECTIONS))

    cost = sum((5.0 + waves(*range(1, WAVES + 1)))[:, None] * level**power for power in (0, 4, 5, 6, 7, 8))
    least, most = 0.5 + 0.02 * waves(1, WAVES), 4.0 + 0.1 * waves(2, 3)
    wanted = least[:, None] + (most - least)[:, None] * levels()
    kept, sizes = steps._smooth(cost, wanted, grid_of(half))
    np.testing.assert_allclose(kept, cost, rtol=1e-7, atol=1e-7 * np.abs(cost).max())
    np.testing.assert_allclose(sizes, wanted, rtol=1e-9)
    # What the basis does not hold, it lessens: a finer wave, and a cost that grows at once.
    finer = np.cos((WAVES + 2) * angle) if half == np.pi else np.cos(40.0 * angle)
    smoother, _ = steps._smooth(cost + finer[:, None], wanted, grid_of(half))
    assert np.abs(smoother - cost).mean() < 0.25 * np.abs(finer).mean()


def test_derivatives_around_the_circle_have_no_seam() -> None:
    angle = np.linspace(-np.pi, np.pi, DIRECTIONS)
    values = np.sin(angle)[:, None] * np.ones(3)
    np.testing.assert_allclose(
        steps._around(values, grid_of(np.pi)), np.cos(angle)[:, None] * np.ones(3), atol=4e-3
    )
    direction = np.linspace(-1.2, 1.2, DIRECTIONS)
    np.testing.assert_allclose(
        steps._around(3.0 * direction[:, None], grid_of(1.2)), np.full((DIRECTIONS, 1), 3.0)
    )
    assert not steps._around(values, grid_of(0.0)).any()
