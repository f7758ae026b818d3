"""The plant: wrench and power of a robot's commands, by the laws of its actuators, in numpy and
double precision.

It scores every allocation method, and the model-based methods optimize over it. `flow` (..., 6) is
the velocity of the body relative to the water [m/s, rad/s], body frame; None is a robot at rest.
An actuator's own frame has its own axes as rows (`Layout.frames`).
"""

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import astuple
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.actuators.fin.fin_laws import make_law
from finlab.actuators.kinds import free_angles, laws_of, wrapping_angles
from finlab.actuators.law import ActuatorLaw, Blade, FinLaw, PlanarLaw, planar_force
from finlab.arrays import Array
from finlab.axes import feasible, is_full_turn
from finlab.core.calls import CommandFigures, Formulas, PowerFormulas
from finlab.core.fields import constant, struct
from finlab.errors import CommandError
from finlab.layout.effectiveness import body_force, own_effectiveness, wrench_of_forces
from finlab.layout.layout import Layout

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

    from finlab.interaction.interaction import PointInteraction


class Plant:
    """The actuators of one layout, each with its own law: commands to wrenches and their
    derivatives."""

    def __init__(self, layout: Layout) -> None:
        """Prepares the laws of the layout's actuators; `plant_of` caches plants.

        Raises:
            DataError: a fin's force table cannot be read.
        """
        self.layout = layout
        self.n = layout.n
        self.n_fins = layout.n_fins
        self.lower = layout.lower
        self.upper = layout.upper
        self.width = self.upper - self.lower
        """Ranges of the limits (n, 3)."""
        self.turns: NDArray[np.bool_] = free_angles(layout.actuators) & is_full_turn(self.width)
        """Commands (n, 3) that are angles without limits: they wrap."""
        self.wraps: NDArray[np.bool_] = self.turns | wrapping_angles(layout.actuators)
        """Commands (n, 3) that are brought near to their limits by full turns: these, and others
        whose kind says so."""
        self.full_turn = self.turns[:, 2]
        """Fins (n,) whose zero direction wraps."""
        self.effectiveness: Array = own_effectiveness(layout)
        """Wrench (n, 3, 6) of 1 N along the own axes of each actuator [1, m], body frame."""
        laws = [(_as_slice(indices), law) for indices, law in laws_of(layout.actuators)]
        self._laws: list[tuple[Any, ActuatorLaw]] = laws
        """Indices of actuators with one law, and the law."""
        model = layout.interaction
        self.interaction: PointInteraction | None = None
        """Hydrodynamic interaction of the actuators; None where the layout names none."""
        if model is not None:
            from finlab.layout.jet_geometry import jet_geometry_of

            self.interaction = model.of(jet_geometry_of(layout))
        self.counts: NDArray[np.bool_] = np.ones(6, bool)
        """Axes (6,) of the wrench that count; the others are 0."""
        self.feels_flow = model is not None or any(law.feels_flow for _, law in self._laws)
        """Whether forces or wrenches depend on the flow."""
        self.flow: Array | None = None
        """The flow (..., 6) [m/s, rad/s] of calls that are given none."""
        self._inflow: Array | None = None

    def at(self, flow: ArrayLike | None) -> "Self":
        """Returns the plant with a flow (..., 6) [m/s, rad/s], body frame, for calls that are given
        none; itself where the flow has no effect."""
        if flow is None or not self.feels_flow:
            return self
        plant = copy(self)
        plant.flow = np.asarray(flow, np.float64)
        plant._inflow = plant.inflow(plant.flow)
        return plant

    def counting(self, axes: NDArray[np.bool_]) -> "Self":
        """Returns the plant with the axes (6,) of the wrench that count, the others being 0; itself
        where all count."""
        if axes.all():
            return self
        plant = copy(self)
        plant.effectiveness = np.where(axes, self.effectiveness, 0.0)
        plant.counts = axes
        plant.__dict__.pop("formulas", None)  # they have the effectiveness
        return plant

    def inflow(self, flow: Array | None) -> Array | None:
        """Returns the velocity (..., n, 3) of each actuator's point through the water in its own
        frame [m/s]; None at rest, or where no force depends on it."""
        if flow is None:
            return self._inflow
        if not self.feels_flow:
            return None
        velocity: Array = np.einsum(
            "...nb,nab->...na", self.point_velocity(flow), self.layout.frames
        )
        return velocity

    def point_velocity(self, flow: Array) -> Array:
        """Velocity (..., n, 3) of each actuator's point through the water, body frame [m/s]."""
        body_velocity = np.asarray(flow, np.float64)[..., None, :]
        linear = body_velocity[..., :3]
        angular = body_velocity[..., 3:]
        # v_i = v + omega x r_i
        turning = angular @ self._velocity_by_turning
        return np.asarray(linear + turning.reshape(*turning.shape[:-2], self.n, 3))

    @cached_property
    def _velocity_by_turning(self) -> Array:
        """Velocities (3, 3 n) of the actuators' points [m/s] by turning about each axis at 1
        rad/s."""
        by_axis = np.cross(np.eye(3)[:, None], self.layout.position)
        return np.asarray(by_axis.reshape(3, -1))

    def wrench(self, command: ArrayLike, *, flow: Array | None = None) -> Array:
        """Returns the wrench of a command.

        Args:
            command: (..., n, 3), of fins [rad, Hz, rad]; a row of NaN is a lost actuator and gives
                no force.
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            (..., 6) [N, N m], body frame.

        Raises:
            CommandError: the shape does not fit the layout, or a value is infinite or partly NaN.
        """
        return self.wrench_of(self.forces(command, flow=flow), flow=flow)

    def wrench_of(self, force: Array, *, flow: Array | None = None) -> Array:
        """Returns the wrench of forces, with that of the interaction.

        Args:
            force: (..., n, 3) [N], own frames.
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            (..., 6) [N, N m], body frame.
        """
        wrench: Array = wrench_of_forces(force, self.effectiveness)
        return wrench if self.interaction is None else wrench + self.offset(force, flow=flow)

    def offset(self, force: Array, *, flow: Array | None = None) -> Array:
        """Returns the wrench offset by the interaction.

        Args:
            force: (..., n, 3) [N], own frames.
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            (..., 6) [N, N m], body frame.
        """
        if self.interaction is None:
            return np.zeros((*force.shape[:-2], 6))
        in_body = body_force(force, self.layout.frames)
        offset = self.interaction.offset(in_body, self.met_by_all(flow))
        return offset * self.counts

    def effect(self, force: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """Returns the wrench offset, and the effectiveness with that of the interaction.

        Args:
            force: (..., n, 3) [N], own frames.
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            The offset (..., 6) [N, N m], and the wrench (..., n, 3, 6) per newton along own axes
            [1, m], body frame.
        """
        frames = self.layout.frames
        if self.interaction is None:
            return self.offset(force), self.effectiveness
        in_body = body_force(force, frames)
        offset, jacobian = self.interaction.effect(in_body, self.met_by_all(flow))
        jacobian_in_own_axes = frames @ jacobian
        effectiveness = self.effectiveness + jacobian_in_own_axes * self.counts
        return offset * self.counts, effectiveness

    def met_by_all(self, flow: Array | None) -> Array | None:
        """Returns the velocity (..., n, 3) of each actuator's point through the water, body frame
        [m/s]; of the plant's own flow when `flow` is None, and None at rest."""
        flow = self.flow if flow is None else flow
        return None if flow is None else self.point_velocity(flow)

    def forces(self, command: ArrayLike, *, flow: Array | None = None) -> Array:
        """Returns the forces of a command.

        Args:
            command: as for `wrench`, which has the same errors.
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            (..., n, 3) [N], own frames.
        """
        values, is_lost = self._checked(command)
        force = self.force(values, flow=flow)
        if is_lost is not None:
            force[np.broadcast_to(is_lost, force.shape[:-1])] = 0.0
        return force

    def force(self, command: Array, *, flow: Array | None = None) -> Array:
        """Returns the forces of a finite command, which is not checked.

        Args:
            command: (..., n, 3), of fins [rad, Hz, rad].
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            (..., n, 3) [N], own frames.
        """
        # The same as below, without an index and a copy: every tick pays for it.
        if not self.feels_flow and len(self._laws) == 1:
            return np.asarray(self._laws[0][1].force(command))
        if self._force_offset is not None:
            return self._planar_forces(command, self._force_offset)
        inflow = self.inflow(flow)
        force = np.empty(_broadcast(command, inflow))
        for indices, law in self._laws:
            own_inflow = _inflow_of(law, inflow, indices)
            force[..., indices, :] = law.force(command[..., indices, :], own_inflow)
        return force

    def force_and_jacobian(
        self, command: Array, *, flow: Array | None = None
    ) -> tuple[Array, Array]:
        """Returns the forces of a finite command, and their derivatives.

        Args:
            command: (..., n, 3), of fins [rad, Hz, rad].
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            Forces (..., n, 3) [N], own frames, and derivatives (..., n, 3 commands, 3 axes).
        """
        inflow = self.inflow(flow)
        shape = _broadcast(command, inflow)
        force = np.empty(shape)
        jacobian = np.empty((*shape, 3))
        for indices, law in self._laws:
            own_inflow = _inflow_of(law, inflow, indices)
            own_force, own_jacobian = law.force_and_jacobian(command[..., indices, :], own_inflow)
            force[..., indices, :] = own_force
            jacobian[..., indices, :, :] = own_jacobian
        return force, jacobian

    def body_forces(self, command: ArrayLike, *, flow: Array | None = None) -> Array:
        """Returns the forces of a command in the body frame (..., n, 3) [N]; arguments and errors
        as for `wrench`."""
        force: Array = body_force(self.forces(command, flow=flow), self.layout.frames)
        return force

    def linearize(self, command: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """Returns the wrench of a finite command, and its Jacobian.

        Args:
            command: (..., n, 3), of fins [rad, Hz, rad], without lost actuators.
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            Wrenches (..., 6) [N, N m], body frame, and derivatives (..., 6, 3 n), actuator by
            actuator.
        """
        force, dforce_dcommand = self.force_and_jacobian(command, flow=flow)
        offset, effectiveness = self.effect(force, flow=flow)
        # dw/du_i = (dy_i/du_i) B_i, one row for each number of a command
        dwrench_dcommand = dforce_dcommand @ effectiveness
        rows = dwrench_dcommand.reshape(*force.shape[:-2], 3 * self.n, 6)
        wrench: Array = wrench_of_forces(force, self.effectiveness) + offset
        return wrench, rows.swapaxes(-1, -2)

    def power(self, command: Array, *, flow: Array | None = None) -> Array:
        """Returns the power of each actuator.

        Args:
            command: (..., n, 3), of fins [rad, Hz, rad].
            flow: velocity of the body relative to the water (..., 6), body frame [m/s, rad/s];
                None for that of the plant, at rest unless `at` has set one.

        Returns:
            (..., n) [W]; NaN of a lost actuator.
        """
        # The same as below, without an index and a copy: every tick pays for it.
        if not self.feels_flow and len(self._laws) == 1:
            return np.asarray(self._laws[0][1].power(command))
        if self._has_blades:
            return np.asarray(self.blade.power(command[..., 0], command[..., 1]))
        inflow = self.inflow(flow)
        power = np.empty(_broadcast(command, inflow)[:-1])
        for indices, law in self._laws:
            own_inflow = _inflow_of(law, inflow, indices)
            power[..., indices] = law.power(command[..., indices, :], own_inflow)
        return power

    def figures(self, command: Array) -> CommandFigures | None:
        """Returns all that is judged of one command, in a tenth of the time of its parts.

        Args:
            command: (n, 3); a row of NaN is a lost actuator.

        Returns:
            Its figures, which are those of the laws to rounding; None where a law is no formula,
            actuators act on each other, or the command is none of this robot.
        """
        formulas = self.formulas
        return None if formulas is None else formulas.figures(command)

    @cached_property
    def formulas(self) -> Formulas | None:
        """The laws of all actuators as the core evaluates them; None where one is no formula there,
        feels the flow, or actuators act on each other."""
        if self.feels_flow:
            return None
        laws = np.zeros(self.n, struct("fl_formula"))
        for indices, law in self._laws:
            formula = law.formula()
            if formula is None:
                return None
            laws["kind"][indices] = constant(formula.kind)
            for name, values in formula.numbers.items():
                laws[name][indices] = values
        return Formulas(laws, self.effectiveness, self.layout.frames)

    @cached_property
    def power_formulas(self) -> PowerFormulas | None:
        """The powers of all actuators as the core evaluates them; None where it cannot evaluate
        that of one, or one feels the flow."""
        if self.feels_flow:
            return None
        laws = np.zeros(self.n, struct("fl_formula"))
        curves: list[Array | None] = [None] * self.n
        for indices, law in self._laws:
            power = law.power_formula()
            if power is None:
                return None
            laws["kind"][indices] = constant(power.formula.kind)
            for name, values in power.formula.numbers.items():
                laws[name][indices] = values
            if power.curves is not None:
                for i, curve in zip(np.arange(self.n)[indices], power.curves, strict=True):
                    curves[i] = curve
        return PowerFormulas(laws, curves)

    def power_gradient(self, command: Array, *, flow: Array | None = None) -> Array:
        """Returns the derivatives of the power; arguments as for `power`.

        Returns:
            (..., n, 3): watts per rad, Hz or N, as the command has them.
        """
        inflow = self.inflow(flow)
        gradient = np.empty(_broadcast(command, inflow))
        for indices, law in self._laws:
            own_inflow = _inflow_of(law, inflow, indices)
            gradient[..., indices, :] = law.power_gradient(command[..., indices, :], own_inflow)
        return gradient

    @cached_property
    def is_uncertain(self) -> bool:
        """Whether its forces have an error model; see `finlab.physics.expected_miss`."""
        if self.interaction is not None:
            return True
        return any(actuator.is_uncertain for actuator in self.layout.actuators)

    @cached_property
    def _force_offset(self) -> Array | None:
        """Angles (n,) [rad] from the fins' zero directions to their forces, of a robot of fins by
        formulas alone; None of any other."""
        offset = np.zeros(self.n)
        for indices, law in self._laws:
            if not isinstance(law, PlanarLaw):
                return None
            offset[indices] = law.offset
        return offset

    def _planar_forces(self, command: Array, offset: Array) -> Array:
        """Forces (..., n, 3) [N] of commands (..., n, 3) of fins by formulas; the same as law by
        law, with one evaluation of all directions."""
        thrust = np.empty(command.shape[:-1])
        for indices, law in self._laws:
            assert isinstance(law, PlanarLaw)
            own = command[..., indices, :]
            thrust[..., indices] = law.thrust(own[..., 0], own[..., 1], own[..., 2])
        return planar_force(thrust, command[..., 2] + offset)

    @cached_property
    def _has_blades(self) -> bool:
        """Whether all actuators are fins, of any laws, that take the power of their blades."""
        laws = [law for _, law in self._laws]
        return all(isinstance(law, FinLaw) and not law.measured for law in laws)

    @cached_property
    def blade(self) -> Blade:
        """Constants of the power of all fins' blades, each an array (n_fins,)."""
        fins = [astuple(make_law(fin.model).blade) for fin in self.layout.fins]
        return Blade(*map(np.array, zip(*fins, strict=True)))

    def thrust(self, amplitude: Array, frequency: Array) -> Array:
        """Returns the size of each fin's force at zero direction 0.

        Args:
            amplitude: (..., n) [rad].
            frequency: (..., n) [Hz].

        Returns:
            (..., n) [N].
        """
        command = np.stack(np.broadcast_arrays(amplitude, frequency, 0.0), axis=-1)
        size: Array = np.linalg.norm(self.forces(command), axis=-1)
        return size

    def feasible(self, command: Array) -> Array:
        """Returns commands (..., n, 3) within the limits exactly: angles without limits wrap, other
        numbers are clipped."""
        return feasible(np.asarray(command, np.float64), self.lower, self.upper, self.turns)

    @cached_property
    def _dead_band(self) -> Array | None:
        """Dead bands (n, 3) [N] of the commands that are forces; None where there is none."""
        bands = np.zeros((self.n, 3))
        for i, actuator in enumerate(self.layout.actuators):
            force_number = actuator.KIND.force_number
            if force_number is not None:
                bands[i, force_number] = getattr(actuator, "dead_band", 0.0)
        return bands if bands.any() else None

    def rested(self, command: Array) -> Array:
        """Returns commands (..., n, 3) in which those inside a dead band, which give no force, are
        0."""
        if self._dead_band is None:
            return command
        from finlab.actuators.propeller import outside_dead_band

        nearest_to_zero = np.clip(0.0, self.lower, self.upper)
        return outside_dead_band(command, self._dead_band, nearest_to_zero)

    def grid(self, counts: Sequence[int]) -> Array:
        """Returns commands (K, n, 3) on a grid over the limits of each actuator; K is the product
        of the three `counts` of values."""
        axes = [np.linspace(0.0, 1.0, count) for count in counts]
        share = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
        return np.asarray(self.lower + share.reshape(-1, 1, 3) * self.width)

    def sample(self, rng: np.random.Generator, size: tuple[int, ...]) -> Array:
        """Returns random commands (*size, n, 3), uniform within the limits."""
        commands = np.asarray(self.lower + rng.uniform(size=(*size, self.n, 3)) * self.width)
        for i, actuator in enumerate(self.layout.actuators):
            zones = getattr(actuator, "barred", ())
            if not zones:
                continue
            # Uniform over the arcs: an angle from 0 to their summed widths, moved up by the zones.
            low = actuator.lower[0]
            high = actuator.upper[0]
            barred = sum(end - begin for begin, end in zones)
            angle = low + (commands[..., i, 0] - low) * (1.0 - barred / (high - low))
            for begin, end in zones:
                angle = np.where(angle > begin, angle + end - begin, angle)
            commands[..., i, 0] = angle
        return commands

    def _checked(self, command: ArrayLike) -> tuple[Array, NDArray[np.bool_] | None]:
        """Finite commands (..., n, 3), 0 of lost actuators, and which are lost (..., n); None where
        none is."""
        try:
            values = np.asarray(command, dtype=np.float64)
        except (TypeError, ValueError):
            raise CommandError(
                "expected commands as three numbers per actuator, of a fin [rad, Hz, rad], got "
                "something else"
            ) from None
        if values.ndim < 2 or values.shape[-2:] != (self.n, 3):
            raise CommandError(
                f"expected commands (..., {self.n}, 3) for layout {self.layout.name}, got "
                f"{values.shape}"
            )
        numbers = values.ravel()
        is_finite = math.isfinite(numbers @ numbers)  # in half the time of the next line
        if is_finite or np.isfinite(values).all():
            return values, None
        is_lost: NDArray[np.bool_] = np.asarray(np.isnan(values).all(axis=-1))
        values = np.where(is_lost[..., None], 0.0, values)
        if not np.isfinite(values).all():
            raise CommandError(
                f"the command for layout {self.layout.name} holds NaN or infinite values; a lost "
                "actuator has NaN in all three entries, any other has none"
            )
        return values, is_lost


def _as_slice(indices: NDArray[np.intp]) -> NDArray[np.intp] | slice:
    """Rising indices (m,) that have no gap as a slice, for which numpy copies no array; others as
    they are."""
    first = int(indices[0])
    count = len(indices)
    has_gap = int(indices[-1]) - first != count - 1
    return indices if has_gap else slice(first, first + count)


def _broadcast(command: Array, inflow: Array | None) -> tuple[int, ...]:
    """Shape (..., n, 3) of the forces of commands (..., n, 3) at velocities (..., n, 3)."""
    return command.shape if inflow is None else np.broadcast_shapes(command.shape, inflow.shape)


def _inflow_of(law: ActuatorLaw, inflow: Array | None, indices: Any) -> Array | None:
    """Velocities (..., m, 3) of a law's actuators through the water; None at rest, or of a law that
    does not feel the flow."""
    if inflow is None or not law.feels_flow:
        return None
    selected: Array = inflow[..., indices, :]
    return selected


def plant_of(layout: Layout) -> Plant:
    """Returns the plant of a layout, from a cache.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    return _cached_plant(layout, layout.stamps)


@lru_cache(maxsize=256)
def _cached_plant(layout: Layout, stamps: tuple[tuple[int, int] | None, ...]) -> Plant:
    """The plant; the stamps are part of the cache's key, so that tables whose files have changed
    are read again."""
    return Plant(layout)
