"""Method `analytic`: force-space pseudo-inverse, each fin's force looked up in its own envelope."""

from dataclasses import dataclass

from finlab.allocation.baselines.model_based import ModelBased
from finlab.allocation.baselines.pseudo_inverse import RCOND, PseudoInverse
from finlab.arrays import Array
from finlab.physics import Plant


@dataclass(eq=False, repr=False, kw_only=True)
class Analytic(ModelBased):
    """Pseudo-inverse of the planar forces; failed fins have left with their two columns.

    Rows are scaled by sigma and columns by each fin's largest force. A fin gives its force by the cheapest
    command there is for that size and direction. What does not fit is clipped fin by fin, the rest is not
    redistributed.
    """

    name = "analytic"
    rcond: float = RCOND
    """Singular values below this share of the largest count as zero."""

    def _invert(self, plant: Plant) -> PseudoInverse:
        return PseudoInverse(plant, self.normalization.std, self.aim, self.rcond)

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        return self._inverse(plant).command(targets)
