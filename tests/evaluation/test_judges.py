"""Baselines held against conditions that need no second solver: QP answers against their KKT conditions."""

import numpy as np
import pytest

from finlab.allocation.baselines.qp import LinearMap, Qp
from finlab.evaluation.splits import make_split
from finlab.networks.normalization import Normalization
from finlab.physics import plant_of

NORMALIZATION = Normalization(np.zeros(6), np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35]))


@pytest.mark.parametrize("split", ["id", "ood-fins", "limits", "near-singular"])
def test_qp_answers_meet_their_kkt_conditions(split: str) -> None:
    """Stationary where free, pushing outwards where held."""
    method = Qp(NORMALIZATION)
    for case in make_split(split, 3, 8, 31):
        plant = plant_of(case.layout)
        linear = LinearMap(plant, NORMALIZATION.std)
        # Before directions are wrapped: at the seam both ends of the box are one direction.
        command = method._commands(plant, case.targets, seed=0)
        step = ((command - linear.reference) / plant.width).reshape(len(command), -1)[:, linear.free]
        wanted = (case.targets - linear.wrench) / NORMALIZATION.std
        gradient = (step @ linear.matrix.T - wanted) @ linear.matrix + method.settings.regularization * step
        # A step along the negative gradient, brought back into the box, must not move.
        residual = np.abs(step - np.clip(step - gradient, -0.5, 0.5)).max()
        assert residual < 1e-8 * np.abs(wanted @ linear.matrix).max()
