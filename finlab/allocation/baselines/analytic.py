"""Method `analytic`: force-space pseudo-inverse, each fin's force looked up in its own envelope."""

from functools import lru_cache
from typing import Unpack

from finlab.allocation.aim import Aim
from finlab.allocation.baselines.model_based import CACHE_SIZE, ModelBased
from finlab.allocation.baselines.pseudo_inverse import RCOND, PseudoInverse
from finlab.arrays import Array
from finlab.inference.normalization import Normalization
from finlab.physics import Plant


class Analytic(ModelBased):
    """Pseudo-inverse of the planar forces; failed fins have left with their two columns.

    Rows are scaled by sigma and columns by each fin's largest force. A fin gives its force by the cheapest
    command there is for that size and direction. What does not fit is clipped fin by fin, the rest is not
    redistributed.

    Args:
        normalization: sigma scales the rows.
        rcond: singular values below this share of the largest count as zero.
        aim: see `ModelBased`.
    """

    name = "analytic"

    def __init__(self, normalization: Normalization, *, rcond: float = RCOND, **aim: Unpack[Aim]) -> None:
        super().__init__(normalization, **aim)
        self.rcond = rcond
        self._inverse = lru_cache(CACHE_SIZE)(
            lambda plant: PseudoInverse(plant, normalization.std, self.aim, rcond)
        )

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        return self._inverse(plant).command(targets)
