"""A layout compiled for the dual: the responses of its actuators, as the core reads them, and the
bound that their conjugates prove.

Method `dual` compiles a robot once and in each flow. Other methods and the null space use the same
for the commands that give forces.
"""

from copy import copy
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.kinds import groups_of
from finlab.actuators.response import Group, Line, Plane, with_square
from finlab.allocation.dual.robot import CommandLimits, DualRobot
from finlab.allocation.settings import USUAL_PERIOD_S
from finlab.arrays import ROUNDING, Array
from finlab.core.calls import NOMINAL, Conditions, Conjugates
from finlab.layout.layout import Layout
from finlab.physics.objective import wrench_scale_of
from finlab.physics.plant import Plant, plant_of


class Compiled:
    """The n actuators of one robot in one flow, ready for multipliers."""

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
            miss_cost: of `miss_cost_of`, (n, 6); None where a squared force costs nothing beside
                its power.

        Raises:
            DataError: a force table cannot be read.
        """
        self.count = layout.n
        """How many actuators there are."""
        self.miss_cost = miss_cost
        """As it was given; None where it costs nothing."""
        self._actuators = layout.actuators
        self._wrench_scale = wrench_scale
        max_change = layout.rates * period_s
        self._limits = CommandLimits(layout.lower, layout.upper, max_change, plant.turns)
        self._effectiveness = plant.effectiveness
        self._counts = plant.counts.astype(np.float64)
        self.groups = groups_of(layout.actuators, plant.effectiveness)
        """Actuators by kind: indices, and the group of their responses."""
        self._single_of_group: dict[int, Group] = {}
        """Of each group all of whose responses are by the same tables, by its index: the first of
        its actuators as a group of its own, which answers for all."""
        for index, (indices, group) in enumerate(self.groups):
            if _shares_tables(group):
                first = slice(indices[0], indices[0] + 1)
                single = groups_of(layout.actuators[first], plant.effectiveness[first])
                self._single_of_group[index] = single[0][1]
        self._compile()

    @classmethod
    def of(cls, layout: Layout) -> Self:
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
        """Makes the robot of the core from the responses of all groups."""
        responses: list[Any] = [None] * self.count
        forms: list[Any] = [None] * self.count
        self.uncertainty_cost = np.zeros(self.count)
        """What a squared force costs beside its power (n,) [W/N^2]."""
        for indices, group in self.groups:
            for i, response, form in zip(indices, group.responses, group.forms, strict=True):
                if self.miss_cost is not None:
                    squared_effectiveness = response.effectiveness**2
                    cost = (squared_effectiveness @ self.miss_cost[i]).sum()
                    self.uncertainty_cost[i] = cost
                cost = float(self.uncertainty_cost[i])
                # Of a foil the core adds the cost itself, since the drag has a price of its own.
                drags = isinstance(response, Line) and response.drag is not None
                dearer = with_square(response, cost) if cost and not drags else response
                responses[i] = dearer
                forms[i] = form
        self.wrench_offset = self.wrench_offset_of(np.ones(self.count, bool))
        """Wrench (6,) [N, N m] at forces of 0, such as the drag of foils without lift."""
        self.robot = DualRobot(
            responses,
            forms,
            self._limits,
            self._effectiveness,
            self._wrench_scale,
            self.wrench_offset,
            self.uncertainty_cost,
            self._counts,
        )
        """The robot as the core reads it."""

    def wrench_offset_of(self, works: NDArray[np.bool_]) -> Array:
        """Returns the wrench (6,) [N, N m] at forces of 0 of the actuators that work (n,)."""
        wrench = np.zeros(6)
        for indices, group in self.groups:
            wrench = wrench + group.beside[works[indices]].sum(axis=0)
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
        other._single_of_group = {}
        for index, (indices, group) in enumerate(self.groups):
            inflow_of_group = None if inflow is None else inflow[indices]
            moved = group.at(inflow_of_group)
            other.groups.append((indices, moved))
            if moved is group and index in self._single_of_group:
                other._single_of_group[index] = self._single_of_group[index]
        other._compile()
        return other

    @cached_property
    def _directions(self) -> Array:
        """Directions (n, 2, 3) of each actuator's forces in its own axes."""
        directions = np.zeros((self.count, 2, 6))
        own_axes = np.broadcast_to(np.eye(3, 6), (self.count, 3, 6))
        for indices, group in groups_of(self._actuators, own_axes):
            for i, response in zip(indices, group.responses, strict=True):
                directions[i] = response.rows
        return directions[..., :3]

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
        single = self._single_of_group.get(index)
        if single is not None:
            # Identical tables: one actuator, within all that its limits allow, answers for all.
            bound = single.radial_conjugate_bound(
                price.reshape(-1, 1), price_reverse.reshape(-1, 1), None
            )
            return None if bound is None else bound.reshape(price.shape)
        force_limits = np.stack(
            [by_tables.force_min[0, indices], by_tables.force_max[0, indices]], axis=-1
        )
        return group.radial_conjugate_bound(price, price_reverse, force_limits)


def _shares_tables(group: Group) -> bool:
    """Whether all of two or more actuators push in planes by the very same tables."""
    if len(group.responses) < 2:
        return False
    planes = [response for response in group.responses if isinstance(response, Plane)]
    if len(planes) < len(group.responses):
        return False
    first = planes[0]
    return all(
        plane.table is first.table and plane.reverse is first.reverse for plane in planes[1:]
    )


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
    if robust == 0.0:
        return None
    from finlab.physics.expected_miss import uncertainties

    shares = np.array([0.0 if own is None else own.share for own in uncertainties(layout)])
    if not shares.any():
        return None
    return np.multiply.outer(robust * shares**2, (0.01 * wrench_scale) ** -2.0)


def power_bound(
    compiled: Compiled, wrench: Array, multipliers: Array, conditions: Conditions = NOMINAL
) -> Array:
    """Returns a lower bound of the power by weak duality (Eq. 3), with conjugates by the laws.

    Args:
        compiled: the robot.
        wrench: (N, 6) [N, N m] that is given.
        multipliers: lambda (N, 6) [W/N, W/(N m)]; any prove a bound.
        conditions: what holds of the robot.

    Returns:
        Power (N,) [W] that no answer undercuts which gives these wrenches under the conditions.
    """
    by_tables = compiled.robot.core.conjugates(multipliers, conditions)
    conjugate = by_tables.conjugate.copy()
    for index, (indices, group) in enumerate(compiled.groups):
        along_price = compiled.conjugates_by_laws(index, by_tables)
        in_all_directions = group.conjugate_bound(multipliers)
        for by_laws in (along_price, in_all_directions):
            if by_laws is not None:
                is_said = ~np.isnan(by_laws)
                conjugate[:, indices] = np.where(is_said, by_laws, conjugate[:, indices])
    wrench_offset = compiled.wrench_offset
    if conditions.lost is not None:
        conjugate[:, conditions.lost] = 0.0
        wrench_offset = compiled.wrench_offset_of(~conditions.lost)
    paid = multipliers * (wrench - wrench_offset)
    rounding = ROUNDING * (np.abs(paid).sum(axis=1) + np.abs(conjugate).sum(axis=1))
    return np.asarray(paid.sum(axis=1) - conjugate.sum(axis=1) - rounding)
