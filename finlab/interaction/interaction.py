"""The contract of an interaction: what the jets of a robot's actuators take from its forces.

A robot's layout names an interaction, a formula (`jets`) or a network (`learned`). It gives the force that
comes at each actuator's place beside the actuator's own, from the forces of all. Forces are in the body
frame; derivatives are those by the forces, not by the commands.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import AnyArray, Array

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
    """Centre and half axes (2, 3) [m] of the ellipsoid that stands for the hull; half axes of 0 for none."""


class Jet(NamedTuple):
    """The jets of n actuators; smooth where they end."""

    thrust: AnyArray
    """(..., n) [N]."""
    ahead: AnyArray
    """Directions (..., n, 3) of the forces, shorter than 1 near rest; the jets flow against them."""
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
        """Returns the wrench (..., 6) [N, N m] that comes beside forces (..., n, 3) [N]; velocities (..., n,
        3) [m/s] of the places through the water, body frame, None at rest."""

    @abstractmethod
    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """Returns `offset`, and its derivatives (..., n, 3, 6) by the forces."""

    @abstractmethod
    def deviation(self, force: Array) -> Array:
        """Returns the standard deviation (..., 6) [N, N m] of the wrench by what is uncertain of it."""


class AtPlaces(Interaction):
    """An interaction that is a force at each actuator's place."""

    def __init__(self, places: Places) -> None:
        """Takes the places of the n actuators."""
        self.places = places
        arms = np.cross(places.position[:, None], np.eye(3))
        self.lever: Array = np.concatenate([np.broadcast_to(np.eye(3), arms.shape), arms], axis=-1)
        """Wrench (n, 3, 6) of 1 N along the body's axes at each place."""

    @abstractmethod
    def at_rest(self, force: Array) -> Array:
        """Returns the forces (..., n, 3) [N] that come beside forces (..., n, 3) [N] in still water."""

    @abstractmethod
    def slope_at_rest(self, force: Array) -> tuple[Array, Array]:
        """Returns `at_rest`, and its derivatives (..., n, 3, n, 3) by the forces, these first."""

    def __call__(self, force: Array, inflow: Array | None = None) -> Array:
        """Returns `at_rest` and what speed takes: velocities (..., n, 3) [m/s] of the places through the
        water, body frame, None at rest."""
        change = self.at_rest(force)
        return change if inflow is None else change + self._lost(force, inflow)

    def slope(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """Returns the same, and its derivatives as `slope_at_rest`."""
        change, slope = self.slope_at_rest(force)
        if inflow is not None:
            lost, own = complex_slope(lambda some: self._lost(some, inflow), force)
            change, slope = change + lost, with_own(slope, own)
        return change, slope

    def offset(self, force: Array, inflow: Array | None = None) -> Array:
        return np.asarray(np.einsum("...ib,ibw->...w", self(force, inflow), self.lever))

    def effect(self, force: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        change, slope = self.slope(force, inflow)
        by_force = np.einsum("...jaib,ibw->...jaw", slope, self.lever)
        return np.asarray(np.einsum("...ib,ibw->...w", change, self.lever)), np.asarray(by_force)

    def _lost(self, force: AnyArray, inflow: Array) -> Any:
        _, ahead, speed = jets_of(force, self.places.diameter)
        share = self.places.advance * (inflow * ahead).sum(-1) / speed
        return -share[..., None] * force


def complex_slope(function: Callable[[AnyArray], Any], values: Array) -> tuple[Array, Array]:
    """Returns what a smooth function gives for vectors (..., n, k), an array (..., n, m) each row of which
    depends on one of them, and its derivatives (..., n, k, m)."""
    k = values.shape[-1]
    steps = np.eye(k).reshape(k, *(1,) * (values.ndim - 1), k) * (1j * STEP)
    result = function(values + steps)
    return result[0].real, np.moveaxis(result.imag, 0, -2) / STEP


def with_own(slope: Array, own: Array) -> Array:
    """Returns derivatives (..., n, 3, n, 3) with those of each change by its own force (..., n, 3, 3)
    added."""
    n = own.shape[-3]
    return slope + own[..., :, :, None, :] * np.eye(n)[:, None, :, None]
