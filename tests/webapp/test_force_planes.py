"""Planes of force: the mixture is densest where its means are, and the picture stands upright."""

import numpy as np
import pytest

from finlab.allocation.solution import Insight
from webapp.scene.force_planes import PIXELS, density_on_plane, plane_picture


def _mixture(*means: tuple[float, float], weight: tuple[float, ...] = (1.0,), std: float = 0.08) -> Insight:
    count = len(means)
    return Insight(np.array(weight), np.array([means]), np.full((1, count), std), np.ones((1, 1)))


@pytest.mark.parametrize("mean", [(0.5, 0.0), (0.0, 0.4), (-0.3, -0.2)])
def test_the_mixture_is_densest_at_its_mean(mean: tuple[float, float]) -> None:
    density = density_on_plane(_mixture(mean), 0, 0.8)
    row, column = np.unravel_index(density.argmax(), density.shape)
    line = np.linspace(-0.8, 0.8, PIXELS)
    assert (line[column], -line[row]) == pytest.approx(mean, abs=0.02)
    assert density.max() == 1.0 and density.min() >= 0.0


def test_heavier_components_are_denser() -> None:
    density = density_on_plane(_mixture((0.5, 0.0), (-0.5, 0.0), weight=(0.8, 0.2)), 0, 0.8)
    middle = density[PIXELS // 2]
    assert middle[: PIXELS // 2].max() == pytest.approx(0.25, rel=0.05) and middle[PIXELS // 2 :].max() > 0.95


def test_a_picture_is_a_disc_with_a_rim() -> None:
    density = np.zeros((PIXELS, PIXELS))
    density[PIXELS // 2, PIXELS // 2] = 1.0
    picture = plane_picture(density, (10, 20, 30))
    assert picture.shape == (PIXELS, PIXELS, 4) and (picture[..., :3] == (10, 20, 30)).all()
    opacity = picture[..., 3].astype(int)
    assert opacity[0, 0] == 0 and opacity[PIXELS // 2, PIXELS // 2] > 150
    assert opacity[PIXELS // 2, :4].max() > 3 * opacity[PIXELS // 2, PIXELS // 4] > 0
    assert plane_picture(None, (0, 0, 0))[PIXELS // 2, PIXELS // 2, 3] < 30
