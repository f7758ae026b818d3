"""Thrusters with a fixed axis: the command is the force, which is 0 in the dead band.

Command: (force [N], 0, 0). Own frame: axis, and two axes across it, along which nothing acts. The
reaction torque of the propeller is part of the effectiveness.
"""

from __future__ import annotations  # help() then prints `Newtons`, not the bounds of one

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from finlab.actuators.actuator import (
    Command,
    CommandNumber,
    Diameter,
    Faults,
    Kind,
    Metres,
    Place,
    Seconds,
    Uncertainty,
)
from finlab.actuators.propeller import (
    FORMULAS,
    T200,
    T200_FORCE,
    T200_FORCE_ASTERN,
    ForceRate,
    OpenWater,
    Propeller,
    PropellerLaw,
    Threshold,
    force_words,
    form_of,
    power_law_margins,
    usable_force,
)
from finlab.actuators.response import Form, Group, Line
from finlab.actuators.thrust_model import Newtons, ThrustModel, check_force
from finlab.actuators.thrust_power import ThrustPower, radial_table
from finlab.arrays import Array, Values
from finlab.axes import Direction3, unit_vector
from finlab.errors import LayoutError
from finlab.files.schema import Name

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own


class ThrusterLaw(PropellerLaw):
    """Law of n thrusters with a fixed axis: force along the first own axis [N]."""

    column = 0
    formula_kind = "FL_FIXED_PROPELLER"

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        force = np.zeros_like(command)
        force[..., 0] = self.thrust(command)
        return force

    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        jacobian = np.zeros((*command.shape, 3))
        force = self.force(command)
        jacobian[..., 0, 0] = force[..., 0] == command[..., 0]
        return force, jacobian


class ThrusterGroup(Group):
    """Responses to prices of m thrusters (Eq. 5)."""

    def __init__(self, thrusters: Sequence[Thruster], effectiveness: Array) -> None:
        """Tabulates the responses.

        Args:
            thrusters: m thrusters.
            effectiveness: wrench (m, 3, 6) of 1 N along each own axis [1, m], body frame.
        """
        self._sign = np.array([1.0 if thruster.force[1] > 0.0 else -1.0 for thruster in thrusters])
        self.responses = []
        for thruster, sign, matrix in zip(thrusters, self._sign, effectiveness, strict=True):
            self.responses.append(_line(thruster, sign * matrix[0]))
        self._limits = np.array([usable_force(thruster) for thruster in thrusters])
        self._power = ThrustPower([thruster.model for thruster in thrusters])
        self._margins = power_law_margins(thrusters)

    @property
    def conjugate_margins(self) -> list[Array | None]:
        return self._margins

    @property
    def forms(self) -> list[Form]:
        forms = []
        for limits, sign in zip(self._limits, self._sign, strict=True):
            forms.append(form_of("thruster", limits, sign))
        return forms

    def radial_conjugate_bound(
        self, price: Array, price_reverse: Array, force_limits: Array
    ) -> Array:
        low, high = np.sort(self._sign[:, None] * force_limits, axis=1).T
        return self._power.conjugate(self._sign * price, low, high)


def _line(thruster: Thruster, along: Array) -> Line:
    """Response of one thruster; `along` (6,) is its wrench per newton [1, m], of one whose force is
    never positive that of a negative force."""
    least, most = usable_force(thruster)
    if most <= 0.0:
        return Line(
            along, radial_table(thruster.model, -1, -most, -least), dead_band=thruster.dead_band
        )
    reverse = radial_table(thruster.model, -1, 0.0, -least) if least < 0.0 else None
    ahead = radial_table(thruster.model, 1, max(least, 0.0), most)
    return Line(along, ahead, reverse, thruster.dead_band)


class ThrusterCommand(Command, frozen=True, rename={"force": "force_n"}):
    """The command of a thruster with a fixed axis, by name."""

    force: float
    """Force along its axis [N], signed."""
    input: float | None = None
    """Input for that force by its table, in the table's unit; None of one with a power law."""

    @property
    def words(self) -> str:
        return force_words(self.force, "", self.input)


@dataclass(frozen=True)
class Thruster(Propeller):
    """A thruster with a fixed axis; its command is the force. Checked on construction.

    Args:
        name: unique within its layout.
        position: where the force acts, body frame [m].
        axis: direction of the force on the robot for a positive command, unit vector, body frame
            [1].
        force: least and most force along `axis` [N]; one of them is 0 where it pushes one way only.
        model: electrical power over the force [W]: `PowerLaw` or `PowerTable`.
        dead_band: forces smaller than this, other than 0, cannot be held [N].
        torque_per_newton: reaction torque about the axis per force, signed [m].
        time_constant: time in which the force comes to 63 % of a new command [s].
        rate: largest change of the commanded force [N/s]; None: nothing limits it.
        uncertainty: standard deviation of its force [N]; None: nothing is known of it.
        diameter: diameter of the propeller, for its jet [m]; None: estimated from the force.
        open_water: thrust coefficient at rest, and the advance ratio of no thrust [1]; None:
            unknown.
        hangs: whether damage has left it a single force of any sign, that of both limits (a truth
            value, which no file has).

    Raises:
        LayoutError: a value is out of its bounds; the message names the argument.

    Example:
        >>> import finlab
        >>> power = finlab.PowerLaw(0.997, 1.449)
        >>> finlab.Thruster("bow", (0.4, 0, 0), (0, 1, 0), (-39.9, 51.4), power).force
        (-39.9, 51.4)
    """

    type: ClassVar[str] = "thruster"
    KIND: ClassVar[Kind] = Kind(
        law=ThrusterLaw,
        group=ThrusterGroup,
        command=ThrusterCommand,
        numbers=(CommandNumber(name="force", unit="N", limits="force", rate="rate"),),
        axes=("axis",),
        pushes_along=("axis",),
        pointed="axis",
        drawn_as="thruster",
        faults=("weak", "stuck", "running"),
        models=FORMULAS,
    )

    name: Name
    position: Place
    axis: Direction3
    force: tuple[Newtons, Newtons]
    model: ThrustModel
    dead_band: Threshold = 0.0
    torque_per_newton: Metres = 0.0
    time_constant: Seconds = 0.1
    rate: ForceRate | None = None
    uncertainty: Uncertainty | None = None
    diameter: Diameter | None = None
    open_water: OpenWater | None = None
    hangs: bool = False

    def check_together(self) -> None:
        """See `Actuator`."""
        super().check_together()
        object.__setattr__(self, "axis", unit_vector("axis", self.axis))
        check_force(self.model, self.force)
        least, most = self.force
        if self.hangs and least == most:
            return
        if not least <= 0.0 <= most or least == most:
            raise LayoutError(
                f"must include 0, and more than that, got {least:g} and {most:g}", "force"
            )
        if self.dead_band > max(-least, most):
            raise LayoutError(
                f"leaves no force, got {self.dead_band:g} beside {least:g} .. {most:g} N",
                "dead_band",
            )

    @classmethod
    def sample(cls) -> Self:
        """See `Actuator`: a T200 of Blue Robotics at 16 V, as shipped layouts have it."""
        return cls(
            name="thruster",
            position=(0.0, 0.0, 0.0),
            axis=(1.0, 0.0, 0.0),
            force=(T200_FORCE_ASTERN, T200_FORCE),
            model=T200,
        )

    def damaged(self, faults: Faults) -> Self:
        weak = self
        if faults.weak is not None:
            low, high = self.force
            weak = replace(self, force=(faults.weak * low, faults.weak * high))
        force = faults.stuck if faults.running is None else faults.running[0]
        return weak if force is None else weak.hung(force)
