"""Fins that hang still: plates in the flow, by hand."""

import math

import numpy as np
import pytest

from finlab.layout import Fin, Layout
from finlab.layout.arrays import force_effectiveness
from finlab.sim.hanging_fin import DRAG_COEFFICIENT, HangingFins

AHEAD = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
SIDE = Layout("side", (Fin("left", (0.1, 0.2, 0.0), math.pi / 2),))
"""Its shaft points to the left, so that zero direction 0 lies along x (backwards) and pi/2 upwards."""
FULL = 0.5 * 1000.0 * DRAG_COEFFICIENT * 0.1 * 0.2
"""Force of U-CAT's plate over the squared speed [N s^2/m^2]."""


def wrench(layout: Layout, direction: float, water: np.ndarray) -> np.ndarray:
    force = HangingFins(layout).force(np.full(layout.n_fins, direction), water)
    columns = force_effectiveness(layout.position, layout.mounting_angle)
    return np.einsum("nk,nkw->w", force, columns)


def test_a_plate_drags_broadside_and_slips_edge_on() -> None:
    np.testing.assert_allclose(wrench(SIDE, 0.0, AHEAD), 0.0, atol=1e-12)
    braked = wrench(SIDE, math.pi / 2, AHEAD)
    assert braked[0] == pytest.approx(-FULL * 0.2**2) and braked[5] == pytest.approx(FULL * 0.2**2 * 0.2)
    half = wrench(SIDE, math.pi / 4, AHEAD)
    along = FULL * (0.2 * math.sin(math.pi / 4)) ** 2
    assert half[0] == pytest.approx(-along * math.sin(math.pi / 4))
    assert abs(half[2]) == pytest.approx(along * math.cos(math.pi / 4)), "it lifts or presses, too"


def test_drag_never_drives(layout_a: Layout) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        water = rng.standard_normal(6)
        assert wrench(layout_a, rng.uniform(-math.pi, math.pi), water) @ water < 0.0
