"""Methods `qp` and `paper_sqp`, the paper's optimizers (its section on baseline methods).

Both keep the normalized tracking error J_norm (its Eq. 8) least within the box of each fin's
limits, by least squares over a linear map of commands to wrenches. `qp` linearizes once per layout,
`paper_sqp` again at every iterate. Commands are positions between the limits, 0 at the lower and 1
at the upper one.
"""

from dataclasses import dataclass
from functools import cached_property
from time import thread_time

import numpy as np
from scipy.optimize import lsq_linear

from finlab.allocation.baselines.pseudo_inverse import SOLVED, ModelBased, TimeLimitedSettings
from finlab.allocation.method import number
from finlab.arrays import Array
from finlab.physics import Plant

DIFFERENCE_STEP = 1e-4
"""Half width of the central differences, as a share of each command's range."""
SHORTEST = 1e-9
"""Step from which on an iterate has settled, as a share of the ranges."""
SUFFICIENT = 1e-4
"""Share of the decrease that the linear map predicts, below which a step is halved (Armijo)."""
HALVINGS = 30
"""Most halvings of a step."""


class LinearMap:
    """The actuation map of a layout, linearized by central differences at the middle of the
    limits."""

    def __init__(self, plant: Plant, error_scale: Array) -> None:
        self.reference = (plant.lower + plant.upper) / 2
        n = self.reference.size
        offset = DIFFERENCE_STEP * np.eye(n).reshape(n, -1, 3) * plant.width
        rise = plant.wrench(self.reference + offset) - plant.wrench(self.reference - offset)
        self.has_range = plant.width.ravel() > 0
        """Commands (3 n,) that have a range at all; SciPy takes no others."""
        self.matrix = (rise / (2 * DIFFERENCE_STEP) / error_scale).T[:, self.has_range]
        self.wrench = plant.wrench(self.reference)


class Qp(ModelBased):
    """Linearized once per layout, solved per target by SciPy's active-set
    `lsq_linear(method="bvls")`.

    Minimizes `||(w_ref + J du - target) / asked_scale||^2 + ||du||^2` over commands as positions
    between their limits, where `w_ref` and `J` belong to the middle of the limits. What commands
    cost plays no part. (What the paper's QP regularizes it does not say.)
    """

    name = "qp"

    @cached_property
    def _map(self) -> LinearMap:
        """The linear map of this robot, made when it is first asked."""
        return LinearMap(self.plant, self.asked_scale)

    def _commands(self, targets: Array, seed: int) -> Array:
        """Solves one box problem for each target."""
        linear = self._map
        plant = self.plant
        n_ranged = int(linear.has_range.sum())
        step = np.zeros((len(targets), linear.has_range.size))
        if n_ranged:
            half = np.full(n_ranged, 0.5)
            for i, wanted in enumerate((targets - linear.wrench) / self.asked_scale):
                step[i, linear.has_range] = box_qp(linear.matrix, wanted, 1.0, -half, half)
        return linear.reference + step.reshape(-1, plant.n_fins, 3) * plant.width


@dataclass(frozen=True)
class PaperSqpSettings(TimeLimitedSettings):
    """Settings of method `paper_sqp`; the paper prints none of them."""

    n_starts: int = number(
        8, 1, 10_000, "starts per target: the middle of the limits, then random ones"
    )
    n_steps: int = number(60, 1, 10_000, "most quadratic programs per start")
    regularization: float = number(
        1e-4, 0.0, 1e6, "weight of the squared step, as a share of the ranges"
    )


class PaperSqp(ModelBased):
    """The paper's sequential quadratic programming: linearize at the iterate, box QP, line search.

    At the iterate u with the normalized residual r = (target - w(u)) / asked_scale and the Jacobian
    J of w / asked_scale, the step d keeps `||J d - r||^2 + regularization ||d||^2` least with u + d
    inside the limits; it is halved until J_norm = `||r||^2` falls by enough. Jacobians are those of
    the fins' own laws, in closed form. What commands cost plays no part. The next start is tried
    where one ends off the target; the answer is the end with the least error.
    """

    name = "paper_sqp"
    settings_class = PaperSqpSettings
    settings: PaperSqpSettings

    def _commands(self, targets: Array, seed: int) -> Array:
        """Descends from one start after the other, until one ends on the target."""
        plant = self.plant
        random = plant.sample(np.random.default_rng(seed), (self.settings.n_starts - 1,))
        starts = [0.5 * (plant.lower + plant.upper), *random]
        answers = np.empty((len(targets), plant.n, 3))
        for i, target in enumerate(targets):
            over = thread_time() + self.settings.time_limit_s
            least = np.inf
            for start in starts:
                command, errors = self.descent(target, start)
                if errors[-1] < least:
                    answers[i] = command
                    least = errors[-1]
                if least <= SOLVED**2 or thread_time() > over:
                    break
        return answers

    def descent(self, target: Array, start: Array) -> tuple[Array, list[float]]:
        """Descends from one start.

        Args:
            target: desired wrench (6,) [N, N m].
            start: command (n, 3).

        Returns:
            The command (n, 3) where the descent ends, and J_norm of every iterate, the start's
            first.
        """
        plant = self.plant
        width = self.plant.width
        has_range = width.ravel() > 0.0

        def residual(command: Array) -> Array:
            return (target - plant.wrench(command)) / self.asked_scale

        command = start
        r = residual(start)
        errors = [float(r @ r)]
        for _ in range(self.settings.n_steps if has_range.any() else 0):
            jacobian = (plant.linearize(command)[1] / self.asked_scale[:, None] * width.ravel())[
                :, has_range
            ]
            share = (command - plant.lower).ravel()[has_range] / width.ravel()[has_range]
            share = share.clip(0.0, 1.0)
            step = np.zeros(has_range.size)
            step[has_range] = box_qp(jacobian, r, self.settings.regularization, -share, 1.0 - share)
            slope = -2.0 * float(r @ (jacobian @ step[has_range]))
            length = 1.0
            for _ in range(HALVINGS):
                tried = np.clip(
                    command + length * step.reshape(-1, 3) * width, plant.lower, plant.upper
                )
                r_tried = residual(tried)
                if r_tried @ r_tried <= errors[-1] + SUFFICIENT * length * min(slope, 0.0):
                    break
                length *= 0.5
            else:
                break
            command = tried
            r = r_tried
            errors.append(float(r @ r))
            if errors[-1] <= (0.1 * SOLVED) ** 2 or length * np.abs(step).max() < SHORTEST:
                break
        return command, errors


def box_qp(matrix: Array, wanted: Array, weight: float, low: Array, high: Array) -> Array:
    """Minimizes `||matrix x - wanted||^2 + weight ||x||^2` in a box, by SciPy's active-set method.

    Args:
        matrix: (6, k).
        wanted: (6,).
        weight: of the squared solution, at least 0.
        low: lower limits (k,), each below its `high`.
        high: upper limits (k,).

    Returns:
        The solution x (k,).
    """
    k = len(low)
    matrix_and_weight = np.vstack([matrix, np.sqrt(weight) * np.eye(k)])
    right = np.concatenate([wanted, np.zeros(k)])
    return np.asarray(lsq_linear(matrix_and_weight, right, (low, high), method="bvls").x)
