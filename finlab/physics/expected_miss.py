"""Distance of a robot's wrench from what its plant says, by what is uncertain of its actuators.

Each actuator errs along its force; fins and turning thrusters by as much across it, and fins along their
shafts where their table tells. With d the wrench of one standard deviation of such an error, the variance of
the wrench is the sum of d^2 over all that errs by itself; of actuators that err together it is the square of
the sum, for their common share of the variance.
"""

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout.layout import Layout
from finlab.layout.propellers import Thruster
from finlab.layout.rudder import Rudder
from finlab.physics.plant import Plant
from finlab.uncertainty.known import Known, uncertainties


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
    """Returns the standard deviation (N, 6) [N, N m] of the wrench of commands (N, n, 3); failed ones (NaN)
    add nothing."""
    variances = [source.variance for source in sources_of_miss(plant, command)]
    return np.sqrt(sum(variances, np.zeros((len(command), 6))))


def sources_of_miss(plant: Plant, command: Array) -> list[Source]:
    """Returns what adds to it, as `expected_miss`."""
    layout = plant.layout
    known = uncertainties(layout)
    if not any(known):
        return []
    forces = plant.forces(command)
    groups: dict[object, list[int]] = {}
    for i, own in enumerate(known):
        if own is not None and not np.isnan(command[:, i, 0]).all():
            groups.setdefault(i if own.common is None else (own.common,), []).append(i)
    sources = []
    for places in groups.values():
        together, alone = np.zeros((len(command), 3, 6)), np.zeros((len(command), 6))
        for i in places:
            own = known[i]
            assert own is not None
            wrench = _errors(layout, i, own, command[:, i], forces[:, i]) @ plant.effectiveness[i]
            together += np.sqrt(own.correlation) * wrench
            alone += (1.0 - own.correlation) * (wrench**2).sum(axis=1)
        names = tuple(layout.names[i] for i in places)
        sources.append(Source(names, (together**2).sum(axis=1) + alone))
    return sources


def _errors(layout: Layout, place: int, known: Known, command: Array, force: Array) -> Array:
    """One standard deviation of the errors (N, 3, 3) [N] of an actuator, each a force in its own frame: along
    its force (N, 3), across it and along the shaft."""
    failed = np.isnan(command[:, 0])
    deviation = known.deviation(np.nan_to_num(command), np.linalg.norm(force, axis=-1))
    deviation = np.where(failed[:, None], 0.0, deviation)
    part = layout.actuators[place]
    acting = force if isinstance(part, Thruster | Rudder) else force * [0.0, 1.0, 1.0]
    size = np.linalg.norm(acting, axis=-1, keepdims=True)
    rest = [float(k == _AXIS.get(type(part), 1)) for k in range(3)]
    along = np.where(size > 0.0, acting / np.maximum(size, 1e-300), rest)
    errors = np.zeros((len(command), 3, 3))
    errors[:, 0] = deviation[:, :1] * along
    if acting is not force:
        errors[:, 1, 1], errors[:, 1, 2] = -errors[:, 0, 2], errors[:, 0, 1]
        errors[:, 2, 0] = deviation[:, 1]
    return errors


_AXIS = {Thruster: 0, Rudder: 2}
"""Own axis along which actuators err where they give no force, if it is not the second one."""
