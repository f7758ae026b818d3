"""The contract of an interaction: how the jets of a robot's actuators change its wrench.

A robot's layout names a model of interaction, a formula or a network
(`finlab.interaction.INTERACTIONS`). From the forces of all actuators it gives a further force at
the point of each, and so the wrench offset. The plant adds it. Forces are in the body frame;
derivatives are by the forces, not by the commands.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from finlab.arrays import AnyArray, Array
from finlab.core.library import library
from finlab.files.schema import Checked

DENSITY = 1000.0
"""Density of the water [kg/m^3]."""
STILL = 0.03
"""Speed of a jet below which it counts as none [m/s]; it keeps derivatives finite at rest."""
LEAST_AREA = 1e-12
"""Area added to each disc, so that an actuator without one divides by no zero [m^2]."""
CONSTANTS = 10
"""Numbers of the formula of jets that the core takes."""
STEP = 1e-30
"""Imaginary step of derivatives: those of smooth formulas are exact (Squire and Trapp, 1998)."""


class JetGeometry(NamedTuple):
    """The points and jets of n actuators, and the hull that jets may meet."""

    position: Array
    """Points where the forces act (n, 3), body frame [m]."""
    diameter: Array
    """Diameters (n,) of the jets where they begin [m]; 0 of an actuator without one."""
    advance: Array
    """Relative loss of thrust (n,) per speed along the thrust over the jet's speed [1]."""
    hull: Array
    """Centre and half axes (2, 3) of the ellipsoid that approximates the hull, body frame [m]; half
    axes of 0 for none."""


class Jet(NamedTuple):
    """The jets of n actuators, as smooth functions of their forces."""

    thrust: AnyArray
    """Sizes of the forces (..., n) [N], above 0 at rest."""
    ahead: AnyArray
    """Directions (..., n, 3) of the forces, body frame, shorter than 1 near rest; the jets flow
    against them."""
    speed: AnyArray
    """Speed of the jets (..., n) [m/s], `sqrt(2 T / (rho A))` of an actuator disc at rest."""


def jets_of(force: AnyArray, diameter: Array) -> Jet:
    """Returns the jets of forces.

    Args:
        force: forces (..., n, 3), body frame [N], real or complex.
        diameter: diameters (n,) of the jets [m].
    """
    area = 0.25 * np.pi * diameter**2 + LEAST_AREA
    thrust_at_rest = 0.5 * DENSITY * area * STILL**2
    thrust = np.sqrt((force * force).sum(-1) + thrust_at_rest * thrust_at_rest)
    speed = np.sqrt(2.0 * thrust / (DENSITY * area))
    return Jet(thrust, force / thrust[..., None], speed)


class Interaction(ABC):
    """The interaction of one robot's n actuators, as its plant uses it."""

    @abstractmethod
    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        """Returns the wrench offset.

        Args:
            force: forces of the actuators (..., n, 3), body frame [N].
            inflow: velocities (..., n, 3) of their points through the water, body frame [m/s]; None
                at rest.

        Returns:
            Wrenches (..., 6) to be added to that of the forces [N, N m], body frame.
        """

    @abstractmethod
    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """Returns `offset` (..., 6), and its derivatives (..., n, 3, 6) by the forces [1, m];
        arguments as for `offset`."""

    @property
    def core_constants(self) -> Array | None:
        """What the core's function `fl_jets` works with, where it gives the whole offset; None
        where the core has to ask `effect`."""
        return None

    @abstractmethod
    def deviation(self, force: Array) -> Array:
        """Returns the standard deviation (..., 6) of the wrench offset [N, N m] at forces (..., n,
        3) [N], from what is uncertain of the model."""


class PointInteraction(Interaction):
    """An interaction that is a further force at the point of each actuator."""

    def __init__(self, geometry: JetGeometry, constants: Sequence[float] | None = None) -> None:
        """Prepares one robot.

        Args:
            geometry: points and jets of its n actuators, and its hull.
            constants: the `CONSTANTS` numbers of the formula of jets; None for a model with another
                one, of which the core then computes the loss by speed alone.
        """
        self.geometry = geometry
        arms = np.cross(geometry.position[:, None], np.eye(3))
        axes = np.broadcast_to(np.eye(3), arms.shape)
        self.lever: Array = np.concatenate([axes, arms], axis=-1)
        """Wrench (n, 3, 6) of 1 N along the body's axes at each point [1, m]."""
        n = len(self.lever)
        has_formula = constants is not None
        numbers = np.zeros(CONSTANTS) if constants is None else constants
        head = [n, has_formula, DENSITY, STILL, *numbers]
        rows = np.column_stack([geometry.position, geometry.diameter, geometry.advance])
        self.table: Array = np.concatenate(
            [head, geometry.hull.ravel(), rows.ravel()], dtype=np.float64
        )
        """The numbers that finlab/core/src/jets.c reads."""

    @abstractmethod
    def at_rest(self, force: Array) -> Array:
        """Returns the further forces (..., n, 3) [N] at forces (..., n, 3) [N] in still water, body
        frame."""

    def by_core(
        self, force: Array, inflow: Array | None, with_slope: bool
    ) -> tuple[Array, Array, Array]:
        """Returns what the core computes: the formula of jets, where the model has its constants,
        and the loss of thrust by speed.

        Args:
            force: forces (..., n, 3), body frame [N].
            inflow: velocities (..., n, 3) of the points through the water, body frame [m/s]; None
                at rest.
            with_slope: whether derivatives are needed.

        Returns:
            Further forces (..., n, 3) [N], their wrench (..., 6) [N, N m], and its derivatives
            (..., n, 3, 6) by the forces, an empty array without `with_slope`.
        """
        shape = force.shape if inflow is None else np.broadcast_shapes(force.shape, inflow.shape)
        count = math.prod(shape[:-2])
        force = np.ascontiguousarray(np.broadcast_to(force, shape))
        velocity = None if inflow is None else np.ascontiguousarray(np.broadcast_to(inflow, shape))
        change = np.empty(shape)
        wrench = np.empty((*shape[:-2], 6))
        slope = np.empty((*shape, 6) if with_slope else 0)
        library().fl_jets(
            self.table.ctypes.data,
            force.ctypes.data,
            count,
            None if velocity is None else velocity.ctypes.data,
            change.ctypes.data,
            wrench.ctypes.data,
            slope.ctypes.data if with_slope else None,
        )
        return change, wrench, slope


class InteractionModel(Checked, ABC):
    """An interaction as a layout describes it: the contract of a model."""

    @abstractmethod
    def of(self, geometry: JetGeometry) -> PointInteraction:
        """Returns the interaction of a robot's actuators. Raises FinlabError: a file that it reads
        is bad."""

    @property
    def reads(self) -> str | None:
        """Path of the file that it reads; None where it reads none."""
        return None

    @property
    def stamp(self) -> tuple[int, int] | None:
        """Modification time [ns] and size [bytes] of that file, by which a cache of what it holds
        is known to be old; None where it reads none."""
        if self.reads is None:
            return None
        from finlab.bundle_files import file_stamp

        return file_stamp(self.reads)

    def reading(self, path: str) -> Self:
        """Returns it with another file that it reads."""
        return self


def complex_slope(function: Callable[[AnyArray], Any], values: Array) -> tuple[Array, Array]:
    """Returns a smooth function and its derivatives, by imaginary steps.

    Args:
        function: from vectors (..., n, k) to an array (..., n, m), each row of which depends on one
            of them; it takes complex numbers.
        values: vectors (..., n, k).

    Returns:
        Values (..., n, m) and derivatives (..., n, k, m).
    """
    k = values.shape[-1]
    steps = np.eye(k).reshape(k, *(1,) * (values.ndim - 1), k) * (1j * STEP)
    result = function(values + steps)
    return result[0].real, np.moveaxis(result.imag, 0, -2) / STEP


def with_diagonal(slope: Array, diagonal: Array) -> Array:
    """Returns derivatives (..., n, 3, n, 3) of changes by forces, with those of each change by its
    own force (..., n, 3, 3) added."""
    n = diagonal.shape[-3]
    return slope + diagonal[..., :, :, None, :] * np.eye(n)[:, None, :, None]
