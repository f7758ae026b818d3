"""Hard geometries are what their names say."""

import math

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.evaluation.hard_geometry import CLUSTER_M, MOVED_M, TURNED_RAD
from finlab.evaluation.splits import Case, make_split
from finlab.layout import Layout, load_layout
from finlab.physics import plant_of


def _layouts(split: str) -> list[Layout]:
    return [case.layout for case in make_split(split, 24, 1, 3)]


def _positions(layout: Layout) -> Array:
    return np.array([fin.position for fin in layout.fins])


def test_perturbed_robots_are_the_papers_within_a_hands_breadth() -> None:
    originals = [load_layout(name) for name in "ABCD"]
    found = set()
    for layout in _layouts("perturbed"):
        near = [
            robot.name
            for robot in originals
            if robot.names == layout.names
            and np.abs(_positions(robot) - _positions(layout)).max() <= MOVED_M
            and all(
                abs(math.remainder(a.mounting_angle - b.mounting_angle, math.tau)) <= TURNED_RAD
                for a, b in zip(robot.fins, layout.fins, strict=True)
            )
        ]
        assert near and layout.fins != load_layout(near[0]).fins
        found |= set(near)
    assert found == set("ABCD")


def test_shafts_are_parallel() -> None:
    for layout in _layouts("parallel"):
        turns = [
            math.remainder(fin.mounting_angle - layout.fins[0].mounting_angle, math.pi) for fin in layout.fins
        ]
        assert np.abs(turns).max() < 1e-12


def test_collinear_fins_lie_on_a_line() -> None:
    for layout in _layouts("collinear"):
        apart = _positions(layout) - _positions(layout)[0]
        assert layout.n_fins >= 3 and np.linalg.svd(apart, compute_uv=False)[1] < 1e-12


def test_clusters_are_small() -> None:
    for layout in _layouts("clustered"):
        assert np.ptp(_positions(layout), axis=0).max() <= 2 * CLUSTER_M


def test_coincident_fins_share_their_place_and_their_shafts_line() -> None:
    turns = set()
    for layout in _layouts("coincident"):
        first, second, *_ = layout.fins
        turn = np.mod(second.mounting_angle - first.mounting_angle, 2 * np.pi)
        assert first.position == second.position
        turns.add(round(float(min(turn, 2 * np.pi - turn)), 6))
    assert turns == {0.0, round(np.pi, 6)}


def test_stacked_pairs_are_one_above_the_other() -> None:
    for layout in _layouts("stacked"):
        fins = layout.fins
        assert len(fins) in (4, 6, 8)
        for up, down in zip(fins[::2], fins[1::2], strict=True):
            assert up.position[:2] == down.position[:2] and up.position[2] == -down.position[2] > 0.0
            assert up.mounting_angle == down.mounting_angle


@pytest.mark.parametrize(("split", "extent", "strength"), [("big", 3.0, 100.0), ("tiny", 0.05, 6.0**-4)])
def test_robots_of_another_size(split: str, extent: float, strength: float) -> None:
    """A blade ten times as long at a tenth of the frequency pushes a hundred times as much."""
    cases = make_split(split, 24, 1, 3)
    reach = max(np.abs(_positions(case.layout)).max() for case in cases)
    assert 0.9 * extent < reach <= extent

    def largest(case: Case) -> float:
        plant = plant_of(case.layout)
        return float(plant.thrust(plant.upper[:, 0], plant.upper[:, 1])[0])

    usual = largest(make_split("id", 1, 1, 3)[0])
    assert largest(cases[0]) == pytest.approx(strength * usual)
    assert all(case.sigma is not None for case in cases)
