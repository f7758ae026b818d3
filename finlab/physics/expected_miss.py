"""Standard deviation of a robot's true wrench about that of its plant, by the uncertainty of its
actuators.

Each actuator has an error along its force; fins and turning thrusters have one of the same size
across it, and fins one along their shafts where their force table gives its size. With d the wrench
of one standard deviation of such an error, independent errors add sum(d^2) to the variance of the
wrench. Actuators whose errors are correlated add (sum d)^2, for the correlated share of their
variance.

A layout gives the uncertainty (`uncertainty` of an actuator); where it does not, that of a table
follows from its own standard deviations and from the error of its grid. `Allocation.expected_miss`
and the report of an answer use this module.
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

CORRELATION_IN_TABLE = 0.5
"""Correlated share of the variance of actuators with one table [1]: similar commands have similar
errors."""
SMALLEST_NORM = 1e-300
"""Force below which a direction is not divided by it [N]; it only avoids 0 / 0."""


@dataclass(frozen=True)
class ForceError:
    """Model of the error of one actuator's force.

    Args:
        share: standard deviation along each own axis over the force [1].
        floor: part of it that is there at any force [N].
        common: source of the error, equal for actuators whose errors are correlated; None for an
            actuator whose error is independent.
        correlation: correlated share of the variance of actuators with one source [1].
        table: standard deviations at each command, in place of `share` and `floor`.
    """

    share: float
    floor: float = 0.0
    common: Hashable = None
    correlation: float = 1.0
    table: GridUncertainty | None = None

    @property
    def is_exact(self) -> bool:
        """Whether the model has no error at all."""
        return self.table is None and self.share == 0.0 and self.floor == 0.0

    def deviation(self, command: Array, size: Array) -> Array:
        """Returns standard deviations of the force.

        Args:
            command: commands (N, 3) of the actuator, as its kind has them.
            size: sizes (N,) of the forces that they give [N].

        Returns:
            (N, 2) [N]: along each own direction of the force, and along a fin's shaft.
        """
        if self.table is not None:
            return self.table.deviation(command)
        in_plane = np.hypot(self.share * size, self.floor)
        along_shaft = np.zeros_like(in_plane)
        return np.stack([in_plane, along_shaft], axis=-1)


def uncertainties(layout: Layout) -> tuple[ForceError | None, ...]:
    """Returns the error model of each actuator (n), None where its law is exact.

    Raises:
        DataError: a force table cannot be read.
    """
    return _error_models(layout, layout.stamps)


@lru_cache(maxsize=256)
def _error_models(
    layout: Layout, stamps: tuple[tuple[int, int] | None, ...]
) -> tuple[ForceError | None, ...]:
    """As `uncertainties`; the stamps of files are part of the cache's key."""
    models = []
    for actuator in layout.actuators:
        model = _error_model(actuator)
        models.append(None if model is None or model.is_exact else model)
    return tuple(models)


def _error_model(actuator: Actuator) -> ForceError | None:
    """The error model by the layout, or else by the actuator's table; None where neither has
    one."""
    stated = actuator.uncertainty
    if stated is not None:
        return ForceError(stated.share, stated.floor, stated.common, stated.correlation)
    if isinstance(actuator, Fin):
        law = make_law(actuator.model)
        if not isinstance(law, TableLaw):
            return None
        table = grid_uncertainty(law)
        return ForceError(table.uncertain_share, 0.0, actuator.model, CORRELATION_IN_TABLE, table)
    model = getattr(actuator, "model", None)
    if not isinstance(model, PowerTable):
        return None
    share, floor = thrust_table_error(model)
    return ForceError(share, floor, model, CORRELATION_IN_TABLE)


class Source(NamedTuple):
    """Contribution to the variance of actuators whose errors are correlated, or of a single
    one."""

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
    """Returns the standard deviation of the wrench of commands.

    Args:
        plant: the robot.
        command: commands (N, n, 3); a row of NaN is a lost actuator and adds nothing.

    Returns:
        (N, 6) [N, N m], body frame.
    """
    variances = [source.variance for source in sources_of_miss(plant, command)]
    return np.sqrt(sum(variances, np.zeros((len(command), 6))))


def sources_of_miss(plant: Plant, command: Array) -> list[Source]:
    """Returns the contributions to the variance of `expected_miss`, which has the same arguments;
    none where all laws are exact."""
    layout = plant.layout
    models = uncertainties(layout)
    if not any(models) and plant.interaction is None:
        return []
    forces = plant.forces(command)
    sources = []
    for indices in _correlated_groups(models, command):
        correlated = np.zeros((len(command), 3, 6))
        independent = np.zeros((len(command), 6))
        for i in indices:
            model = models[i]
            assert model is not None
            errors = _force_errors(layout.actuators[i], model, command[:, i], forces[:, i])
            wrench = errors @ plant.effectiveness[i]
            correlated += np.sqrt(model.correlation) * wrench
            independent += (1.0 - model.correlation) * (wrench**2).sum(axis=1)
        names = tuple(layout.names[i] for i in indices)
        sources.append(Source(names, (correlated**2).sum(axis=1) + independent))
    if plant.interaction is not None:
        in_body = body_force(forces, layout.frames)
        deviation = plant.interaction.deviation(in_body, plant.met_by_all(None))
        sources.append(Source(("what the jets take",), deviation**2))
    return sources


def _correlated_groups(models: tuple[ForceError | None, ...], command: Array) -> list[list[int]]:
    """Indices of uncertain actuators that work in some of the commands (N, n, 3), those with one
    source of error in one group."""
    groups: dict[object, list[int]] = {}
    for i, model in enumerate(models):
        if model is None or np.isnan(command[:, i, 0]).all():
            continue
        # A tuple, so that no source can be taken for the index of an independent actuator.
        key = i if model.common is None else (model.common,)
        groups.setdefault(key, []).append(i)
    return list(groups.values())


def _force_errors(actuator: Actuator, model: ForceError, command: Array, force: Array) -> Array:
    """One standard deviation of each error of an actuator (N, 3 errors, 3) [N] in its own frame:
    along its force, across it and along the shaft, at commands (N, 3) and forces (N, 3) [N]."""
    is_lost = np.isnan(command[:, 0])
    deviation = model.deviation(np.nan_to_num(command), np.linalg.norm(force, axis=-1))
    deviation = np.where(is_lost[:, None], 0.0, deviation)
    push_rows = actuator.KIND.push_rows
    pushes_in_plane = len(push_rows) > 1
    in_plane = force * [0.0, 1.0, 1.0] if pushes_in_plane else force
    size = np.linalg.norm(in_plane, axis=-1, keepdims=True)
    direction_at_zero = np.eye(3)[push_rows[0]]
    direction = np.where(size > 0.0, in_plane / np.maximum(size, SMALLEST_NORM), direction_at_zero)
    errors = np.zeros((len(command), 3, 3))
    errors[:, 0] = deviation[:, :1] * direction
    if pushes_in_plane:
        # Across: the error along the force, turned by 90 deg about the first own axis.
        errors[:, 1, 1] = -errors[:, 0, 2]
        errors[:, 1, 2] = errors[:, 0, 1]
        errors[:, 2, 0] = deviation[:, 1]
    return errors


def miss_cost_of(layout: Layout, wrench_scale: Array, robust: float) -> Array | None:
    """Returns what the expected miss of actuators costs.

    Args:
        layout: the robot of n actuators.
        wrench_scale: (6,) [N, N m].
        robust: what a miss of 1 % of the wrench scale costs [W], growing with its square.

    Returns:
        Cost (n, 6) [W, W/m^2 per N^2] of a squared force for the squared effectiveness along each
        axis; None where nothing costs anything.

    Raises:
        DataError: a force table cannot be read.
    """
    shares = np.array([0.0 if own is None else own.share for own in uncertainties(layout)])
    if not shares.any():
        return None
    return np.multiply.outer(robust * shares**2, (0.01 * wrench_scale) ** -2.0)
