"""The contract of an interaction: what the jets of a robot's actuators take from its forces.

A robot's layout names a model of interaction, a formula or a network
(`finlab.interaction.INTERACTIONS`). It gives the force that comes at each actuator's place beside
the actuator's own, from the forces of all. Forces are in the body frame; derivatives are those by
the forces, not by the commands.
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
"""Of the water [kg/m^3]."""
STILL = 0.03
"""Speed [m/s] of a jet below which it counts as none; it keeps derivatives finite at rest."""
STEP = 1e-30
"""Imaginary step of derivatives: those of smooth formulas are exact (Squire and Trapp, 1998)."""


class Places(NamedTuple):
    """Where n actuators push, and what their jets meet."""

    position: Array
    """(n, 3) [m]."""
    diameter: Array
    """Diameters (n,) [m] of the jets where they begin; 0 of an actuator without one."""
    advance: Array
    """Share of thrust (n,) lost per speed along the thrust over that of the jet."""
    hull: Array
    """Centre and half axes (2, 3) [m] of the ellipsoid that stands for the hull; half axes of 0 for
    none."""


class Jet(NamedTuple):
    """The jets of n actuators; smooth where they end."""

    thrust: AnyArray
    """(..., n) [N]."""
    ahead: AnyArray
    """Directions (..., n, 3) of the forces, shorter than 1 near rest; the jets flow against
    them."""
    speed: AnyArray
    """(..., n) [m/s], `sqrt(2 T / (rho A))` of an actuator disc at rest."""


def jets_of(force: AnyArray, diameter: Array) -> Jet:
    """Returns the jets of forces (..., n, 3) [N], real or complex."""
    area = 0.25 * np.pi * diameter**2 + 1e-12
    least = 0.5 * DENSITY * area * STILL**2
    thrust = np.sqrt((force * force).sum(-1) + least * least)
    return Jet(thrust, force / thrust[..., None], np.sqrt(2.0 * thrust / (DENSITY * area)))


class Interaction(ABC):
    """What a plant asks of an interaction of one robot's actuators."""

    @abstractmethod
    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        """Returns the wrench (..., 6) [N, N m] that comes beside forces (..., n, 3) [N]; velocities
        (..., n, 3) [m/s] of the places through the water, body frame, None at rest."""

    @abstractmethod
    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """Returns `offset`, and its derivatives (..., n, 3, 6) by the forces."""

    @abstractmethod
    def deviation(self, force: Array) -> Array:
        """Returns the standard deviation (..., 6) [N, N m] of the wrench by what is uncertain of
        it."""


class AtPlaces(Interaction):
    """An interaction that is a force at each actuator's place."""

    def __init__(self, places: Places, constants: Sequence[float] | None = None) -> None:
        """Takes the places of the n actuators, and the constants of the formula of jets; None where
        something else says what jets take."""
        self.places = places
        arms = np.cross(places.position[:, None], np.eye(3))
        self.lever: Array = np.concatenate([np.broadcast_to(np.eye(3), arms.shape), arms], axis=-1)
        """Wrench (n, 3, 6) of 1 N along the body's axes at each place."""
        head = [
            len(self.lever),
            constants is not None,
            DENSITY,
            STILL,
            *(constants or np.zeros(10)),
        ]
        rows = np.column_stack([places.position, places.diameter, places.advance])
        self.table: Array = np.concatenate(
            [head, places.hull.ravel(), rows.ravel()], dtype=np.float64
        )
        """The numbers of finlab/core/src/jets.c."""

    @abstractmethod
    def at_rest(self, force: Array) -> Array:
        """Returns the forces (..., n, 3) [N] that come beside forces (..., n, 3) [N] in still
        water."""

    def by_core(
        self, force: Array, inflow: Array | None, steep: bool
    ) -> tuple[Array, Array, Array]:
        """Returns what the core gives for forces (..., n, 3): forces of the same shape by the
        formula, where it counts, and by what speed takes, the wrench (..., 6), and its derivatives
        (..., n, 3, 6) where `steep`."""
        shape = force.shape if inflow is None else np.broadcast_shapes(force.shape, inflow.shape)
        force = np.ascontiguousarray(np.broadcast_to(force, shape))
        change = np.empty(shape)
        met = None if inflow is None else np.ascontiguousarray(np.broadcast_to(inflow, shape))
        wrench = np.empty((*shape[:-2], 6))
        slope = np.empty((*shape, 6) if steep else 0)
        count = math.prod(shape[:-2])
        ins = (
            self.table.ctypes.data,
            force.ctypes.data,
            count,
            None if met is None else met.ctypes.data,
        )
        outs = (change.ctypes.data, wrench.ctypes.data, slope.ctypes.data if steep else None)
        library().fl_jets(*ins, *outs)
        return change, wrench, slope


class InteractionModel(Checked, ABC):
    """An interaction as a layout describes it: the contract of a model."""

    @abstractmethod
    def of(self, places: Places) -> AtPlaces:
        """Returns the interaction of a robot's actuators. Raises FinlabError: a file that it reads
        is bad."""

    @property
    def reads(self) -> str | None:
        """Path of the file that it reads; None where it reads none."""
        return None

    @property
    def stamp(self) -> tuple[int, int] | None:
        """Time and size of that file, for what is kept until it changes; None where it reads
        none."""
        if self.reads is None:
            return None
        from finlab.bundle_files import file_stamp

        return file_stamp(self.reads)

    def reading(self, path: str) -> Self:
        """Returns it with another file that it reads."""
        return self


def complex_slope(function: Callable[[AnyArray], Any], values: Array) -> tuple[Array, Array]:
    """Returns what a smooth function gives for vectors (..., n, k), an array (..., n, m) each row
    of which depends on one of them, and its derivatives (..., n, k, m)."""
    k = values.shape[-1]
    steps = np.eye(k).reshape(k, *(1,) * (values.ndim - 1), k) * (1j * STEP)
    result = function(values + steps)
    return result[0].real, np.moveaxis(result.imag, 0, -2) / STEP


def with_own(slope: Array, own: Array) -> Array:
    """Returns derivatives (..., n, 3, n, 3) with those of each change by its own force (..., n, 3,
    3) added."""
    n = own.shape[-3]
    return slope + own[..., :, :, None, :] * np.eye(n)[:, None, :, None]
