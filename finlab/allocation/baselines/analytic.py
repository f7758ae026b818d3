"""Method `analytic`: force-space pseudo-inverse, each actuator's force turned into its cheapest command."""

from dataclasses import dataclass
from functools import cached_property

from finlab.allocation.baselines.model_based import ModelBased
from finlab.allocation.baselines.pseudo_inverse import RCOND, PseudoInverse
from finlab.allocation.settings import Settings, number
from finlab.arrays import Array


@dataclass(frozen=True)
class AnalyticSettings(Settings):
    """Settings of method `analytic`."""

    rcond: float = number(RCOND, 0.0, 1.0, "singular values below this share of the largest count as zero")


class Analytic(ModelBased):
    """Pseudo-inverse of the forces; failed actuators have left with their columns.

    Rows are scaled by sigma and columns by each actuator's largest force. An actuator gives its force by the
    cheapest command there is for that size and direction. What does not fit is clipped one by one, the rest
    is not redistributed.
    """

    name = "analytic"
    takes = "any actuator"
    settings_class = AnalyticSettings
    settings: AnalyticSettings

    @cached_property
    def _inverse(self) -> PseudoInverse:
        return PseudoInverse(self.plant, self.sigma, rcond=self.settings.rcond)

    def _commands(self, targets: Array, seed: int) -> Array:
        return self._inverse.command(targets)
