"""How far each axis can go with the others held, against linear programmes."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import linprog

from finlab.forces.force_sets import SCALE, force_sets
from finlab.forces.reach import axis_ranges
from finlab.layout import Layout

Layouts = Callable[[str], Layout]
CORNERS = 96


def ranges_by_polygons(layout: Layout, wrench: list[float], failed: tuple[str, ...]) -> np.ndarray:
    """Ranges (6, 2) [N, N m] with each fin's disc as a polygon within it; NaN where there are none."""
    sets = force_sets(layout, failed)
    n = sets.radius.shape[1]
    turn = sets.middle[0, :, None] + sets.half[0, :, None] * np.linspace(-1, 1, CORNERS)
    force = sets.radius[0, :, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    corners = np.einsum("npc,nck->npk", force, sets.effectiveness[0]).reshape(-1, 6)
    share = np.kron(np.eye(n), np.ones(CORNERS))
    found = np.full((6, 2), np.nan)
    for k in range(6):
        held = [j for j in range(6) if j != k]
        for column, sign in enumerate((-1.0, 1.0)):
            result = linprog(
                -sign * corners[:, k],
                A_ub=share,
                b_ub=np.ones(n),
                A_eq=corners[:, held].T,
                b_eq=(np.array(wrench) / SCALE)[held],
            )
            if result.status == 0:
                found[k, column] = -sign * result.fun * SCALE[k]
    return found


@pytest.mark.parametrize(
    ("name", "wrench", "failed"),
    [
        ("ucat", [1.2, 0, 0, 0, 0, 0.25], ()),
        ("ucat", [1.2, 0, 0, 0, 0, 0.25], ("front_left",)),
        ("penta", [5, 1, -3, 0.1, 0.2, 0.3], ()),
        ("restricted", [0, 0, 0, 0, 0, 0], ()),
        ("no_yaw", [1.2, 0, 0, 0, 0, 0.25], ()),
    ],
)
def test_ranges_are_those_of_linear_programmes(
    shipped: Layouts, name: str, wrench: list[float], failed: tuple[str, ...]
) -> None:
    layout = shipped(name)
    low, high = axis_ranges(layout, wrench, failed)
    expected = ranges_by_polygons(layout, wrench, failed)
    assert low == pytest.approx(expected[:, 0], rel=2e-3, abs=2e-3, nan_ok=True)
    assert high == pytest.approx(expected[:, 1], rel=2e-3, abs=2e-3, nan_ok=True)
