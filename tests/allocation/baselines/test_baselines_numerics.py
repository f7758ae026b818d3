"""The numerical parts of the model-based methods against independent references."""

import numpy as np

from finlab.layout import random_layout
from finlab.physics import plant_of

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35])


def test_feasible_wraps_full_turns_and_clips_the_rest() -> None:
    rng = np.random.default_rng(1)
    layout = random_layout(rng, n_fins=5, limits="varied")
    plant = plant_of(layout)
    wild = rng.normal(scale=20.0, size=(100, 5, 3))
    tame = plant.feasible(wild)
    assert (tame >= plant.lower).all() and (tame <= plant.upper).all()
    turns = (tame - wild)[:, plant.full_turn, 2] / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)
    np.testing.assert_array_equal(plant.feasible(tame), tame)
