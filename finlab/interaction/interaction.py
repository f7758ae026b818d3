"""The contract of an interaction: how the jets of a robot's actuators change its wrench.

What a layout says is an `InteractionModel`; the plant asks it for the `Interaction` of one robot.

A robot's layout names a model of interaction, a formula or a network
(`finlab.interaction.INTERACTIONS`). From the forces of all actuators it gives a further force at
the point of each, and so the wrench offset. The plant adds it. Forces are in the body frame;
derivatives are by the forces, not by the commands.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from finlab.arrays import AnyArray, Array
from finlab.core import library
from finlab.core.calls import widest_lanes
from finlab.files.schema import Checked

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

DENSITY = 1000.0
"""Density of the water [kg/m^3]."""
MIN_JET_SPEED = 0.03
"""Speed of the jet of an actuator at rest [m/s]: a floor that keeps derivatives finite there."""
MIN_DISC_AREA = 1e-12
"""Area added to each disc, so that an actuator without one divides by no zero [m^2]."""
LANES_INDEX = 4
"""Index of the number of lanes among the numbers that finlab/core/src/jets.c reads."""
N_CONSTANTS = 10
"""How many constants of the formula of jets the core takes, in the order of its table."""


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

    Returns:
        The jets, with complex numbers where the forces are complex.
    """
    area = 0.25 * np.pi * diameter**2 + MIN_DISC_AREA
    thrust_at_rest = 0.5 * DENSITY * area * MIN_JET_SPEED**2
    thrust = np.sqrt((force * force).sum(-1) + thrust_at_rest * thrust_at_rest)
    speed = np.sqrt(2.0 * thrust / (DENSITY * area))
    return Jet(thrust, force / thrust[..., None], speed)


class Interaction(ABC):
    """The interaction of one robot's n actuators, as its plant uses it."""

    CORE_FUNCTION: ClassVar[str] = "fl_jets"
    """The core's function (`fl_offset_at` of finlab/core/finlab.h) that gives the whole offset, of
    a model with `core_constants`."""

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
        """Returns the wrench offset and its derivatives.

        Args:
            force: as for `offset`.
            inflow: as for `offset`.

        Returns:
            `offset` (..., 6) [N, N m], and its derivatives (..., n, 3, 6) by the forces [1, m].
        """

    @property
    def core_constants(self) -> Array | None:
        """What `CORE_FUNCTION` works with; None where the core has to ask `effect`."""
        return None

    def constants_in_lanes(self, lanes: int) -> Array | None:
        """Returns what `CORE_FUNCTION` works with where it computes so many pairs of actuators at
        once; None where there is no such function.

        Args:
            lanes: 1, or up to `widest_lanes()` of finlab.core.calls, which `core_constants` has.
                Answers have the same bits with any.
        """
        return self.core_constants

    @abstractmethod
    def deviation(self, force: Array, inflow: Array | None = None) -> Array:
        """Returns how uncertain the wrench offset is.

        Args:
            force: as for `offset`.
            inflow: as for `offset`.

        Returns:
            Standard deviation (..., 6) of the wrench offset [N, N m], from what is uncertain of the
            model.
        """


def lever_of(position: Array) -> Array:
    """Returns the wrenches (n, 3, 6) of 1 N along the body's axes at positions (n, 3) [m]."""
    axes = np.eye(3)
    torques = np.cross(position[:, None], axes)  # r x a of 1 N along each axis a
    forces = np.broadcast_to(axes, torques.shape)
    return np.concatenate([forces, torques], axis=-1)


class PointInteraction(Interaction):
    """An interaction that is a further force at the point of each actuator."""

    def __init__(self, geometry: JetGeometry, constants: Sequence[float] | None = None) -> None:
        """Prepares one robot.

        Args:
            geometry: points and jets of its n actuators, and its hull.
            constants: the `N_CONSTANTS` numbers of the formula of jets; None for a model with
                another one, of which the core then computes the loss by speed alone.
        """
        self.geometry = geometry
        self.lever = lever_of(geometry.position)
        """Wrench (n, 3, 6) of 1 N along the body's axes at each point [1, m]."""
        n = len(self.lever)
        has_formula = constants is not None
        numbers = np.zeros(N_CONSTANTS) if constants is None else constants
        head = [n, has_formula, DENSITY, MIN_JET_SPEED, widest_lanes(), *numbers]
        rows = np.column_stack([geometry.position, geometry.diameter, geometry.advance])
        self.table: Array = np.concatenate(
            [head, geometry.hull.ravel(), rows.ravel()], dtype=np.float64
        )
        """The numbers that finlab/core/src/jets.c reads."""

    def table_in_lanes(self, lanes: int) -> Array:
        """Returns `table` for so many pairs of actuators at once."""
        table = self.table.copy()
        table[LANES_INDEX] = lanes
        return table

    @abstractmethod
    def at_rest(self, force: Array) -> Array:
        """Returns the further forces of an interaction, of a robot at rest in still water.

        Args:
            force: forces of the actuators (..., n, 3), body frame [N].

        Returns:
            Forces (..., n, 3) at the points of the actuators, body frame [N].
        """

    def compute_in_core(
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
        return self.call_core(library().fl_jets, self.table, force, inflow, with_slope)

    def call_core(
        self,
        function: Callable[..., None],
        constants: Array,
        force: Array,
        inflow: Array | None,
        with_slope: bool,
    ) -> tuple[Array, Array, Array]:
        """Returns what a function of the core gives; as `compute_in_core`.

        Args:
            function: an `fl_offset_at` of finlab/core/finlab.h.
            constants: that it works with.
            force: as for `compute_in_core`, as are the next two.
            inflow: velocities.
            with_slope: whether derivatives are needed.
        """
        shape = force.shape if inflow is None else np.broadcast_shapes(force.shape, inflow.shape)
        count = math.prod(shape[:-2])
        force = np.ascontiguousarray(np.broadcast_to(force, shape))
        velocity = None if inflow is None else np.ascontiguousarray(np.broadcast_to(inflow, shape))
        change = np.empty(shape)
        wrench = np.empty((*shape[:-2], 6))
        slope = np.empty((*shape, 6) if with_slope else 0)
        function(
            constants.ctypes.data,
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
        """Returns the interaction of one robot's actuators.

        Args:
            geometry: points and jets of the actuators, and the hull.

        Raises:
            FinlabError: a file that it reads is missing or damaged.
        """

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

    def reading(self, path: str) -> "Self":
        """Returns the model with another path of its file; itself where it reads none."""
        return self
