"""Known uncertainties of a robot's actuators: how far their forces may be from laws and tables.

A layout says it (`uncertainty` of an actuator); where it does not, a table tells by its own standard
deviations and by the error of its grid.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from finlab.actuators.fin.fin_laws import TableLaw, file_stamps, make_law
from finlab.arrays import Array
from finlab.layout.fin import Fin
from finlab.layout.layout import Actuator, Layout
from finlab.layout.thrust_model import PowerTable
from finlab.uncertainty.table_error import GridUncertainty, grid_uncertainty, thrust_table_error

OF_ONE_TABLE = 0.5
"""Share of the variance that actuators with one table have together: alike commands have alike errors."""


@dataclass(frozen=True)
class Known:
    """What is known of one actuator's force."""

    share: float
    """Standard deviation along each own direction, as a share of the force."""
    floor: float = 0.0
    """The part of it that is there at any force [N]."""
    common: Hashable = None
    """Source of the error, the same for those that err together; None for one that errs by itself."""
    correlation: float = 1.0
    """Share of the variance that these have together."""
    table: GridUncertainty | None = None
    """Tells the deviation at each command, in place of `share` and `floor`."""

    def deviation(self, command: Array, size: Array) -> Array:
        """Returns the standard deviation (N, 2) [N] along each own direction of the force, and along a fin's
        shaft, at commands (N, 3) that give forces of a size (N,) [N]."""
        if self.table is not None:
            return self.table.deviation(command)
        own = np.hypot(self.share * size, self.floor)
        return np.stack([own, np.zeros_like(own)], axis=-1)


def uncertainties(layout: Layout) -> tuple[Known | None, ...]:
    """Returns what is known of each actuator, None where its law is exact; a `DataError` at a bad table."""
    return _known(layout, file_stamps(layout))


@lru_cache(maxsize=256)
def _known(layout: Layout, stamps: tuple[tuple[int, int] | None, ...]) -> tuple[Known | None, ...]:
    result = tuple(map(_of, layout.actuators))
    return tuple(own if own and (own.table or own.share or own.floor) else None for own in result)


def _of(part: Actuator) -> Known | None:
    said = part.uncertainty
    if said is not None:
        return Known(said.share, said.floor, said.common, said.correlation)
    if isinstance(part, Fin):
        law = make_law(part.model)
        if not isinstance(law, TableLaw):
            return None
        known = grid_uncertainty(law)
        return Known(known.uncertain_share, 0.0, part.model, OF_ONE_TABLE, known)
    model = getattr(part, "model", None)
    if not isinstance(model, PowerTable):
        return None
    return Known(*thrust_table_error(model), model, OF_ONE_TABLE)
