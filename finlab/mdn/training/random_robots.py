"""Random robots to learn from: 2 to 12 random fins, some of them symmetric, and wrenches they can deliver."""

import math
from dataclasses import dataclass

import numpy as np

from finlab.arrays import Array
from finlab.layout import Fin, Layout, Limits
from finlab.layout.angles import wrapped
from finlab.layout.arrays import force_effectiveness
from finlab.layout.random import TRAINING_BOX
from finlab.mdn.descent import EffortProblem, wrench
from finlab.mdn.effort_fins import EffortFins
from finlab.mdn.robot import layout_problem
from finlab.mdn.training.random_fins import RandomFin, random_fin, varied_limits
from finlab.physics.effort import DEFAULT_WEIGHTS

FIN_COUNTS = dict(zip(range(2, 13), (1, 2, 8, 9, 9, 8, 8, 7, 7, 7, 7), strict=True))
"""Number of fins -> how often it is drawn; with 2 or 3 there is next to nothing to choose."""
BOX = (1.5 * TRAINING_BOX[0], 1.5 * TRAINING_BOX[1], 2.0 * TRAINING_BOX[2])
"""Largest |x|, |y|, |z| of a fin [m]: as far as split `ood` goes."""


@dataclass(frozen=True, eq=False)
class RandomRobot:
    """One robot, ready for the descent."""

    layout: Layout
    """Positions, angles and limits; the fins' models are not part of it."""
    fins: tuple[RandomFin, ...]
    """What its fins do."""
    problem: EffortProblem
    """For the descent in planar forces."""
    scale: Array
    """What wrenches are divided by (6,)."""


class FinPool:
    """Some random fins, since compiling one takes as long as a hundred answers."""

    def __init__(self, rng: np.random.Generator, count: int) -> None:
        """Draw `count` fins with nominal limits and as many with limits of their own."""
        self.nominal = [random_fin(rng, Limits()) for _ in range(count)]
        self.varied = [random_fin(rng, varied_limits(rng)) for _ in range(count)]


def random_robot(rng: np.random.Generator, pool: FinPool, n: int, scale: Array) -> RandomRobot:
    """Draw a robot of n fins; `scale` (6,) is what its wrenches are divided by.

    Fins are of one kind or each of its own, half of the robots have limits of their own, and a third are
    symmetric, where fins are equals and only chance can tell them apart.
    """
    symmetric = rng.random() < 1 / 3
    position, angle = _symmetric_places(rng, n) if symmetric else _places(rng, n)
    source = pool.varied if not symmetric and rng.random() < 0.5 else pool.nominal
    one_kind = symmetric or rng.random() < 0.5
    chosen = np.full(n, rng.integers(len(source))) if one_kind else rng.integers(len(source), size=n)
    fins = tuple(source[k] for k in chosen)
    layout = Layout(
        "random",
        tuple(
            Fin(f"fin_{i + 1}", tuple(place.tolist()), float(turn), fin.limits)
            for i, (place, turn, fin) in enumerate(zip(position, angle, fins, strict=True))
        ),
    )
    compiled = EffortFins.of([fin.compiled for fin in fins])
    effectiveness = force_effectiveness(layout.position, layout.mounting_angle)[:, 1:] / scale
    problem = layout_problem(effectiveness, compiled, layout, DEFAULT_WEIGHTS)
    return RandomRobot(layout, fins, problem, scale)


def _places(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Positions (n, 3) [m] and angles (n,) [rad] of a robot without symmetry, a few of them with a pair of
    fins at one place."""
    box = np.array(TRAINING_BOX if rng.random() < 0.6 else BOX)
    position, angle = rng.uniform(-1.0, 1.0, (n, 3)) * box, rng.uniform(-math.pi, math.pi, n)
    if n > 1 and rng.random() < 0.1:
        position[1] = position[0] + rng.uniform(-0.01, 0.01, 3)
        angle[1] = angle[0] + math.pi * rng.integers(0, 2) + rng.uniform(-0.03, 0.03)
    if rng.random() < 0.3:  # flat robots, as most are
        position[:, 2] = 0.0
    return position, np.asarray(wrapped(angle))


def _symmetric_places(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """The same with mirrored pairs, stacked pairs, or fins evenly around the hull."""
    kind = rng.integers(3)
    if kind == 0:  # evenly around
        azimuth = 2.0 * math.pi * np.arange(n) / n + rng.uniform(0.0, 2.0 * math.pi)
        radius = rng.uniform(0.08, 0.35)
        position = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), np.zeros(n)], axis=-1)
        return position, np.asarray(wrapped(azimuth + rng.choice([0.0, rng.uniform(-math.pi, math.pi)])))
    half, left_over = n // 2, n % 2
    one, turn = _places(rng, half + left_over)
    if kind == 1:  # port and starboard: the mirror image of a shaft's azimuth is its negative
        other, turned = one[:half] * np.array([1.0, -1.0, 1.0]), -turn[:half]
    else:  # one above the other
        one[:half, 2] = rng.uniform(0.0, 0.1)
        other, turned = one[:half] * np.array([1.0, 1.0, -1.0]), turn[:half]
    order = rng.permutation(n)
    return np.concatenate([one, other])[order], np.asarray(wrapped(np.concatenate([turn, turned])))[order]


def random_targets(rng: np.random.Generator, robot: RandomRobot, count: int) -> Array:
    """Normalized targets (count, 6): wrenches of uniform commands, of random forces, and pure axes with
        mixes.

    Those of the last kind may be out of reach of fins with stops, and of uneven ones.
    """
    n, problem = robot.layout.n_fins, robot.problem
    third = count // 4
    lower, upper = robot.layout.lower, robot.layout.upper
    command = lower + rng.random((count - 2 * third, n, 3)) * (upper - lower)
    effectiveness = force_effectiveness(robot.layout.position, robot.layout.mounting_angle)
    force = np.stack([fin.law.force(command[:, i]) for i, fin in enumerate(robot.fins)], axis=1)
    by_command = np.einsum("kna,naw->kw", force, effectiveness) / robot.scale
    fins = problem.fins
    direction = fins.middle + rng.uniform(-1.0, 1.0, (third, n)) * fins.half
    share = rng.random((third, n)) ** 2 * (rng.random((third, n)) < rng.uniform(0.3, 1.0, (third, 1)))
    boundary = fins.boundary(direction)
    size = boundary.smallest + share * (boundary.largest - boundary.smallest)
    by_force = wrench(problem, size * np.exp(1j * direction))
    return np.concatenate([by_command, by_force, _axes(rng, robot, third)])


def _axes(rng: np.random.Generator, robot: RandomRobot, count: int) -> Array:
    """One to three axes together, as far as the fins go without leaving what each can give."""
    problem = robot.problem
    full = problem.effectiveness * np.repeat(problem.fins.maximum, 2)[:, None]
    signs = rng.choice([-1.0, 1.0], (count, 6)) * rng.uniform(0.2, 1.0, (count, 6))
    axes = rng.random((count, 6)).argsort(axis=1) < rng.integers(1, 4, (count, 1))
    gram = full.T @ full
    share = (axes * signs) @ np.linalg.pinv(gram, rcond=1e-6) @ full.T
    largest = np.hypot(share[:, 0::2], share[:, 1::2]).max(1, keepdims=True)
    share *= rng.uniform(0.03, 0.9, (count, 1)) / np.maximum(largest, 1e-9)
    return np.asarray(share @ full)
