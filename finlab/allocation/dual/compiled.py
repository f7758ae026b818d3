"""A layout compiled for the dual: the responses of its actuators, and the block of numbers that the
core reads.

Method `dual` compiles a robot once and in each flow. Other methods and the null space use the same
for the commands that give forces.
"""

from copy import copy
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.kinds import groups_of
from finlab.actuators.response import Form, Line, Plane, Response, power_of, with_square
from finlab.allocation.dual.block import BlockContents, block_of
from finlab.allocation.method import USUAL_PERIOD_S
from finlab.allocation.policy import Policy
from finlab.arrays import NOTHING, Array
from finlab.core.calls import (
    NOMINAL,
    AnswerRow,
    Conditions,
    ConjugateMargins,
    Conjugates,
    Core,
    CoreAnswer,
    policy_record,
)
from finlab.core.fields import Record
from finlab.layout.layout import Layout
from finlab.physics.objective import wrench_scale_of
from finlab.physics.plant import Plant, plant_of

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

_NO_FORCE = 1e-12
"""Added to largest forces [N], so that nothing is divided by 0."""
_LEAST_POSITIVE = 1e-300
"""Stands for 0 where a number is divided by."""


class _PolicyRecord(NamedTuple):
    """A policy, and the same as the core reads it; both None where there is none."""

    policy: Policy | None
    record: Record | None


class Compiled:
    """The n actuators of one robot in one flow, as the core reads them: forces along one or two
    directions of each, ready for multipliers."""

    def __init__(
        self,
        layout: Layout,
        plant: Plant,
        wrench_scale: Array,
        period_s: float = USUAL_PERIOD_S,
        miss_cost: Array | None = None,
    ) -> None:
        """Compiles the actuators of a layout.

        Args:
            layout: the robot.
            plant: of the layout, at rest in the water; its effectiveness and the axes that count
                are used.
            wrench_scale: (6,) [N, N m], by which errors are normalized.
            period_s: time between ticks [s].
            miss_cost: (n, 6), of `miss_cost_of` in `finlab.physics.expected_miss`; None where a
                squared force costs nothing beside its power.

        Raises:
            DataError: a force table cannot be read.
        """
        self.count = layout.n
        """How many actuators there are."""
        self.miss_cost = miss_cost
        """As it was given; None where it costs nothing."""
        self._layout = layout
        self._wrench_scale = wrench_scale
        self._max_change = layout.rates * period_s
        self._is_free_angle: NDArray[np.bool_] = np.any(plant.turns, axis=1)
        self._own_effectiveness = plant.effectiveness
        self._counts = plant.counts.astype(np.float64)
        self.groups = groups_of(layout.actuators, plant.effectiveness)
        """Actuators by kind: indices, and the group of their responses."""
        self._compile()

    @classmethod
    def of(cls, layout: Layout) -> "Self":
        """Compiles a layout at rest in the water, with its own wrench scale and axes.

        Args:
            layout: the robot.

        Returns:
            What method `dual` compiles of it by its usual settings.

        Raises:
            DataError: a force table cannot be read.
        """
        return cls(layout, plant_of(layout).counting(layout.commanded), wrench_scale_of(layout))

    def _compile(self) -> None:
        """Prepares the robot for the core, from the responses of all groups."""
        responses: list[Any] = [None] * self.count
        forms: list[Any] = [None] * self.count
        self.uncertainty_cost = np.zeros(self.count)
        """What a squared force costs beside its power (n,) [W/N^2]."""
        for indices, group in self.groups:
            for i, response, form in zip(indices, group.responses, group.forms, strict=True):
                self.uncertainty_cost[i] = self._uncertainty_cost(i, response)
                responses[i] = _with_cost(response, float(self.uncertainty_cost[i]))
                forms[i] = form
        self.responses: list[Response] = responses
        """What each actuator offers for prices."""
        self.wrench_offset = self.wrench_offset_of(np.ones(self.count, bool))
        """Wrench (6,) [N, N m] at forces of 0, such as the drag of foils without lift."""
        self.ends = np.array([response.ends for response in self.responses])
        """Least and largest forces (n, 2) [N], of planes below 0 in reverse."""
        self.is_line = np.array([isinstance(response, Line) for response in self.responses])
        """Which have one direction (n,)."""
        self.turning_costs = np.array([form.turning_costs for form in forms])
        """Of which a change of the command's angle has a cost in a tick (n,)."""
        flow_speed = np.array([_flow_speed(response) for response in self.responses])
        self._largest_force = self._largest_forces(flow_speed)
        self.row_force_max = self._largest_force + _NO_FORCE
        """Largest force (n, 2) [N] along each direction, never 0."""
        self.effectiveness = np.array([response.rows for response in self.responses])
        """Wrench (n, 2, 6) per newton along each direction."""
        self.axes = np.array([_axes_of(form) for form in forms])
        """Axes (n, 3, 3) of the laws' forces in the actuators' own ones."""
        self.axis_scale = self._largest_wrench()
        """Size (6,) of what the robot can push along each axis [N, N m]; 1 where it cannot. Scaled
        wrenches are wrenches over it."""
        self.basis = self.span(np.ones(self.count, bool), np.ones(6, bool))
        """Directions (6, r) of scaled wrenches that the actuators span, orthonormal."""
        self.contents = BlockContents(
            responses=self.responses,
            forms=forms,
            command_min=self._layout.lower,
            command_max=self._layout.upper,
            max_change=self._max_change,
            is_free_angle=self._is_free_angle,
            force_range=self.ends,
            row_force_max=self.row_force_max,
            flow_speed=flow_speed,
            uncertainty_cost=self.uncertainty_cost,
            effectiveness=self.effectiveness,
            effectiveness_of_laws=self.axes @ self._own_effectiveness,
            wrench_scale=self._wrench_scale,
            wrench_offset=self.wrench_offset,
            is_commanded=self._counts,
            axis_scale=self.axis_scale,
            basis=self.basis,
        )
        """What the block says, by field."""
        self.block = block_of(self.contents)
        """The numbers that the core reads; see finlab/core/fl_fields.h."""
        self.core = Core(self.block, self.count)
        """The robot in the core."""
        self._last_policy = _PolicyRecord(None, None)
        """Of the last single target."""

    def _uncertainty_cost(self, i: int, response: Response) -> float:
        """What a squared force of actuator i costs beside its power [W/N^2]."""
        if self.miss_cost is None:
            return 0.0
        squared_effectiveness = response.effectiveness**2
        return float((squared_effectiveness @ self.miss_cost[i]).sum())

    def _largest_forces(self, flow_speed: Array) -> Array:
        """Largest forces (n, 2) [N] along both directions; the second one of a foil is its drag,
        which costs the power `flow_speed` (n,) [m/s] per newton."""
        largest = np.abs(self.ends).max(axis=1)
        second = largest.copy()
        for i in np.flatnonzero(self.is_line):
            second[i] = _drag(self.responses[i], flow_speed[i], largest[i])
        return np.stack([largest, second], axis=1)

    def _largest_wrench(self) -> Array:
        """Size (6,) of what the robot can push along each axis [N, N m]; 1 where it cannot."""
        columns = (self.effectiveness * self._largest_force[..., None]).reshape(-1, 6)
        size = np.sqrt((columns**2).sum(axis=0))
        largest = max(size.max(), _LEAST_POSITIVE)
        return np.where(size > NOTHING * largest, size, 1.0)

    def span(self, works: NDArray[np.bool_], counts: NDArray[np.bool_]) -> Array:
        """Finds what some actuators span in some axes.

        Args:
            works: which actuators (n,) work.
            counts: which axes (6,) count.

        Returns:
            Directions (6, r) of scaled wrenches that these actuators drive, orthonormal.
        """
        scaled = self.effectiveness * self._largest_force[..., None] / self.axis_scale
        is_driven = works[:, None, None] & counts
        columns = np.where(is_driven, scaled, 0.0).reshape(-1, 6).T
        left, singular_values, _ = np.linalg.svd(columns, full_matrices=False)
        least = NOTHING * max(singular_values[0], _LEAST_POSITIVE)
        return np.asarray(left[:, singular_values > least])

    @property
    def largest_power(self) -> float:
        """Power [W] of all actuators at the dearer ends of their sets."""
        pairs = zip(self.responses, self.ends, strict=True)
        return float(sum(power_of(each, ends).max() for each, ends in pairs))

    def wrench_offset_of(self, works: NDArray[np.bool_]) -> Array:
        """Returns the wrench (6,) [N, N m] at forces of 0 of the actuators that work (n,)."""
        wrench = np.zeros(6)
        for indices, group in self.groups:
            wrench = wrench + group.wrench_offset_at_rest[works[indices]].sum(axis=0)
        return wrench * self._counts

    def at(self, inflow: Array | None) -> "Compiled":
        """Returns the robot compiled in another flow.

        Args:
            inflow: velocities (n, 3) [m/s] of the actuators' positions through the water, in their
                own frames; None at rest.

        Returns:
            Another one; itself where no actuator feels the flow.
        """
        if not any(group.feels_flow for _, group in self.groups):
            return self
        other = copy(self)
        other.groups = []
        for indices, group in self.groups:
            inflow_of_group = None if inflow is None else inflow[indices]
            other.groups.append((indices, group.at(inflow_of_group)))
        other._compile()
        return other

    def forces(
        self,
        targets: Array,
        policy: Policy | None,
        multipliers: Array | None = None,
        conditions: Conditions = NOMINAL,
    ) -> CoreAnswer:
        """Asks the core for forces of least power, by the laws alone (Eq. 1).

        Args:
            targets: desired wrenches (N, 6) [N, N m].
            policy: what to give out of reach; None for nothing else than the targets.
            multipliers: lambda (6,) [W/N, W/(N m)] at which Newton's method begins, for a single
                target; None for its own.
            conditions: what holds of the robot.

        Returns:
            Forces, multipliers and commands, by the core's tables.
        """
        record = None if policy is None else core_policy(policy)
        if len(targets) == 1:
            return self.core.answer_one(targets[0], record, multipliers, conditions)
        return self.core.answer_many(targets, record, conditions)

    def answer_row(
        self,
        target: Array,
        policy: Policy | None,
        multipliers: Array | None,
        conditions: Conditions,
        most_error: float,
    ) -> AnswerRow:
        """Asks the core for one target, as `forces` does; see `Core.answer_row`."""
        last = self._last_policy  # read once: threads may share the robot
        if policy is not last.policy:
            last = _PolicyRecord(policy, None if policy is None else core_policy(policy))
            self._last_policy = last
        return self.core.answer_row(target, last.record, multipliers, conditions, most_error)

    @cached_property
    def _directions(self) -> Array:
        """Directions (n, 2, 3) of each actuator's forces in its own axes."""
        directions = np.zeros((self.count, 2, 6))
        own_axes = np.broadcast_to(np.eye(3, 6), (self.count, 3, 6))
        for indices, group in groups_of(self._layout.actuators, own_axes):
            for i, response in zip(indices, group.responses, strict=True):
                directions[i] = response.rows
        return directions[..., :3]

    @cached_property
    def conjugate_margins(self) -> ConjugateMargins:
        """How far the laws of the actuators may be above their tables, see
        `Group.conjugate_margins`; made at the first bound."""
        margins: list[Array | None] = [None] * self.count
        for indices, group in self.groups:
            for i, margin in zip(indices, group.conjugate_margins, strict=True):
                margins[i] = margin
        return ConjugateMargins(margins)

    @cached_property
    def is_certified(self) -> bool:
        """Whether the core alone proves bounds by the laws: all actuators have margins, and none
        has a gauge, whose table of directions has none."""
        has_gauge = any(
            isinstance(each, Plane) and each.gauge is not None for each in self.responses
        )
        return not has_gauge and self.conjugate_margins.are_complete

    def forces_along(self, force: Array) -> Array:
        """Returns forces (..., n, 3) [N] in own axes as those (..., n, 2) [N] along each actuator's
        directions."""
        return np.asarray(np.einsum("nka,...na->...nk", self._directions, force))

    def conjugates_by_laws(self, index: int, by_tables: Conjugates) -> Array | None:
        """Returns the conjugates of forces along their prices, by the laws of one group.

        Args:
            index: of the group, in `groups`.
            by_tables: conjugates of all n actuators, at N multipliers.

        Returns:
            Conjugates (N, m) [W] of the group's m actuators, or upper bounds of them; NaN, or None
            for all, where the tables say the same as the laws.
        """
        indices, group = self.groups[index]
        price = by_tables.price_ahead[:, indices]
        price_reverse = by_tables.price_reverse[:, indices]
        force_limits = np.stack(
            [by_tables.force_min[0, indices], by_tables.force_max[0, indices]], axis=-1
        )
        return group.radial_conjugate_bound(price, price_reverse, force_limits)


def _with_cost(response: Response, cost: float) -> Response:
    """The response of an actuator whose squared force costs so much more [W/N^2]. That of a foil
    stays: the core adds the cost itself, since the drag has a price of its own."""
    has_drag = isinstance(response, Line) and response.drag is not None
    return response if has_drag or not cost else with_square(response, cost)


def _flow_speed(response: Response) -> float:
    """Power per newton of drag [m/s] of a foil; 0 of all else."""
    if isinstance(response, Line) and response.drag is not None:
        return response.flow_speed
    return 0.0


def _drag(response: Response, flow_speed: float, force: float) -> float:
    """Drag [N], beyond that at rest, of a foil's lift; 0 of all else."""
    if flow_speed == 0.0:
        return 0.0
    power = power_of(response, np.array(force))
    power_at_rest = response.table.power_at_least
    return float((power - power_at_rest) / flow_speed)


def _axes_of(form: Form) -> Array:
    """Axes (3, 3) of a law's forces in the actuator's own ones."""
    return np.eye(3) if form.axes is None else form.axes


@lru_cache(maxsize=64)
def core_policy(policy: Policy) -> Record:
    """Returns a policy as the core reads it; equal ones have one record."""
    return policy_record(policy.kind, policy.axis_weights, policy.groups)
