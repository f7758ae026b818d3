"""Costs that an allocation minimizes: mean power in watts, or the paper's effort `J_en`; and the
wrench scale of a robot, by which errors are normalized.

`J_en` is a sum of squares and one product of normalized commands. Methods, the score of an answer,
the judge of logs and the experiments use this module.
"""

import math
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array, Values, has_nan
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
    """Returns the divisors (..., 3) that normalize commands: the sizes of the fins' upper limits.

    An upper limit of zero or below, such as that of an arc below zero, would divide by zero or
    change the sign; so its absolute value is taken, and at least `LEAST_SCALE`.

    Args:
        upper: upper limits (..., 3) [rad, Hz, rad], an array or a tensor.
    """
    return abs(upper).clip(LEAST_SCALE)


def effort_of_shares(amplitude: Values, frequency: Values, zero_direction: Values) -> Values:
    """Returns the summand (...,) of one fin in `J_en` (the paper's Eq. 9).

    Args:
        amplitude: over its scale (...,) [1]; an array, a tensor or a symbol.
        frequency: over its scale (...,) [1].
        zero_direction: over its scale (...,) [1].
    """
    a = amplitude
    f = frequency
    d = zero_direction
    return AMPLITUDE * a * a + FREQUENCY * f * f + ZERO_DIRECTION * d * d + PRODUCT * a * f


def fin_effort(command: Values, upper: Values) -> Values:
    """Returns the effort (...,) of each fin.

    Args:
        command: commands (..., 3) [rad, Hz, rad], an array or a tensor.
        upper: upper limits (..., 3) [rad, Hz, rad].
    """
    scaled = command / effort_scale(upper)
    return effort_of_shares(scaled[..., 0], scaled[..., 1], scaled[..., 2])


def command_effort(command: NDArray[np.floating], upper: NDArray[np.floating]) -> AnyArray:
    """Returns the effort `J_en` (...,) of robots (the paper's Eq. 9).

    Args:
        command: commands (..., n, 3) [rad, Hz, rad]; a row of NaN is a lost fin and adds nothing.
        upper: upper limits (n, 3) [rad, Hz, rad].
    """
    effort = fin_effort(command, upper)
    return np.asarray(np.where(np.isnan(effort), 0.0, effort).sum(-1))


class EffortMeter:
    """Effort `J_en` of one robot all of whose fins work, as a quadratic form u^T Q u / 2 of its
    commands u."""

    def __init__(self, upper: Array) -> None:
        """Computes the matrix Q for upper limits (n, 3) [rad, Hz, rad]."""
        self.upper = upper
        self._scale = effort_scale(upper)
        weights = np.array([AMPLITUDE, FREQUENCY, ZERO_DIRECTION])
        self._hessian_diagonal = 2.0 * weights / self._scale**2
        """Diagonal (n, 3) of Q."""
        self._hessian_product = PRODUCT / (self._scale[:, 0] * self._scale[:, 1])
        """Entries (n,) of Q for amplitude and frequency of one fin."""
        size = self._hessian_diagonal.size
        unit_commands = np.eye(size).reshape(size, *upper.shape)
        self._hessian = self.gradient(unit_commands).reshape(size, size)
        """Q (3 n, 3 n)."""

    def __call__(self, command: NDArray[np.floating]) -> AnyArray:
        """Returns the efforts (R,) of commands (R, n, 3)."""
        numbers = command.reshape(len(command), len(self._hessian))
        # J = u^T Q u / 2
        effort: AnyArray = 0.5 * (numbers @ self._hessian * numbers).sum(axis=-1)
        return effort

    @cached_property
    def _weights(self) -> list[tuple[float, float, float, float]]:
        """Of each fin what its effort is for a squared number of its command, three, and for the
        product of the first two."""
        squares = (0.5 * self._hessian_diagonal).tolist()
        products = self._hessian_product.tolist()
        return [(*own, product) for own, product in zip(squares, products, strict=True)]

    def of_one(self, command: Array) -> float:
        """Returns the effort of one command (n, 3), of which a row of NaN is a lost fin and adds
        nothing; fin by fin, which takes a fifth of the time of arrays."""
        effort = 0.0
        for numbers, weights in zip(command.tolist(), self._weights, strict=True):
            A, f, phi = numbers
            by_A, by_f, by_phi, by_A_f = weights
            if not math.isnan(A):
                effort += by_A * A * A + by_f * f * f + by_phi * phi * phi + by_A_f * A * f
        return effort

    def gradient(self, command: NDArray[np.floating]) -> AnyArray:
        """Returns the derivatives Q u (R, n, 3) of the efforts by commands u (R, n, 3)."""
        gradient: AnyArray = command * self._hessian_diagonal
        gradient[..., 0] += self._hessian_product * command[..., 1]
        gradient[..., 1] += self._hessian_product * command[..., 0]
        return gradient

    def with_gradient(self, command: NDArray[np.floating]) -> tuple[AnyArray, AnyArray]:
        """Returns the efforts (R,) of commands (R, n, 3), and their derivatives (R, n, 3)."""
        gradient = self.gradient(command)
        # J = u^T Q u / 2
        effort: AnyArray = 0.5 * np.einsum("rni,rni->r", gradient, command)
        return effort, gradient


Name = Literal["power", "effort"]
"""`power`: mean mechanical watts by each fin's own model. `effort`: the paper's energy proxy
`J_en`."""


class PowerMeter:
    """Power of one robot all of whose actuators work."""

    def __init__(self, plant: Plant) -> None:
        """Takes the plant of the robot."""
        self._plant = plant

    def __call__(self, command: Array) -> Array:
        """Returns the power (R,) [W] of commands (R, n, 3)."""
        total: Array = self._plant.power(command).sum(-1)
        return total

    def gradient(self, command: Array) -> Array:
        """Returns the derivatives (R, n, 3) of the power by commands (R, n, 3)."""
        return self._plant.power_gradient(command)


CostMeter = PowerMeter | EffortMeter
"""Costs (R,) of commands (R, n, 3) of one robot, and their gradients."""


def cost_meter(objective: Name, plant: Plant) -> CostMeter:
    """Returns the cost function of a robot.

    Args:
        objective: the cost by name.
        plant: the robot; of fins alone for `effort`.
    """
    return PowerMeter(plant) if objective == "power" else EffortMeter(plant.upper)


STEPS = (9, 9, 17)
"""Values of each of an actuator's three command numbers on the grid over its limits that is
searched for its largest force."""
LEAST_LEVER = 1e-3
"""Least ratio [m] of the scale of torques to that of forces, for robots whose actuators give no
torque."""


def wrench_scale_of(layout: Layout) -> Array:
    """Returns the wrench scale sigma (6,) of a robot: three times F [N], three times T [N m].

    F is the root of the sum of squares of the actuators' largest forces, and T is F times the root
    mean square of their levers: each one's largest torque about the origin over its largest force.
    So the ratio of T to F depends on the positions of the actuators alone, and does not change
    while rates, damage or a tick reduce the limits of some of them. A robot without force has
    F = 1 N.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    plant = Plant(layout)
    force = plant.force(plant.grid(STEPS))
    wrench = np.einsum("kni,niw->knw", force, plant.effectiveness)
    largest_forces = np.linalg.norm(wrench[..., :3], axis=-1).max(axis=0)
    largest_torques = np.linalg.norm(wrench[..., 3:], axis=-1).max(axis=0)
    # F = sqrt(sum f_i^2), and l = sqrt(mean (t_i / f_i)^2) over those with a force
    force_scale = float(np.sqrt((largest_forces**2).sum())) or 1.0
    has_force = largest_forces > 0.0
    levers = largest_torques[has_force] / largest_forces[has_force]
    lever = float(np.sqrt((levers**2).mean())) if has_force.any() else 0.0
    torque_scale = max(lever, LEAST_LEVER) * force_scale
    scale = np.repeat([force_scale, torque_scale], 3)
    scale.setflags(write=False)
    return scale


REACHED = 1e-3
"""Error over the wrench scale up to which a wrench counts as delivered [1]."""


def judged_power(plant: Plant, command: Array) -> Array:
    """Returns the mean mechanical power of a robot.

    Args:
        plant: the robot.
        command: commands (N, n, 3); a row of NaN is a lost actuator and takes no power.

    Returns:
        (N,) [W].
    """
    power = plant.power(command)
    total = power.sum(axis=-1)
    if has_nan(total):  # `nansum` takes ten times as long
        total = np.nansum(power, axis=-1)
    return np.asarray(total)


def judged_effort(layout: Layout, command: Array) -> Array:
    """Returns the effort `J_en` (N,) of a robot of fins, the paper's energy proxy.

    Args:
        layout: the robot.
        command: commands (N, n, 3) [rad, Hz, rad]; a row of NaN is a lost fin and adds nothing.
    """
    effort = _effort_meter(layout)(command)
    if has_nan(effort):
        is_lost = np.isnan(command).any(axis=-1, keepdims=True)
        effort = _effort_meter(layout)(np.where(is_lost, 0.0, command))
    return np.asarray(effort)


def effort_of_one(layout: Layout, command: Array) -> float:
    """Returns the effort `J_en` of one command (n, 3) of a robot of fins; a row of NaN is a lost
    fin and adds nothing."""
    return _effort_meter(layout).of_one(command)


def costs(layout: Layout, command: Array) -> tuple[Array, Array]:
    """Returns the effort (K,) and the power (K,) [W] of a robot of fins that all work.

    Args:
        layout: the robot.
        command: commands (K, n, 3) [rad, Hz, rad].
    """
    effort = _effort_meter(layout)(command)
    power = judged_power(plant_of(layout), command)
    return effort, power


@lru_cache(maxsize=256)
def _effort_meter(layout: Layout) -> EffortMeter:
    """The effort of a robot of fins; cached, since every answer of one robot asks for it."""
    return EffortMeter(layout.upper)
