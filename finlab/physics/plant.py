"""The plant: wrench and power of a robot's commands, by the laws of its actuators, in numpy and
double precision.

It scores every allocation method, and the model-based methods optimize over it. `flow` (..., 6) is
the velocity of the body relative to the water [m/s, rad/s], body frame; None is a robot at rest.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import astuple
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.actuators.fin.fin_laws import make_law
from finlab.actuators.kinds import free_angles, laws_of
from finlab.actuators.law import ActuatorLaw, Blade
from finlab.arrays import Array
from finlab.axes import feasible, is_full_turn
from finlab.errors import CommandError
from finlab.layout.effectiveness import body_force, own_effectiveness, wrench_of_forces
from finlab.layout.layout import Layout

if TYPE_CHECKING:
    from finlab.interaction.interaction import PointInteraction


class Plant:
    """The actuators of one layout, each with its own law: commands to wrenches and their
    derivatives."""

    def __init__(self, layout: Layout) -> None:
        """Prepares the laws of the layout's actuators; `plant_of` keeps plants that were made.
        Raises DataError: a fin's force table cannot be read."""
        self.layout = layout
        self.n = layout.n
        self.n_fins = layout.n_fins
        self.lower = layout.lower
        self.upper = layout.upper
        self.width = self.upper - self.lower
        """Ranges of the limits (n, 3)."""
        self.turns: NDArray[np.bool_] = free_angles(layout.actuators) & is_full_turn(self.width)
        """Commands (n, 3) that may turn freely: they wrap instead of ending at a limit."""
        self.full_turn = self.turns[:, 2]
        """Fins (n,) whose zero direction does."""
        self.effectiveness: Array = own_effectiveness(layout)
        """Wrench (n, 3, 6) of 1 N along the own axes of each actuator."""
        laws = laws_of(layout.actuators)
        # A robot of one law is spared the copies of fancy indexing.
        self._laws: list[tuple[Any, ActuatorLaw]] = (
            [(slice(None), laws[0][1])] if len(laws) == 1 else laws
        )
        own = layout.interaction
        self.interaction: PointInteraction | None = None
        """What the actuators do to each other; None where that does not count."""
        if own is not None:
            from finlab.layout.jet_geometry import jet_geometry_of

            self.interaction = own.of(jet_geometry_of(layout))
        self.counts: NDArray[np.bool_] = np.ones(6, bool)
        """Axes (6,) of the wrench that count, the others being 0."""
        self.feels_flow = own is not None or any(law.feels_flow for _, law in self._laws)
        """Whether forces, or wrenches, depend on the flow."""
        self.flow: Array | None = None
        """The flow (..., 6) where a call names none."""
        self._inflow: Array | None = None

    def at(self, flow: ArrayLike | None) -> Self:
        """Returns the plant for those who ask it many times at one flow (..., 6); itself where the
        flow is without effect."""
        if flow is None or not self.feels_flow:
            return self
        other = copy(self)
        other.flow = np.asarray(flow, np.float64)
        other._inflow = other.inflow(other.flow)
        return other

    def counting(self, axes: NDArray[np.bool_]) -> Self:
        """Returns the plant for those to whom only some axes (6,) of the wrench count, the others
        being 0; itself where all do."""
        if axes.all():
            return self
        other = copy(self)
        other.effectiveness = np.where(axes, self.effectiveness, 0.0)
        other.counts = axes
        return other

    def inflow(self, flow: Array | None) -> Array | None:
        """Returns the velocity (..., n, 3) of each actuator's point through the water in its own
        frame [m/s]; None at rest, or where no force depends on it."""
        if flow is None:
            return self._inflow
        if not self.feels_flow:
            return None
        met: Array = np.einsum("...nb,nab->...na", self._moved(flow), self.layout.frames)
        return met

    def _moved(self, flow: Array) -> Array:
        """Velocity (..., n, 3) of each actuator's point through the water, body frame [m/s]."""
        water = np.asarray(flow, np.float64)[..., None, :]
        return np.asarray(water[..., :3] + np.cross(water[..., 3:], self.layout.position))

    def wrench(self, command: ArrayLike, *, flow: Array | None = None) -> Array:
        """Returns the wrench that a command causes. Raises CommandError: the shape does not fit the
        layout, or a value is infinite or partly NaN.

        Args:
            command: (..., n, 3), of fins [rad, Hz, rad]; a row of NaN is a lost one and gives no
            force.
            flow: (..., 6), or None at rest.

        Returns:
            (..., 6) [N, N m], body frame.
        """
        return self.wrench_of(self.forces(command, flow=flow), flow=flow)

    def wrench_of(self, force: Array, *, flow: Array | None = None) -> Array:
        """Returns the wrench (..., 6) [N, N m] of forces (..., n, 3) [N] in own frames."""
        wrench: Array = wrench_of_forces(force, self.effectiveness)
        return wrench if self.interaction is None else wrench + self.offset(force, flow=flow)

    def offset(self, force: Array, *, flow: Array | None = None) -> Array:
        """Returns the wrench offset (..., 6) [N, N m] by the interaction, at forces (..., n, 3) [N]
        in own frames."""
        if self.interaction is None:
            return np.zeros((*force.shape[:-2], 6))
        in_body = body_force(force, self.layout.frames)
        return self.interaction.offset(in_body, self.met_by_all(flow)) * self.counts

    def effect(self, force: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """Returns `offset`, and the wrench (..., n, 3, 6) per newton along own axes [1, m], that of
        the interaction at forces (..., n, 3) [N] included."""
        frames = self.layout.frames
        if self.interaction is None:
            return self.offset(force), self.effectiveness
        in_body = body_force(force, frames)
        offset, slope = self.interaction.effect(in_body, self.met_by_all(flow))
        return offset * self.counts, self.effectiveness + (frames @ slope) * self.counts

    def met_by_all(self, flow: Array | None) -> Array | None:
        """Returns the velocity (..., n, 3) of each actuator's point through the water, body frame
        [m/s]; of the plant's own flow when `flow` is None, and None at rest."""
        flow = self.flow if flow is None else flow
        return None if flow is None else self._moved(flow)

    def forces(self, command: ArrayLike, *, flow: Array | None = None) -> Array:
        """Returns each actuator's force (..., n, 3) [N] in its own frame (`layout.frames`); see
        `wrench`."""
        values, lost = self._checked(command)
        force = self.force(values, flow=flow)
        if lost is not None:
            force[np.broadcast_to(lost, force.shape[:-1])] = 0.0
        return force

    def force(self, command: Array, *, flow: Array | None = None) -> Array:
        """Returns forces (..., n, 3) [N] in own frames of commands (..., n, 3) known to be
        finite."""
        if not self.feels_flow and len(self._laws) == 1:
            return np.asarray(self._laws[0][1].force(command))
        inflow = self.inflow(flow)
        force = np.empty(_broadcast(command, inflow))
        for indices, law in self._laws:
            own_inflow = _inflow_of(law, inflow, indices)
            force[..., indices, :] = law.force(command[..., indices, :], own_inflow)
        return force

    def force_and_jacobian(
        self, command: Array, *, flow: Array | None = None
    ) -> tuple[Array, Array]:
        """Returns `force` and its derivatives (..., n, 3 commands, 3 axes)."""
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
        """Returns each actuator's force (..., n, 3) [N] in the body frame; see `wrench`."""
        force: Array = body_force(self.forces(command, flow=flow), self.layout.frames)
        return force

    def linearize(self, command: Array, *, flow: Array | None = None) -> tuple[Array, Array]:
        """Returns wrenches (..., 6) of commands (..., n, 3) without lost ones, and their
        derivatives (..., 6, 3 n), one actuator after the other."""
        force, jacobian = self.force_and_jacobian(command, flow=flow)
        offset, effectiveness = self.effect(force, flow=flow)
        jacobian = (jacobian @ effectiveness).reshape(*force.shape[:-2], 3 * self.n, 6)
        wrench: Array = wrench_of_forces(force, self.effectiveness) + offset
        return wrench, jacobian.swapaxes(-1, -2)

    def power(self, command: Array, *, flow: Array | None = None) -> Array:
        """Returns each actuator's power (..., n) [W] of commands (..., n, 3), NaN for a lost
        one's."""
        if not self.feels_flow and len(self._laws) == 1:
            return np.asarray(self._laws[0][1].power(command))
        inflow = self.inflow(flow)
        power = np.empty(_broadcast(command, inflow)[:-1])
        for indices, law in self._laws:
            own_inflow = _inflow_of(law, inflow, indices)
            power[..., indices] = law.power(command[..., indices, :], own_inflow)
        return power

    def power_gradient(self, command: Array, *, flow: Array | None = None) -> Array:
        """Returns the power's derivatives (..., n, 3) by each command."""
        inflow = self.inflow(flow)
        gradient = np.empty(_broadcast(command, inflow))
        for indices, law in self._laws:
            own_inflow = _inflow_of(law, inflow, indices)
            gradient[..., indices, :] = law.power_gradient(command[..., indices, :], own_inflow)
        return gradient

    @cached_property
    def is_uncertain(self) -> bool:
        """Whether something is known of the errors of its forces; see
        `finlab.physics.expected_miss`."""
        return self.interaction is not None or any(
            part.is_uncertain for part in self.layout.actuators
        )

    @cached_property
    def blade(self) -> Blade:
        """The plates whose beating takes power, side by side, one for each fin."""
        fins = [astuple(make_law(fin.model).blade) for fin in self.layout.fins]
        return Blade(*map(np.array, zip(*fins, strict=True)))

    def thrust(self, amplitude: Array, frequency: Array) -> Array:
        """Returns the size of each fin's force (..., n) [N] at zero direction zero."""
        command = np.stack(np.broadcast_arrays(amplitude, frequency, 0.0), axis=-1)
        size: Array = np.linalg.norm(self.forces(command), axis=-1)
        return size

    def feasible(self, command: Array) -> Array:
        """Returns commands (..., n, 3) brought within the limits exactly: full turns wrap, all else
        clips."""
        return feasible(np.asarray(command, np.float64), self.lower, self.upper, self.turns)

    @cached_property
    def _dead_band(self) -> Array | None:
        """Dead bands (n, 3) [N] of the commands that are forces; None where there is none."""
        bands = np.zeros((self.n, 3))
        for i, part in enumerate(self.layout.actuators):
            if part.KIND.force_number is not None:
                bands[i, part.KIND.force_number] = getattr(part, "dead_band", 0.0)
        return bands if bands.any() else None

    def rested(self, command: Array) -> Array:
        """Returns commands (..., n, 3) with those inside a dead band, which give no force, at
        rest."""
        if self._dead_band is None:
            return command
        from finlab.actuators.propeller import outside_dead_band

        return outside_dead_band(command, self._dead_band, np.clip(0.0, self.lower, self.upper))

    def grid(self, counts: Sequence[int]) -> Array:
        """Returns commands (K, n, 3) evenly spread over the limits, `counts` values of each
        number."""
        share = np.stack(
            np.meshgrid(*(np.linspace(0.0, 1.0, count) for count in counts), indexing="ij"), -1
        )
        return np.asarray(self.lower + share.reshape(-1, 1, 3) * self.width)

    def sample(self, rng: np.random.Generator, size: tuple[int, ...]) -> Array:
        """Returns uniform commands (*size, n, 3) within the limits."""
        return np.asarray(self.lower + rng.uniform(size=(*size, self.n, 3)) * self.width)

    def _checked(self, command: ArrayLike) -> tuple[Array, NDArray[np.bool_] | None]:
        """Finite float64 commands (..., n, 3), and which are lost (..., n), None where none has."""
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
        if np.isfinite(values).all():
            return values, None
        lost: NDArray[np.bool_] = np.asarray(np.isnan(values).all(axis=-1))
        values = np.where(lost[..., None], 0.0, values)
        if not np.isfinite(values).all():
            raise CommandError(
                f"the command for layout {self.layout.name} holds NaN or infinite values; "
                "a lost actuator has NaN in all three entries, any other has none"
            )
        return values, lost


def _broadcast(command: Array, inflow: Array | None) -> tuple[int, ...]:
    """Shape (..., n, 3) of forces."""
    return command.shape if inflow is None else np.broadcast_shapes(command.shape, inflow.shape)


def _inflow_of(law: ActuatorLaw, inflow: Array | None, indices: Any) -> Array | None:
    """Velocities (..., m, 3) of a law's actuators through the water; None at rest, or of a law that
    does not feel the flow."""
    if inflow is None or not law.feels_flow:
        return None
    own: Array = inflow[..., indices, :]
    return own


def plant_of(layout: Layout) -> Plant:
    """Returns the plant of a layout, kept from the last time it was asked for. Raises DataError: a
    fin's force table cannot be read."""
    return _made(layout, layout.stamps)


@lru_cache(maxsize=256)
def _made(layout: Layout, stamps: tuple[tuple[int, int] | None, ...]) -> Plant:
    """A plant; tables whose files have changed are read again."""
    return Plant(layout)
