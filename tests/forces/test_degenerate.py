"""Degenerate but valid robots: coincident, parallel, at the origin, fixed in direction, thrust or both."""

import numpy as np
import pytest

from finlab.analysis import attainable_set, authority, least_power
from finlab.forces.fin_sets import fin_sets
from finlab.forces.nearest import nearest, nearest_along, nearest_in_turn
from finlab.forces.reach import axis_ranges
from finlab.layout import Fin, FinModelSpec, Layout, Limits

PINNED = Limits(zero_direction=(0.7, 0.7))
CONSTANT = Limits((0.4, 0.4), (1.5, 1.5), (-2.2, 2.2))
GIANT = FinModelSpec("drag", (("area", 1.0), ("lever", 0.8)))


def fins(
    places: list[tuple[float, float, float]], angle: float, limits: Limits, model: FinModelSpec | None = None
) -> Layout:
    spec = FinModelSpec() if model is None else model
    return Layout("d", tuple(Fin(f"f{i}", place, angle, limits, spec) for i, place in enumerate(places)))


ROBOTS = {
    "one": fins([(0.2, 0.1, 0.0)], 0.3, Limits()),
    "coincident": fins([(0.2, 0.1, 0.0)] * 4, 0.3, Limits()),
    "at the origin": fins([(0.0, 0.0, 0.0)] * 3, 1.0, PINNED),
    "parallel": fins([(0.2, 0.1, 0.0), (-0.2, 0.1, 0.0), (0.2, -0.1, 0.1)], 0.5, CONSTANT),
    "far and strong": fins([(5.0, 3.0, 0.0), (-8.0, 1.0, 0.5), (1.0, -9.0, 0.0)], 0.1, Limits(), GIANT),
    "pinned": fins([(0.2, 0.1, 0.0), (-0.2, 0.1, 0.0), (0.2, -0.1, 0.1)], -2.0, PINNED, GIANT),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ROBOTS)
def test_every_question_has_a_finite_answer(name: str) -> None:
    layout = ROBOTS[name]
    held = authority(layout)
    assert np.isfinite([*held.largest, *held.most_negative, held.weakest, held.isotropy]).all()
    strongest = max(held.singular_values)
    assert held.gap <= 1e-6 * strongest
    assert least_power(layout, np.zeros((1, 6)))[0] >= 0.0
    assert np.isnan(least_power(layout, [[0, 0, 0, 0, 0, 1e6]], failed=layout.names[1:])).all()
    low, high = axis_ranges(layout, np.zeros(6))
    assert (low <= 1e-6 * strongest).all() and (high >= -1e-6 * strongest).all()
    for alone in (True, False):
        assert np.isfinite(attainable_set(layout, "torque", alone=alone).vertices).all()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [0.0, 1e-9, 1.0, 1e6])
@pytest.mark.parametrize("name", ROBOTS)
def test_policies_answer_whatever_is_asked(name: str, size: float) -> None:
    sets = fin_sets(ROBOTS[name])
    target = size * np.random.default_rng(0).standard_normal(6)
    groups = [np.arange(6) < 2, np.arange(6) >= 2]
    in_turn = nearest_in_turn(sets, target, groups)
    # What is left of a zero target is the root of the solver's gap.
    rounding = 1e-5 * np.linalg.norm(sets.full_columns(), axis=-1).sum()
    for found in (nearest(sets, target[None]), nearest_along(sets, target), in_turn):
        assert np.isfinite(found.wrench).all()
        assert (np.linalg.norm(found.force, axis=-1) <= sets.radius * (1 + 1e-9)).all()
        if found is not in_turn:  # an earlier group may be served at the cost of later ones
            missing = np.linalg.norm(target - found.wrench)
            assert missing <= np.linalg.norm(target) * (1 + 1e-6) + rounding
