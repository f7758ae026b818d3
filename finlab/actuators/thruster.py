"""Thrusters with a fixed axis: the force is the command, but none in the dead band.

Command: (force [N], 0, 0). Own frame: axis, and two directions across it, along which nothing acts.
The reaction torque of the propeller is part of the effectiveness.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from finlab.actuators.actuator import (
    Box,
    Command,
    Diameter,
    Faults,
    Metres,
    Place,
    Seconds,
    Uncertainty,
)
from finlab.actuators.propeller import (
    T200,
    ForceRate,
    OpenWater,
    Propeller,
    PropellerLaw,
    Threshold,
    force_words,
    form_of,
    given_force,
)
from finlab.actuators.response import Form, Group, Line
from finlab.actuators.thrust_model import Newtons, ThrustModel, check_force
from finlab.actuators.thrust_power import ThrustPower, radial_table
from finlab.arrays import Array, Values
from finlab.axes import Direction3, unit_vector
from finlab.errors import LayoutError
from finlab.files.schema import Name


class ThrusterLaw(PropellerLaw):
    """The law of n thrusters with a fixed axis, whose command is the force [N]."""

    column = 0

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        force = np.zeros_like(command)
        force[..., 0] = self.given(command)
        return force

    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        jacobian = np.zeros((*command.shape, 3))
        force = self.force(command)
        jacobian[..., 0, 0] = force[..., 0] == command[..., 0]
        return force, jacobian


class ThrusterGroup(Group):
    """What the thrusters of a robot offer for prices."""

    def __init__(self, thrusters: Sequence["Thruster"], effectiveness: Array) -> None:
        """Takes thrusters and the wrench (m, 3, 6) per newton along each own axis."""
        self._sign = np.array([1.0 if thruster.force[1] > 0.0 else -1.0 for thruster in thrusters])
        self.responses = [
            _line(thruster, sign * matrix[0])
            for thruster, sign, matrix in zip(thrusters, self._sign, effectiveness, strict=True)
        ]
        self._limits = np.array([given_force(thruster) for thruster in thrusters])
        self._power = ThrustPower([thruster.model for thruster in thrusters])

    @property
    def forms(self) -> list[Form]:
        pairs = zip(self._limits, self._sign, strict=True)
        return [form_of("thruster", given, sign) for given, sign in pairs]

    def radial_worth(self, price: Array, back: Array, ends: Array | None) -> Array:
        if ends is None:
            return self._power.worth(self._sign * price, *self._limits.T)
        low, high = np.sort(self._sign[:, None] * ends, axis=1).T
        return self._power.worth(self._sign * price, low, high)


def _line(thruster: "Thruster", along: Array) -> Line:
    """What one thruster offers; `along` (6,) is the wrench per newton, of one that only pulls in
    reverse."""
    least, most = given_force(thruster)
    if most <= 0.0:
        return Line(along, radial_table(thruster.model, -1, -most, -least), band=thruster.dead_band)
    reverse = radial_table(thruster.model, -1, 0.0, -least) if least < 0.0 else None
    ahead = radial_table(thruster.model, 1, max(least, 0.0), most)
    return Line(along, ahead, reverse, thruster.dead_band)


class ThrusterCommand(Command, frozen=True, rename={"force": "force_n"}):
    """The command of a thruster with a fixed axis, by name."""

    force: float
    """Force along its axis [N], signed."""
    input: float | None = None
    """What its table says to send for it, in the table's unit; None for a power law."""

    @property
    def words(self) -> str:
        return force_words(self.force, "", self.input)


@dataclass(frozen=True)
class Thruster(Propeller):
    """A thruster with a fixed axis; its command is the force. Checked on construction."""

    LAW = ThrusterLaw
    GROUP = ThrusterGroup
    NUMBERS = (("force", "N"),)
    COMMAND = ThrusterCommand
    LIMITS = ("force",)
    RATES = ("rate",)
    AXES = ("axis",)
    PUSHES = (0,)
    THRUST = 0
    TURNS = False
    FAULTS = ("weak", "stuck", "running")
    LOOKS = "thruster"
    BOXES = (
        Box(
            "Force [N]",
            "force",
            "Least and most along the axis; astern it is negative.",
            1.0,
            pair=True,
        ),
        *Propeller.BOXES,
    )
    type: ClassVar[str] = "thruster"

    name: Name
    """Unique within its layout."""
    position: Place
    """Where the force acts, body frame [m]."""
    axis: Direction3
    """Unit vector, body frame: direction of the force on the robot for a positive force."""
    force: tuple[Newtons, Newtons]
    """Least and most force [N]; one of them is 0 where the thruster pushes one way only."""
    model: ThrustModel
    """What power it takes."""
    dead_band: Threshold = 0.0
    """Forces smaller than this, other than 0, cannot be held [N]."""
    torque_per_newton: Metres = 0.0
    """Reaction torque about the axis per force, signed [m]."""
    time_constant: Seconds = 0.1
    """Time in which the force comes to 63 % of a new one [s]."""
    rate: ForceRate | None = None
    """How fast the commanded force changes at most [N/s]; None where nothing limits it."""
    uncertainty: Uncertainty | None = None
    """How far its force may be from that; None where nothing is known of it."""
    diameter: Diameter | None = None
    """Of the propeller [m], for its jet; None where it is guessed from the force."""
    open_water: OpenWater | None = None
    """Thrust coefficient at rest and the advance ratio of no thrust; None where they are
    unknown."""
    hangs: bool = False
    """Whether damage has left it a single force, that of both limits, of any sign; no file says
    so."""

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
        return cls("thruster", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-39.91, 51.44), T200)

    def damaged(self, faults: Faults) -> Self:
        left = faults.weak
        low, high = self.force
        weak = self if left is None else replace(self, force=(left * low, left * high))
        force = faults.stuck if faults.running is None else faults.running[0]
        return weak if force is None else weak.hung(force)
