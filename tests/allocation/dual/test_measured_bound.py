"""The bound of measured fins: below the power of every command, and near the least of smooth
tables."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.actuators.fin import bernstein_bound
from finlab.actuators.fin.bernstein_bound import TableBound
from finlab.actuators.fin.force_table_file import COLUMNS, table_text
from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.assets import shipped_layouts
from finlab.axes import TURN
from finlab.layout import load_layout
from finlab.physics import Plant, TableLaw, make_law
from tests.random_fin_robots import write_fin_table
from tests.random_robots import load, random_robot
from tests.sampled_cases import sampled


def random_table(rng: np.random.Generator, limits: Array, noise: float) -> TableLaw:
    """A noisy law with any lean and unevenness on uneven knots, up to beyond or short of limits (3,
    2)."""
    ends = limits[:2, 1] * rng.uniform(0.85, 1.2, 2)
    axes = [np.sort(rng.uniform(0.0, end, rng.integers(3, 7))) for end in ends]
    first = limits[2, 0]
    width = np.ptp(limits[2])
    periodic = bool(width > TURN - 1e-6)
    axes.append(first + width * np.sort(rng.permutation(40)[: rng.integers(9, 20)]) / 40)
    a, f, d = np.meshgrid(*axes, indexing="ij")
    size = (
        rng.uniform(1.0, 8.0)
        * (a * f) ** rng.uniform(1.0, 2.0)
        * (1.0 + rng.uniform(0.0, 0.3) * np.cos(d))
    )
    angle = d + rng.uniform(-0.2, 0.2) * a
    force = size[..., None] * np.stack([0.1 + 0.0 * d, np.cos(angle), np.sin(angle)], axis=-1)
    values = force + noise * size.max() * rng.standard_normal(force.shape)
    if rng.random() < 0.5:
        power = rng.uniform(0.3, 3.0) * f**3 * a**2 * (1.0 + noise * rng.standard_normal(a.shape))
        values = np.concatenate([values, np.maximum(power, 0.0)[..., None]], axis=-1)
    return TableLaw(axes, values, periodic)


def measured(kind: str, number: int, folder: Path) -> Any:
    """A robot of a kind whose first fin, and most others, are known by tables."""
    robot = random_robot(kind, number, 3)
    rng = np.random.default_rng([17, number])
    fins = [part for part in robot["actuators"] if part["type"] == "fin"]
    for k, fin in enumerate(fins):
        if k and rng.random() < 0.3:
            continue
        limits = np.array(
            [fin["limits"][key] for key in ("amplitude_rad", "frequency_hz", "zero_direction_rad")]
        )
        law = random_table(rng, limits, rng.choice([0.0, 0.03]))
        command = np.stack(np.meshgrid(*law.grid.axes, indexing="ij"), axis=-1)
        rows = np.concatenate([command, law.grid.values], axis=-1)
        header = (*COLUMNS, "P")[: rows.shape[-1]]
        path = folder / f"{number}-{k}.csv"
        path.write_text(table_text((), header, rows.reshape(-1, len(header)), 12))
        fin["model"] = {"type": "table", "path": str(path)}
    return load(robot)


@pytest.mark.parametrize("seed", range(30))
def test_no_command_is_worth_more_and_hardly_any_less(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng([5, seed])
    covered = np.array([[0.0, 1.2], [0.0, 3.0], [-3.0, rng.choice([-2.0, 0.5, TURN - 3.0])]])
    law = random_table(rng, covered, rng.choice([0.0, 0.03, 0.2]))
    limits = np.sort(rng.uniform(0.0, [[1.3], [3.2], [TURN]], (3, 2)))
    limits[2] -= rng.uniform(0.0, TURN)
    if seed % 3 == 0:  # one that is held
        limits[seed // 3 % 3] = limits[seed // 3 % 3, 0]
    price = rng.normal(size=(5, 3)) * 10.0 ** rng.uniform(-1.0, 1.0, (5, 1))
    price[seed % 5] = 0.0  # as every bound asks, too
    bound = TableBound(law, *limits.T)(price)
    grid = []
    for k, axis in enumerate(law.grid.axes):
        fine = np.interp(np.arange(0.0, len(axis), 0.25), np.arange(len(axis)), axis)
        near = np.add.outer(fine, TURN * np.arange(-2, 3) * (k == 2)).ravel()
        grid.append(np.append(np.linspace(*limits[k], 9), near.clip(*limits[k])))
    command = np.stack(np.meshgrid(*map(np.unique, grid), indexing="ij"), axis=-1).reshape(-1, 3)
    net_value = law.force(command) @ price.T - law.power(command)[:, None]
    scale = np.abs(net_value).max(axis=0)
    assert (net_value.max(axis=0) <= bound + 1e-12 * scale).all()
    assert (bound <= net_value.max(axis=0) + 0.05 * scale).all()
    monkeypatch.setattr(bernstein_bound, "MOST_KEPT", 0)
    np.testing.assert_allclose(TableBound(law, *limits.T)(price), bound, rtol=1e-9)
    monkeypatch.setattr(bernstein_bound, "MOST_CELLS", 50)  # ends early
    assert (net_value.max(axis=0) <= TableBound(law, *limits.T)(price) + 1e-12 * scale).all()


@pytest.mark.parametrize("number", sampled(range(2)))
@pytest.mark.parametrize("kind", sampled(["fins uneven", "fins any shaft", "holes", "all"], 2))
def test_no_command_takes_less(kind: str, number: int, tmp_path: Path) -> None:
    layout = measured(kind, number, tmp_path)
    allocator = Allocator(layout)
    plant = Plant(layout)
    rng = np.random.default_rng(number)
    command = plant.sample(rng, (5,))
    wrench = plant.wrench(command)
    power = plant.power(command).sum(axis=-1)
    batch = allocator.allocate_batch(wrench)
    assert (batch.bound <= batch.power).all() and (batch.bound > 0.0).mean() > 0.5
    exact = batch.err_norm < 1e-9
    assert (batch.bound <= power * (1.0 + 1e-6))[exact].all()
    one = allocator.allocate(wrench[0])
    assert one.bound == pytest.approx(batch.bound[0], rel=0.05)
    for policy in ("direction", "closest"):
        batch_out_of_reach = allocator.allocate_batch(3.0 * wrench, policy=policy)
        assert (batch_out_of_reach.bound <= batch_out_of_reach.power).all()


@pytest.mark.parametrize("power", [False, True])
def test_smooth_tables_are_proved(power: bool, tmp_path: Path) -> None:
    layout = load_layout(shipped_layouts()["ucat"])
    model = write_fin_table(
        tmp_path / "fin.csv", make_law(layout.fins[0].model), layout.fins[0].limits, power=power
    )
    layout = replace(layout, actuators=tuple(replace(fin, model=model) for fin in layout.fins))
    wrench = Plant(layout).wrench(Plant(layout).sample(np.random.default_rng(1), (20,)))
    batch = Allocator(layout).allocate_batch(0.7 * wrench)
    ratio = batch.bound / batch.power
    assert ratio.max() <= 1.0 and np.median(ratio) > (0.9 if power else 0.999)
    assert Allocator(layout, robust=5.0).allocate(0.7 * wrench[0]).bound is None
