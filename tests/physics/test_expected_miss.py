"""What a robot's wrench may be off by, against sampled errors of the actuators' forces."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.actuators.fin.table_law import TableLaw
from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerTable
from finlab.actuators.thruster import Thruster
from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.layout import FinModelSpec, Layout, Uncertainty, load_layout
from finlab.physics import make_law, plant_of, write_table
from finlab.physics.expected_miss import expected_miss
from finlab.physics.table_error import grid_uncertainty, thrust_table_error
from tests.random_robots import load, random_flow, random_robot

N_DRAWS = 20_000
"""How many errors of the forces are sampled."""


def with_uncertainty(layout: Layout, rng: np.random.Generator) -> Layout:
    """The robot with uncertain actuators, some by themselves, some together, one not at all."""
    parts = []
    for part in layout.actuators:
        common = rng.choice(np.array([None, "bench", "tank"]))
        own = Uncertainty(rng.uniform(0, 0.2), rng.uniform(0, 0.1), common, rng.uniform(0, 1))
        parts.append(replace(part, uncertainty=own if len(parts) else None))
    return replace(layout, actuators=tuple(parts))


def sampled_miss(
    layout: Layout, force: Array, effectiveness: Array, rng: np.random.Generator
) -> Array:
    """Standard deviation (6,) of the wrench where forces (n, 3) err at random."""
    shared = {name: rng.standard_normal((N_DRAWS, 2)) for name in ("bench", "tank")}
    miss = np.zeros((N_DRAWS, 6))
    for i, part in enumerate(layout.actuators):
        told = part.uncertainty
        if told is None:
            continue
        own = rng.standard_normal((N_DRAWS, 2))
        if told.common:
            own = (
                np.sqrt(1 - told.correlation) * own
                + np.sqrt(told.correlation) * shared[told.common]
            )
        size = np.linalg.norm(force[i])
        own = own * np.sqrt((told.share * size) ** 2 + told.floor**2)
        along = force[i] / size
        across = np.cross([1.0, 0.0, 0.0], along)
        if isinstance(part, Thruster | Rudder):
            across *= 0.0
        miss += (own[:, :1] * along + own[:, 1:] * across) @ effectiveness[i]
    return np.asarray(np.sqrt(np.mean(miss**2, axis=0)))


@pytest.mark.parametrize(
    "kind", ["thrusters", "azimuths", "fins any shaft", "rudders", "mixed", "all"]
)
def test_the_expected_miss_is_that_of_sampled_errors(kind: str) -> None:
    rng = np.random.default_rng(11)
    layout = with_uncertainty(load(random_robot(kind, 1, 5)), rng)
    flow = random_flow(kind, 1, 5)
    plant = plant_of(layout).at(flow)
    command = plant.sample(rng, (3,))
    expected = expected_miss(plant, command)
    for row, found in zip(command, expected, strict=True):
        truth = sampled_miss(layout, plant.forces(row), plant.effectiveness, rng)
        np.testing.assert_allclose(found, truth, rtol=0.03, atol=1e-9)


def test_answers_tell_it_for_one_and_for_many_and_what_to_measure_next() -> None:
    layout = load_layout("bluerov2_heavy")
    exact = Allocator(layout).allocate([20.0, 0, 0, 0, 0, 0])
    assert exact.expected_error == 0.0 and not exact.notes
    for name in layout.names:
        share = 0.3 if name == "rear_left" else 0.01
        layout = layout.replace_actuator(name, uncertainty=Uncertainty(share))
    allocator = Allocator(layout)
    one = allocator.allocate([20.0, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(one.command, exact.command)
    place = layout.index("rear_left")
    push = one.forces[place] @ np.array(layout.actuators[place].axis)
    by_hand = 0.3 * abs(push * plant_of(layout).effectiveness[place, 0])
    np.testing.assert_allclose(one.expected_miss, by_hand, rtol=0.01, atol=0.06)
    assert one.expected_error == pytest.approx(np.linalg.norm(one.expected_miss / allocator.scale))
    (note,) = one.notes
    assert "measure rear_left next" in note
    many = allocator.allocate_batch([[20.0, 0, 0, 0, 0, 0], [0.0, 0, 0, 0, 0, 0]])
    np.testing.assert_allclose(many.expected_miss[0], one.expected_miss, rtol=1e-6)
    assert many.expected_error.shape == (2,) and many.expected_error[1] == 0.0
    lost = allocator.allocate([20.0, 0, 0, 0, 0, 0], lost=["rear_left"])
    assert lost.expected_error < 0.1 * one.expected_error


@pytest.mark.parametrize("grid", [(5, 5, 8), (8, 9, 12), (13, 13, 18)])
@pytest.mark.parametrize("noise", [0.0, 0.03])
@pytest.mark.parametrize("kind", ["drag", "lighthill", "soft"])
def test_a_table_knows_the_error_of_its_grid(
    grid: tuple[int, ...], noise: float, kind: str
) -> None:
    rng = np.random.default_rng(3)
    ends = ((0.05, 0.6), (0.1, 2.1))
    axes = [np.linspace(*end, count) for end, count in zip(ends, grid, strict=False)]
    axes.append(np.linspace(-np.pi, np.pi, grid[2], endpoint=False))
    law = make_law(FinModelSpec(kind))
    force = law.force(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
    table = TableLaw(
        axes, np.asarray(force * (1.0 + noise * rng.standard_normal(force.shape))), True
    )
    command = np.array([0.05, 0.1, -np.pi]) + rng.random((500, 3)) * [0.55, 2.0, 2 * np.pi]
    error = (table.force(command) - law.force(command))[:, 1:]
    ratio = error / grid_uncertainty(table).deviation(command)[:, :1]
    assert 0.4 < np.sqrt(np.mean(ratio**2)) < 2.5


def test_deviations_in_a_table_reach_the_answer(tmp_path: Path) -> None:
    path = tmp_path / "fin.csv"
    axes = (np.linspace(0, 0.6, 9), np.linspace(0, 2.1, 9), np.linspace(-3, 3, 19))
    write_table(path, make_law(FinModelSpec("drag")), *axes)
    lines = path.read_text().splitlines()
    path.write_text(
        "\n".join([f"{lines[0]},sFx,sFy,sFz", *(f"{line},0,0.2,0.2" for line in lines[1:])])
    )
    layout = load_layout("A").replace_actuator(
        "front_left", model=FinModelSpec("table", (("path", str(path)),))
    )
    answer = Allocator(layout).allocate([1.0, 0, 0, 0, 0, 0])
    assert np.linalg.norm(answer.expected_miss[:3]) == pytest.approx(np.sqrt(2) * 0.2, rel=0.05)
    told = layout.replace_actuator("front_left", uncertainty=Uncertainty())
    assert Allocator(told).allocate([1.0, 0, 0, 0, 0, 0]).expected_error == 0.0, (
        "the layout has the last word"
    )


def test_rows_of_a_thrusters_table_tell_how_far_apart_they_are() -> None:
    def table(count: int, noise: float) -> PowerTable:
        rng = np.random.default_rng(2)
        command = np.linspace(-1.0, 1.0, count)
        force = np.sort(
            50.0 * command * np.abs(command) * (1.0 + noise * rng.standard_normal(count))
        )
        return PowerTable(tuple(zip(command, force, np.abs(force) ** 1.5, strict=True)))

    coarse, fine, noisy = (
        thrust_table_error(table(*each))[0] for each in ((11, 0), (101, 0), (101, 0.02))
    )
    assert fine < 0.1 * coarse and 0.01 < noisy < 0.03


def test_a_grid_of_two_lines_says_that_it_cannot_tell() -> None:
    axes = [
        np.array([0.1, 0.6]),
        np.linspace(0.1, 2.1, 5),
        np.linspace(-np.pi, np.pi, 12, endpoint=False),
    ]
    force = make_law(FinModelSpec("drag")).force(
        np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    )
    assert grid_uncertainty(TableLaw(axes, force, True)).error.few == (0,)


def test_a_lost_actuator_is_not_to_be_measured() -> None:
    layout = load_layout("A")
    for name in layout.names:
        layout = layout.replace_actuator(name, uncertainty=Uncertainty(0.1, common="tank"))
    (note,) = Allocator(layout).allocate([1.0, 0, 0.5, 0, 0, 0], lost=["front_left"]).notes[:1]
    assert "measure front_right, back_left and back_right (which err together) next" in note
