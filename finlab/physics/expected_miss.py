"""Distance of a robot's wrench from what its plant says, by what is uncertain of its actuators.

Each actuator errs along its force; fins and turning thrusters by as much across it, and fins along
their shafts where their table tells. With d the wrench of one standard deviation of such an error,
the variance of the wrench is the sum of d^2 over all that errs by itself; of actuators that err
together it is the square of the sum, for their common share of the variance.

A layout says what is uncertain (`uncertainty` of an actuator); where it does not, a table tells by
its own standard deviations and by the error of its grid.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from finlab.actuators.actuator import Actuator
from finlab.actuators.fin.fin import Fin
from finlab.actuators.fin.fin_laws import make_law
from finlab.actuators.fin.table_law import TableLaw
from finlab.actuators.thrust_model import PowerTable
from finlab.arrays import Array
from finlab.layout.effectiveness import body_force
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant
from finlab.physics.table_error import GridUncertainty, grid_uncertainty, thrust_table_error

OF_ONE_TABLE = 0.5
"""Share of the variance that actuators with one table have together: alike commands have alike
errors."""


@dataclass(frozen=True)
class ForceError:
    """Model of the error of one actuator's force.

    Args:
        share: standard deviation along each own axis over the force [1].
        floor: part of it that is there at any force [N].
        common: source of the error, the same for those that err together; None for an actuator
            whose error is independent.
        correlation: share of the variance that these have together [1].
        table: standard deviations at each command, in place of `share` and `floor`.
    """

    share: float
    floor: float = 0.0
    common: Hashable = None
    correlation: float = 1.0
    table: GridUncertainty | None = None

    def deviation(self, command: Array, size: Array) -> Array:
        """Returns the standard deviation (N, 2) [N] along each own direction of the force, and
        along a fin's shaft, at commands (N, 3) that give forces of a size (N,) [N]."""
        if self.table is not None:
            return self.table.deviation(command)
        own = np.hypot(self.share * size, self.floor)
        return np.stack([own, np.zeros_like(own)], axis=-1)


def uncertainties(layout: Layout) -> tuple[ForceError | None, ...]:
    """Returns what is known of each actuator, None where its law is exact; a `DataError` at a bad
    table."""
    return _known(layout, layout.stamps)


@lru_cache(maxsize=256)
def _known(
    layout: Layout, stamps: tuple[tuple[int, int] | None, ...]
) -> tuple[ForceError | None, ...]:
    result = tuple(map(_of, layout.actuators))
    return tuple(own if own and (own.table or own.share or own.floor) else None for own in result)


def _of(part: Actuator) -> ForceError | None:
    said = part.uncertainty
    if said is not None:
        return ForceError(said.share, said.floor, said.common, said.correlation)
    if isinstance(part, Fin):
        law = make_law(part.model)
        if not isinstance(law, TableLaw):
            return None
        known = grid_uncertainty(law)
        return ForceError(known.uncertain_share, 0.0, part.model, OF_ONE_TABLE, known)
    model = getattr(part, "model", None)
    if not isinstance(model, PowerTable):
        return None
    return ForceError(*thrust_table_error(model), model, OF_ONE_TABLE)


class Source(NamedTuple):
    """What actuators that err together, or one by itself, add."""

    actuators: tuple[str, ...]
    """Names of the actuators."""
    variance: Array
    """Of the wrench (N, 6) [N^2, (N m)^2]."""

    @property
    def words(self) -> str:
        """The actuators in a sentence."""
        *others, last = self.actuators
        return f"{', '.join(others)} and {last} (which err together)" if others else last


def expected_miss(plant: Plant, command: Array) -> Array:
    """Returns the standard deviation (N, 6) [N, N m] of the wrench of commands (N, n, 3); lost ones
    (NaN) add nothing."""
    variances = [source.variance for source in sources_of_miss(plant, command)]
    return np.sqrt(sum(variances, np.zeros((len(command), 6))))


def sources_of_miss(plant: Plant, command: Array) -> list[Source]:
    """Returns what adds to it, as `expected_miss`."""
    layout = plant.layout
    known = uncertainties(layout)
    if not any(known) and plant.interaction is None:
        return []
    forces = plant.forces(command)
    groups: dict[object, list[int]] = {}
    for i, own in enumerate(known):
        if own is not None and not np.isnan(command[:, i, 0]).all():
            groups.setdefault(i if own.common is None else (own.common,), []).append(i)
    sources = []
    for places in groups.values():
        together = np.zeros((len(command), 3, 6))
        alone = np.zeros((len(command), 6))
        for i in places:
            own = known[i]
            assert own is not None
            wrench = _errors(layout, i, own, command[:, i], forces[:, i]) @ plant.effectiveness[i]
            together += np.sqrt(own.correlation) * wrench
            alone += (1.0 - own.correlation) * (wrench**2).sum(axis=1)
        names = tuple(layout.names[i] for i in places)
        sources.append(Source(names, (together**2).sum(axis=1) + alone))
    if plant.interaction is not None:
        deviation = plant.interaction.deviation(body_force(forces, layout.frames))
        sources.append(Source(("what the jets take",), deviation**2))
    return sources


def _errors(layout: Layout, place: int, known: ForceError, command: Array, force: Array) -> Array:
    """One standard deviation of the errors (N, 3, 3) [N] of an actuator, each a force in its own
    frame: along its force (N, 3), across it and along the shaft."""
    lost = np.isnan(command[:, 0])
    deviation = known.deviation(np.nan_to_num(command), np.linalg.norm(force, axis=-1))
    deviation = np.where(lost[:, None], 0.0, deviation)
    part = layout.actuators[place]
    acting = force if len(part.KIND.push_rows) == 1 else force * [0.0, 1.0, 1.0]
    size = np.linalg.norm(acting, axis=-1, keepdims=True)
    rest = np.eye(3)[part.KIND.push_rows[0]]  # where it gives no force
    along = np.where(size > 0.0, acting / np.maximum(size, 1e-300), rest)
    errors = np.zeros((len(command), 3, 3))
    errors[:, 0] = deviation[:, :1] * along
    if acting is not force:
        errors[:, 1, 1], errors[:, 1, 2] = -errors[:, 0, 2], errors[:, 0, 1]
        errors[:, 2, 0] = deviation[:, 1]
    return errors
