"""Costs that an allocation keeps least: mean power in watts, or the paper's effort `J_en`; and the
yardstick of a robot, with which errors are compared.

`J_en` is a sum of squares and one product of normalized commands.
"""

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array, Values
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant, plant_of

AMPLITUDE = 1.0
"""Weight of the squared normalized amplitude; the paper prints no weights."""
FREQUENCY = 1.0
"""Weight of the squared normalized frequency."""
ZERO_DIRECTION = 0.1
"""Weight of the squared normalized zero direction."""
PRODUCT = 1.0
"""Weight of normalized amplitude times normalized frequency."""
LEAST_SCALE = 1e-3
"""Least scale of a command [rad, Hz, rad]."""


def effort_scale(upper: Values) -> Values:
    """What each command is divided by: its own fin's upper limit (..., 3), an array or a tensor.

    One of zero or below, such as that of an arc below zero, would blow up or change the sign: its
    size counts, and no less than a floor.
    """
    return abs(upper).clip(LEAST_SCALE)


def effort_of_shares(amplitude: Values, frequency: Values, zero_direction: Values) -> Values:
    """One fin's summand of `J_en`, from commands over their scale: arrays, tensors or symbols."""
    a = amplitude
    f = frequency
    d = zero_direction
    return AMPLITUDE * a * a + FREQUENCY * f * f + ZERO_DIRECTION * d * d + PRODUCT * a * f


def fin_effort(command: Values, upper: Values) -> Values:
    """Energy (...,) of each fin: commands (..., 3) and upper limits (..., 3), arrays or tensors."""
    scaled = command / effort_scale(upper)
    return effort_of_shares(scaled[..., 0], scaled[..., 1], scaled[..., 2])


def command_effort(command: NDArray[np.floating], upper: NDArray[np.floating]) -> AnyArray:
    """`J_en` (the paper's Eq. 9) of whole robots: commands (..., n, 3) to energies (...,). Lost
    fins (NaN) count nothing."""
    effort = fin_effort(command, upper)
    return np.asarray(np.where(np.isnan(effort), 0.0, effort).sum(-1))


class EffortMeter:
    """The energy proxy of one robot whose fins are all healthy, ready for many commands."""

    def __init__(self, upper: Array) -> None:
        """Make it for upper limits (n, 3)."""
        self.upper = upper
        self._scale = effort_scale(upper)
        squares = np.array([AMPLITUDE, FREQUENCY, ZERO_DIRECTION])
        self._twice = 2.0 * squares / self._scale**2
        self._product = PRODUCT / (self._scale[:, 0] * self._scale[:, 1])

    def __call__(self, command: NDArray[np.floating]) -> AnyArray:
        """Energies (R,) of commands (R, n, 3)."""
        return self.with_gradient(command)[0]

    def gradient(self, command: NDArray[np.floating]) -> AnyArray:
        """Derivatives (R, n, 3) of the energies by commands (R, n, 3)."""
        gradient: AnyArray = command * self._twice
        gradient[..., 0] += self._product * command[..., 1]
        gradient[..., 1] += self._product * command[..., 0]
        return gradient

    def with_gradient(self, command: NDArray[np.floating]) -> tuple[AnyArray, AnyArray]:
        """Both, for little more than the price of one."""
        gradient = self.gradient(command)
        # Of a quadratic form, half the slopes times the commands.
        return 0.5 * np.einsum("rni,rni->r", gradient, command), gradient


Name = Literal["power", "effort"]
"""`power`: mean mechanical watts by each fin's own model. `effort`: the paper's energy proxy
`J_en`."""


class PowerMeter:
    """The power of one robot whose fins are all healthy, ready for many commands."""

    def __init__(self, plant: Plant) -> None:
        """Make it for the fins of a plant."""
        self._plant = plant

    def __call__(self, command: Array) -> Array:
        """Power (R,) [W] of commands (R, n, 3)."""
        total: Array = self._plant.power(command).sum(-1)
        return total

    def gradient(self, command: Array) -> Array:
        """Derivatives (R, n, 3) of the power by commands (R, n, 3)."""
        return self._plant.power_gradient(command)


CostMeter = PowerMeter | EffortMeter
"""Commands (R, n, 3) of one robot to costs (R,), and their slopes."""


def cost_meter(objective: Name, plant: Plant) -> CostMeter:
    """Returns the meter of what the commands of a robot cost."""
    return PowerMeter(plant) if objective == "power" else EffortMeter(plant.upper)


STEPS = (9, 9, 17)
"""Values of each of its three numbers that an actuator is tried with, evenly spread over its
limits."""
LEAST_LEVER = 1e-3
"""Least ratio [m] of the scale of torques to that of forces, for robots whose actuators turn
nothing."""


def yardstick(layout: Layout) -> Array:
    """The scales (6,) of a robot's wrench: three times F [N], three times T [N m].

    F is the root of the sum of squares of the actuators' largest forces, and T is F times the root
    mean square of their levers: each one's largest torque about the origin over its largest force.
    So how a force compares with a torque is a matter of where actuators stand, and stays as it is
    while rates, damage or a tick leave some of them less to give. A robot that gives nothing has F
    = 1 N. Raises DataError: a fin's force table cannot be read."""
    plant = Plant(layout)
    wrench = np.einsum("kni,niw->knw", plant.force(plant.grid(STEPS)), plant.effectiveness)
    forces = np.linalg.norm(wrench[..., :3], axis=-1).max(axis=0)
    torques = np.linalg.norm(wrench[..., 3:], axis=-1).max(axis=0)
    force = float(np.sqrt((forces**2).sum())) or 1.0
    pushes = forces > 0.0
    levers = torques[pushes] / forces[pushes]
    lever = float(np.sqrt((levers**2).mean())) if pushes.any() else 0.0
    scale = np.repeat([force, max(lever, LEAST_LEVER) * force], 3)
    scale.setflags(write=False)
    return scale


REACHED = 1e-3
"""Share of the yardstick up to which an error is none: the wrench counts as delivered."""


def judged_power(plant: Plant, command: Array) -> Array:
    """Mean mechanical power (N,) [W] of commands (N, n, 3); what is lost (NaN) takes none."""
    return np.asarray(np.nansum(plant.power(command), axis=-1))


def judged_effort(layout: Layout, command: Array) -> Array:
    """Effort `J_en` (N,) of commands (N, n, 3), the paper's energy proxy, without what is lost
    (NaN)."""
    lost = np.isnan(command).any(axis=-1, keepdims=True)
    return np.asarray(_meter(layout)(np.where(lost, 0.0, command) if lost.any() else command))


def costs(layout: Layout, command: Array) -> tuple[Array, Array]:
    """Effort (K,) and power (K,) [W] of commands (K, n, 3) of fins that all work."""
    return _meter(layout)(command), judged_power(plant_of(layout), command)


@lru_cache(maxsize=256)
def _meter(layout: Layout) -> EffortMeter:
    return EffortMeter(layout.upper)
