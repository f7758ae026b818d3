"""A layout compiled for the dual: the answers of its actuators, and the commands for the forces
found."""

from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.actuator import Indices
from finlab.actuators.kinds import groups_of
from finlab.actuators.response import Group, Line, Plane, with_square
from finlab.allocation.dual.robot import DualRobot
from finlab.arrays import ROUNDING, Array
from finlab.core.calls import STILL, Now, Worth
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant


class Compiled:
    """The actuators of one robot, ready for prices."""

    def __init__(
        self,
        layout: Layout,
        plant: Plant,
        yardstick: Array,
        period_s: float = 0.1,
        doubt: Array | None = None,
    ) -> None:
        """Compiles the actuators of a layout with the effectiveness of a plant, for errors on a
        yardstick
        (6,) and ticks of a period; what a squared force costs beside its power is `doubt`, see
        `price_of_doubt`. Errors as for `FinGroup`."""
        self.count = layout.n
        self._actuators = layout.actuators
        self._yardstick = yardstick
        self._limits = layout.lower, layout.upper, layout.rates * period_s, plant.turns
        self._effectiveness = plant.effectiveness
        self._counts = plant.counts.astype(np.float64)
        self.doubt = doubt
        """The same; None where it costs nothing."""
        self.groups = groups_of(layout.actuators, plant.effectiveness)
        self._alike: list[tuple[Group, Group]] = []
        for places, group in self.groups:
            tables = [(r.table, r.reverse) for r in group.responses if isinstance(r, Plane)]
            same = all(a is b for pair in tables for a, b in zip(pair, tables[0], strict=True))
            if same and len(tables) == len(group.responses) > 1:
                first = slice(places[0], places[0] + 1)
                self._alike += [
                    (group, groups_of(layout.actuators[first], plant.effectiveness[first])[0][1])
                ]
        self._prepare()

    def _prepare(self) -> None:
        responses: list[Any] = [None] * self.count
        forms: list[Any] = [None] * self.count
        self.weight = np.zeros(self.count)
        """What doubt makes a squared force (n,) cost [W/N^2]."""
        for places, group in self.groups:
            for place, response, form in zip(places, group.responses, group.forms, strict=True):
                if self.doubt is not None:
                    self.weight[place] = (response.effectiveness**2 @ self.doubt[place]).sum()
                weight = float(self.weight[place])
                drags = isinstance(response, Line) and response.drag is not None
                doubted = with_square(response, weight) if weight and not drags else response
                responses[place] = doubted
                forms[place] = form
        self.beside = self.beside_of_working(np.ones(self.count, bool))
        """Wrench (6,) [N, N m] beside the answers' forces, such as the drag of foils without
        lift."""
        self.robot = DualRobot(
            responses,
            forms,
            self._limits,
            self._effectiveness,
            self._yardstick,
            self.beside,
            self.weight,
            self._counts,
        )

    def beside_of_working(self, works: NDArray[np.bool_]) -> Array:
        """Returns the wrench (6,) beside the forces of the actuators that work (n,)."""
        each = (group.beside[works[places]].sum(axis=0) for places, group in self.groups)
        return sum(each, np.zeros(6)) * self._counts

    def at(self, inflow: Array | None) -> "Compiled":
        """The same in another flow: velocities (n, 3) [m/s] of the actuators' places in their own
        frames."""
        if not any(group.feels_flow for _, group in self.groups):
            return self
        other = copy(self)
        other.groups = [
            (places, group.at(None if inflow is None else inflow[places]))
            for places, group in self.groups
        ]
        other._prepare()
        return other

    @cached_property
    def _directions(self) -> Array:
        """Directions (n, 2, 3) of each actuator's forces in its own axes."""
        own = np.zeros((self.count, 2, 6))
        for places, group in groups_of(
            self._actuators, np.broadcast_to(np.eye(3, 6), (self.count, 3, 6))
        ):
            for place, response in zip(places, group.responses, strict=True):
                own[place] = response.rows
        return own[..., :3]

    def forces_along(self, force: Array) -> Array:
        """Forces (..., n, 2) [N] along each actuator's directions of forces (..., n, 3) [N] in own
        axes."""
        return np.asarray(np.einsum("nka,...na->...nk", self._directions, force))

    def radial_worth(self, group: Group, places: Indices, worth: Worth) -> Array | None:
        """Returns what forces are worth by the laws of a group at some places; see
        `Group.radial_worth`. Where all actuators are alike, one answers for all."""
        ahead = worth.price_ahead[:, places]
        back = worth.price_reverse[:, places]
        ends = np.stack([worth.force_min[0, places], worth.force_max[0, places]], axis=-1)
        for alike, one in self._alike:
            if alike is group:
                most = one.radial_worth(ahead.reshape(-1, 1), back.reshape(-1, 1), None)
                return None if most is None else most.reshape(ahead.shape)
        return group.radial_worth(ahead, back, ends)


def price_of_doubt(layout: Layout, scale: Array, robust: float) -> Array | None:
    """Returns what a squared force of each actuator costs for the squared effectiveness of each
    axis (n, 6) [W, W/m^2 per N^2] where a miss of 1 % of the yardstick `scale` (6,) costs `robust`
    [W], growing with the square; None where nothing does. A `DataError` where a force table cannot
    be read."""
    if robust == 0.0:
        return None
    from finlab.physics.expected_miss import uncertainties

    shares = np.array([0.0 if own is None else own.share for own in uncertainties(layout)])
    return np.multiply.outer(robust * shares**2, (0.01 * scale) ** -2.0) if shares.any() else None


def proved_power(compiled: Compiled, wrench: Array, price: Array, now: Now = STILL) -> Array:
    """Returns the power (N,) [W] that no answer undercuts which gives wrenches (N, 6) with what may
    be given now, by prices (N, 6) [W/N, W/(N m)]."""
    worth = compiled.robot.core.worth(price, now)
    most = worth.conjugate.copy()
    for places, group in compiled.groups:
        for own in (compiled.radial_worth(group, places, worth), group.worth(price)):
            if own is not None:
                most[:, places] = np.where(np.isnan(own), most[:, places], own)
    beside = compiled.beside
    if now.lost is not None:
        most[:, now.lost] = 0.0
        beside = compiled.beside_of_working(~now.lost)
    paid = price * (wrench - beside)
    rounding = ROUNDING * (np.abs(paid).sum(axis=1) + np.abs(most).sum(axis=1))
    return np.asarray(paid.sum(axis=1) - most.sum(axis=1) - rounding)
