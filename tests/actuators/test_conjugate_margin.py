"""Margins of the tables of fins: no command is worth more at any price than table and margin say,
hardly less is said than is true, and the core reads them so."""

from typing import Any

import numpy as np
import pytest

from finlab.actuators.fin.conjugate_margin import CELLS_BEYOND
from finlab.actuators.fin.fin_model import FinModelSpec, Limits
from finlab.actuators.fin.fin_response import FinTable, fin_table
from finlab.actuators.fin.law_box import LawBox
from finlab.actuators.response import CELLS
from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.core.calls import Conditions, ConjugateMargins
from finlab.layout import Fin, Layout, load_layout
from tests.interval_arithmetic import Interval
from tests.sampled_cases import sampled

HELD_TO = 1e-4
"""Share of a command's power to which it is proved that no command is worth more."""
HELD_TO_FULL = 1e-8
"""The same as a share of full power, for commands that hardly take any."""
MOST_BOXES = 600_000
"""Boxes of commands and prices that a proof may take."""


def fin_of(model: FinModelSpec, limits: Limits) -> Fin:
    """A fin of a model within limits."""
    return Fin("fin", position=(0.0, 0.2, 0.0), mounting_angle=0.5, model=model, limits=limits)


def conjugate_bound(table: FinTable, price: Array) -> Array:
    """Table and margin at prices (K,), as finlab.h describes them."""
    margin = table.conjugate_margin
    assert margin is not None
    price_max, cells, cells_beyond, force_error = margin[:4]
    within = margin[4 : 4 + int(cells)]
    beyond = margin[4 + int(cells) :]
    assert (cells, cells_beyond, len(beyond)) == (CELLS, CELLS_BEYOND, CELLS_BEYOND + 1)
    least_force = float(table.table.force[0]) - force_error
    _, conjugate = table.table.force_and_conjugate(np.maximum(price, 0.0))
    share = np.clip(price / price_max, 0.0, 1.0) ** 0.25
    inside = within[np.minimum((cells * share).astype(int), CELLS - 1)]
    place = cells_beyond * (1.0 - price_max / np.maximum(price, price_max))
    outside = price * np.interp(place, np.arange(CELLS_BEYOND + 1), beyond)
    added = np.where(price < price_max, inside, outside)
    return np.asarray(conjugate + added + np.minimum(price, 0.0) * least_force)


def random_fin(rng: np.random.Generator) -> Fin:
    """A fin of any formula, whose limits may begin at rest or leave one number no width."""
    kind = rng.choice(["drag", "lighthill", "soft", "soft"])
    numbers: dict[str, float] = {}
    if kind == "drag":
        numbers = {"area": 10 ** rng.uniform(-3, -1), "lever": 10 ** rng.uniform(-1.5, -0.3)}
    elif kind == "lighthill":
        numbers = {"length": 10 ** rng.uniform(-1.3, 0), "width": 10 ** rng.uniform(-1.5, 0)}
    else:
        numbers = {
            "k": 10 ** rng.uniform(-1, 1),
            "p": rng.uniform(0.5, 4.0),
            "x0": 10 ** rng.uniform(-0.7, 1.0),
            "q": 10 ** rng.uniform(-0.5, 1.2),
            "e": rng.choice([0.0, rng.uniform(0.0, 0.5)]),
        }
    pairs = tuple(sorted((name, float(number)) for name, number in numbers.items()))
    ranges = []
    for largest in (1.5, 4.0):
        low, high = np.sort(rng.uniform(0.01, largest, 2))
        how = rng.choice(["as drawn", "from rest", "held"], p=[0.5, 0.4, 0.1])
        ranges.append((0.0 if how == "from rest" else high if how == "held" else low, high))
    amplitude, frequency = ranges
    return fin_of(FinModelSpec(str(kind), pairs), Limits(amplitude, frequency))


def largest_profits(box: LawBox, price: Array) -> Array:
    """The largest profits (K,) that are found from the best of each part of a fine grid."""
    grid = box.grid((41, 301))
    most = np.full(len(price), -np.inf)
    for part in np.array_split(grid, 8):
        best = part[box.profit(price[:, None], part).argmax(axis=1), :2]
        most = np.maximum(most, box.optimum(price, best[None]).profit)
    return most


@pytest.mark.parametrize("seed", sampled(range(60)))
def test_no_command_of_a_random_fin_is_worth_more(seed: int) -> None:
    rng = np.random.default_rng([41, seed])
    table = fin_table(random_fin(rng))
    top = table.table.price_max
    price = np.concatenate([top * rng.random(40) ** 2, top * 10.0 ** rng.uniform(0.0, 3.0, 20)])
    bound = conjugate_bound(table, price)
    assert (largest_profits(table.box, price) <= bound + 1e-12 * np.abs(bound).max()).all()
    against = -price
    grid = table.box.grid((41, 301))
    worth = table.box.profit(against[:, None], grid).max(axis=1)
    assert (worth <= conjugate_bound(table, against) + 1e-12 * np.abs(worth).max()).all()


@pytest.mark.parametrize(("name", "index"), [("A", 0), ("fish", 0), ("fish", 1)])
def test_margins_of_shipped_fins_say_hardly_more_than_is_true(name: str, index: int) -> None:
    table = fin_table(load_layout(name).fins[index])
    price = table.table.price_max * np.linspace(0.03, 4.0, 500)
    optimum = table.box.optimum(price)
    power = price * table.box.force(optimum.command) - optimum.profit
    too_much = (conjugate_bound(table, price) - optimum.profit) / power
    assert too_much.max() < 1e-6 and np.median(too_much) < 1e-7


def rest_price(force: Interval, power: Interval, box: Array, limits: Array) -> tuple[Array, Array]:
    """Prices from and to which commands in boxes (2, K) may be best along one of their numbers:
    where it pays to change it neither way, or only beyond its limits (2,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.where(force.high > 0.0, power.low / force.high, np.inf)
        first = np.where(power.low > 0.0, first, 0.0)
        last = np.where(force.low > 0.0, power.high / force.low, np.inf)
    first = np.where(box[0] <= limits[0], 0.0, first)
    last = np.where(box[1] >= limits[1], np.inf, last)
    return first * (1.0 - 1e-12), last * (1.0 + 1e-12)


@pytest.mark.parametrize(("name", "index"), [("A", 0), ("fish", 0), ("fish", 1)])
def test_no_command_of_a_shipped_fin_is_worth_more_by_intervals(name: str, index: int) -> None:
    """Branch and bound over boxes of amplitudes, frequencies and prices. In a box the profit is at
    most that of its middle and the largest slopes times half the widths (mean value theorem), and
    table and margin are above a tangent of the table, as it is convex."""
    table = fin_table(load_layout(name).fins[index])
    law: Any = table.box.law
    direction = table.box.zero_direction
    limits = np.stack([table.box.lower[:2], table.box.upper[:2]], axis=1)
    margin = table.conjugate_margin
    assert margin is not None
    within = margin[4 : 4 + CELLS]
    top = table.table.price_max
    full_power = float(law.blade.power(*limits[:, 1]))
    edges = [low + (high - low) * np.linspace(0.0, 1.0, 15) ** 2 for low, high in limits]
    edges.append(top * np.append(0.0, np.linspace(0.02, 1.0, 33) ** 4))
    lows = np.stack(np.meshgrid(*[edge[:-1] for edge in edges], indexing="ij"))
    highs = np.stack(np.meshgrid(*[edge[1:] for edge in edges], indexing="ij"))
    boxes = np.stack([lows.reshape(3, -1), highs.reshape(3, -1)], axis=1)
    looked_at = 0
    while boxes.shape[-1]:
        looked_at += boxes.shape[-1]
        assert looked_at < MOST_BOXES
        beat = Interval(*boxes[0]), Interval(*boxes[1])
        forces = law.thrust_gradient(*beat, direction)[:2]
        powers = law.blade.power_gradient(*beat)
        for k in range(2):
            first, last = rest_price(forces[k], powers[k], boxes[k], limits[k])
            boxes[2, 0] = np.maximum(boxes[2, 0], first)
            boxes[2, 1] = np.minimum(boxes[2, 1], last)
        some = boxes[2, 0] <= boxes[2, 1]
        boxes = boxes[..., some]
        middle = boxes.mean(axis=1)
        half = 0.5 * (boxes[:, 1] - boxes[:, 0])
        force = law.thrust(middle[0], middle[1], direction)
        power = law.blade.power(middle[0], middle[1])
        table_force, conjugate = table.table.force_and_conjugate(middle[2])
        reach = np.zeros((3, boxes.shape[-1]))
        excess = np.full(boxes.shape[-1], -np.inf)
        for price in boxes[2]:
            for k in range(2):
                slope = price * forces[k].rows(some) - powers[k].rows(some)
                steepest = np.maximum(slope.high, -slope.low).clip(0.0)
                reach[k] = np.maximum(reach[k], steepest * half[k])
            tangent = conjugate + table_force * (price - middle[2])
            excess = np.maximum(excess, price * force - power + reach[:2].sum(axis=0) - tangent)
        ends = table.table.force_and_conjugate(boxes[2])[0]
        reach[2] = 0.5 * (ends[1] - ends[0]) * half[2]
        cell = np.minimum((CELLS * (boxes[2] / top) ** 0.25).astype(int), CELLS - 1)
        least_margin = np.minimum(within[cell[0]], within[cell[1]])
        least_margin = np.where(cell[1] - cell[0] > 1, within.min(), least_margin)
        left = excess > least_margin + HELD_TO * power + HELD_TO_FULL * full_power
        boxes = boxes[..., left]
        widest = reach[:, left].argmax(axis=0)
        row = np.arange(boxes.shape[-1])
        lower_half = boxes.copy()
        upper_half = boxes.copy()
        lower_half[widest, 1, row] = middle[:, left][widest, row]
        upper_half[widest, 0, row] = middle[:, left][widest, row]
        boxes = np.concatenate([lower_half, upper_half], axis=-1)
    assert looked_at > 1000


@pytest.mark.parametrize("kind", ["drag", "lighthill", "soft"])
def test_intervals_enclose_the_slopes_of_all_commands(kind: str) -> None:
    law: Any = fin_table(fin_of(FinModelSpec(kind), Limits())).box.law
    rng = np.random.default_rng(3)
    low = rng.uniform(0.05, 1.0, (2, 200))
    high = low + rng.uniform(0.0, 0.3, (2, 200))
    inside = low + rng.random((2, 200)) * (high - low)
    beat = Interval(low[0], high[0]), Interval(low[1], high[1])
    for enclosed, of_numbers in (
        (law.thrust_gradient(*beat, 0.3)[:2], law.thrust_gradient(*inside, 0.3)[:2]),
        (law.blade.power_gradient(*beat), law.blade.power_gradient(*inside)),
    ):
        for interval, number in zip(enclosed, of_numbers, strict=True):
            rounding = 1e-12 * np.abs(number)
            assert (interval.low - rounding <= number).all()
            assert (number <= interval.high + rounding).all()


def test_the_core_reads_margins_at_all_prices() -> None:
    fin = fin_of(FinModelSpec("soft"), Limits((0.05, 0.9), (0.1, 2.0), (-0.4, 0.4)))
    method: Any = Allocator(Layout("one", (fin,)))._whole.method
    compiled = method.compiled
    rng = np.random.default_rng(5)
    multipliers = rng.normal(size=(400, 6)) * 10.0 ** rng.uniform(-3.0, 4.0, (400, 1))
    table = fin_table(fin)
    found = compiled.core.conjugates(multipliers, compiled.conjugate_margins)
    price = found.price_ahead[:, 0]
    top = table.table.price_max
    assert (price < 0.0).any() and (price > top).any() and ((price > 0.0) & (price < top)).any()
    np.testing.assert_allclose(found.conjugate[:, 0], conjugate_bound(table, price), rtol=1e-9)
    without = compiled.core.conjugates(multipliers, ConjugateMargins([None]))
    assert (without.conjugate != found.conjugate).any()
    np.testing.assert_array_equal(without.price_ahead, found.price_ahead)


@pytest.mark.parametrize("name", ["A", "fish", "restricted"])
def test_the_core_sums_bounds_as_python_does(name: str) -> None:
    from finlab.allocation.dual.bound import power_bound

    method: Any = Allocator(load_layout(name))._whole.method
    compiled = method.compiled
    assert compiled.is_certified
    rng = np.random.default_rng(7)
    command = method.plant.sample(rng, (40,))
    multipliers = rng.normal(size=(40, 6)) * 10.0 ** rng.uniform(-2.0, 1.0, (40, 1)) / method.scale
    multipliers[0] = np.nan
    for conditions in (
        Conditions(),
        Conditions(lost=np.arange(method.layout.n) == 1),
        Conditions(free=np.arange(6) == 2),
        Conditions(previous=command[0]),
    ):
        force = method.plant.force(command)
        if conditions.lost is not None:
            force[:, conditions.lost] = 0.0
        wrench = np.einsum("kna,naw->kw", force, method.plant.effectiveness)
        if conditions.free is not None:
            wrench[:, conditions.free] = 0.0
            multipliers[:, conditions.free] = 0.0
        margins = compiled.conjugate_margins
        bound = compiled.core.power_bounds(multipliers, wrench, margins, conditions)
        by_python = np.fmax(
            power_bound(compiled, wrench, multipliers, conditions),
            power_bound(compiled, wrench, 0.0 * wrench, conditions),
        )
        np.testing.assert_allclose(bound, by_python.clip(0.0), rtol=1e-9, atol=1e-12)
        works = np.ones(method.layout.n, bool) if conditions.lost is None else ~conditions.lost
        power = method.plant.power(command)[:, works].sum(axis=-1)
        if conditions.previous is None:  # the drives follow these commands in no tick
            assert (bound <= power).all()
