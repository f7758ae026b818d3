"""Answers where actuators act on each other: outer iterations on the dual of the model made linear
at the last forces.

With y the forces and o(y) the wrench offset that they cause (Eq. 18), an iteration takes o(y) for
its value and slope at the last forces. Its answer is exact and cheapest on that linear model;
Levenberg-Marquardt steps make it exact on the whole one, and shorter steps are taken where it is
no cheaper. Where the iterations converge, the gradient of the power lies in the range of the slope
of the whole model: the conditions of Karush, Kuhn and Tucker hold there (sequential convex
programming). The iterations are in finlab/core/src/outer_iterations.c, and their search for the
best of several starts in outer_starts.c, since the whole model is not convex. Robots of thrusters
are mostly answered without them, by Newton's method in outer_newton.c. Here is what the starts are,
and what the actuators' own laws have to say of the answers.
"""

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.levenberg_marquardt import CommandProblem, exact_commands, refine
from finlab.allocation.policy import Policy
from finlab.arrays import CLOSE, NEARLY, ROUNDS, Array
from finlab.core.calls import CoreAnswer
from finlab.core.coupled_core import CoupledCore, WrenchOffset
from finlab.physics.plant import Plant

JET_ROTATION = 0.38
"""Angle [rad] by which jets are rotated where an answer begins anew: the half width of a jet."""
RANDOM_STARTS = 3
"""Starts whose forces are rotated, and changed in size, at random."""

_PAIR = np.array([[1.0, 1.0], [1.0, -1.0]])
"""Signs of two: the same, and opposite."""
WALSH = np.kron(_PAIR, np.kron(_PAIR, _PAIR))
"""Signs (8, 8) of the patterns of Walsh, one pattern in each column."""


def coupled_core(plant: Plant, compiled: Compiled) -> CoupledCore:
    """Returns a robot in the core, with what its actuators do to each other.

    Args:
        plant: of a layout with an interaction, in its flow.
        compiled: the same robot by its laws alone.

    Returns:
        What runs outer iterations for it.
    """
    return CoupledCore(compiled.block, wrench_offset_of(plant, compiled))


def wrench_offset_of(plant: Plant, compiled: Compiled) -> WrenchOffset:
    """Returns what the actuators of a robot do to each other, as the core asks for it; the
    arguments are those of `coupled_core`."""
    interaction = plant.interaction
    assert interaction is not None
    return WrenchOffset(
        frames=compiled.axes @ plant.layout.frames,
        counts=plant.counts,
        inflow=plant.met_by_all(None),
        core_function=interaction.CORE_FUNCTION,
        core_constants=interaction.core_constants,
        effect=interaction.effect,
        offset=interaction.offset,
        starts=start_factors(compiled.is_line),
    )


def finished_answer(
    problem: CommandProblem, targets: Array, policy: Policy, answer: CoreAnswer
) -> CoreAnswer:
    """Makes answers of outer iterations exact by the laws.

    Args:
        problem: of steps on the commands, under the conditions.
        targets: desired wrenches (N, 6) [N, N m].
        policy: what to give out of reach.
        answer: of a `CoupledCore`; its arrays are overwritten.

    Returns:
        The same answers with commands that are exact by the laws. A target is attainable where its
        command gives it; nothing is proved of gaps.
    """
    command = exact_commands(problem, answer)
    if policy.kind == "direction":
        # The core has gone along the ray by its grids: it has to be done again where these are off.
        served = answer.wrench_served / problem.error_scale
        is_off = problem.error(command, served) > NEARLY
        for row in np.flatnonzero(~answer.is_attainable & is_off):
            one = slice(row, row + 1)
            on_ray = _on_the_ray(problem, targets[one], command[one])
            command[one], answer.wrench_served[one] = on_ray
    error = problem.error(command, targets / problem.error_scale)
    return answer._replace(command=command, is_attainable=error <= NEARLY)


def _on_the_ray(problem: CommandProblem, target: Array, command: Array) -> tuple[Array, Array]:
    """Finds the largest share of a target that steps on the commands come to (Eq. 14), by
    bisection.

    Args:
        problem: of steps on the commands, under the conditions of the question.
        target: desired wrench (1, 6) [N, N m].
        command: (1, n, 3) where the steps begin.

    Returns:
        The command (1, n, 3), and the wrench (1, 6) [N, N m] on the ray that it gives.
    """
    target_normalized = target / problem.error_scale
    along = float((problem.wrench(command) * target_normalized).sum())
    ray_share = along / max((target_normalized * target_normalized).sum(), 1e-300)
    low = 0.0
    high = min(max(ray_share * (1.0 + CLOSE), 0.0), 1.0)
    best = command
    for k in range(ROUNDS):
        tried = high if k == 0 else 0.5 * (low + high)
        refined = refine(problem, tried * target_normalized, best, ROUNDS, 0.1 * NEARLY)
        if refined.error[0] <= NEARLY:
            low = tried
            best = refined.command
        else:
            high = tried
        if high - low <= CLOSE * high:
            break
    if problem.box is not None:
        best = problem.box.clip_feasible(best, problem.plant)
    return best, low * target


def start_factors(is_line: NDArray[np.bool_]) -> Array:
    """Returns where iterations begin anew, beside the forces by the laws alone.

    Forces of planes are rotated: a jet that meets a neighbour in a symmetric robot has no slope
    that would turn it aside, and which of two jets gives way is a choice between minima. Forces of
    lines cannot rotate, and are changed in size at random.

    Args:
        is_line: which actuators (n,) push along a line.

    Returns:
        Factors (K, n, 2) by which forces are multiplied as complex numbers, real and imaginary
        part: first rotations one way or the other in the patterns of Walsh; then all the other way
        than in the first pattern, which is one sign; then `RANDOM_STARTS` by random angles, and
        changed in size.
    """
    planes = np.flatnonzero(~is_line)
    n = len(is_line)
    rng = np.random.default_rng(0)
    walsh_signs = WALSH[np.arange(len(planes)) % len(WALSH)].T
    random_turns = rng.normal(size=(len(planes), RANDOM_STARTS)).T
    turns = np.concatenate([walsh_signs, -walsh_signs[:1], random_turns])

    angle = np.zeros((len(turns), n))
    angle[:, planes] = JET_ROTATION * turns
    size = np.ones(angle.shape)
    size[-RANDOM_STARTS:] = rng.uniform(0.0, 2.0, (RANDOM_STARTS, n))
    size[:, is_line] = rng.uniform(0.0, 2.0, (len(size), is_line.sum()))
    return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
