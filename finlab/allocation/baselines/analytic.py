"""Method `analytic`: force-space pseudo-inverse, each actuator's force turned into its cheapest command."""

from finlab.allocation.baselines.model_based import ModelBased
from finlab.arrays import Array


class Analytic(ModelBased):
    """Pseudo-inverse of the forces; failed actuators have left with their columns.

    Rows are scaled by sigma and columns by each actuator's largest force. An actuator gives its force by the
    cheapest command there is for that size and direction. What does not fit is clipped one by one, the rest
    is not redistributed.
    """

    name = "analytic"
    takes = "any actuator"

    def _commands(self, targets: Array, seed: int) -> Array:
        return self._inverse.command(targets)
