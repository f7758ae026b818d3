"""Random robots to learn from: 2 to 12 random fins, some of them symmetric, and wrenches they can deliver.

No robot here is one that is evaluated: those are drawn by other generators, from other seeds.
"""

import math

import numpy as np

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.layout.random_layouts import TRAINING_BOX, Numbers, random_fin_model, random_layout
from finlab.mdn.answers import EffortRobot

FIN_COUNTS = dict(zip(range(2, 13), (1, 2, 8, 9, 9, 8, 8, 7, 7, 7, 7), strict=True))
"""Number of fins -> how often it is drawn; with 2 or 3 there is next to nothing to choose."""
BOX = (1.5 * TRAINING_BOX[0], 1.5 * TRAINING_BOX[1], 2.0 * TRAINING_BOX[2])
"""Largest |x|, |y|, |z| of a fin [m]: as far as split `ood` goes."""
NUMBERS: dict[str, Numbers] = {
    "drag": {"area": (0.003, 0.06), "lever": (0.04, 0.2)},
    "lighthill": {"length": (0.08, 0.4), "width": (0.04, 0.2)},
    "soft": {
        "e": (0.0, 0.3),
        "k": (0.5, 12.0),
        "p": (0.7, 2.5),
        "x0": (0.4, 2.0),
        "q": (2.0, 8.0),
        "phi_e": (-math.pi, math.pi),
        "d": (-0.3, 0.3),
    },
}
"""Families of fins: wider than any fin that is evaluated."""

Kind = tuple[FinModelSpec, Limits]
"""A fin, wherever it is mounted."""


def random_kinds(rng: np.random.Generator, count: int) -> tuple[list[Kind], list[Kind]]:
    """`count` fins with nominal limits, and as many with limits drawn as in split `limits`; half of the soft
    ones push alike in all directions. Few, since compiling one takes as long as many answers."""
    models = [random_fin_model(rng, None, NUMBERS) for _ in range(2 * count)]
    for k, model in enumerate(models):
        if model.type == "soft" and rng.random() < 0.5:
            models[k] = FinModelSpec("soft", tuple({**dict(model.parameters), "e": 0.0}.items()))
    varied = [random_layout(rng, n_fins=1, limits="varied").fins[0].limits for _ in range(count)]
    nominal = [(model, Limits()) for model in models[:count]]
    return nominal, list(zip(models[count:], varied, strict=True))


def random_robot(rng: np.random.Generator, kinds: tuple[list[Kind], list[Kind]], n: int) -> Layout:
    """Draw a robot of n fins.

    Fins are of one kind or each of its own, half of the robots have limits of their own, and a third are
    symmetric, where fins are equals and only chance can tell them apart.
    """
    symmetric = rng.random() < 1 / 3
    position, angle = _symmetric_places(rng, n) if symmetric else _places(rng, n)
    source = kinds[not symmetric and rng.random() < 0.5]
    one_kind = symmetric or rng.random() < 0.5
    chosen = np.full(n, rng.integers(len(source))) if one_kind else rng.integers(len(source), size=n)
    fins = []
    for i, (place, turn, (model, limits)) in enumerate(
        zip(position, angle, (source[k] for k in chosen), strict=True)
    ):
        fins.append(Fin(f"fin_{i + 1}", tuple(place.tolist()), float(turn), limits, model=model))
    return Layout("random", tuple(fins))


def _places(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Positions (n, 3) [m] and angles (n,) [rad] of a robot without symmetry, some of them flat."""
    box = np.array(TRAINING_BOX if rng.random() < 0.6 else BOX)
    if rng.random() < 0.3:
        box[2] = 0.0
    return rng.uniform(-1.0, 1.0, (n, 3)) * box, rng.uniform(-math.pi, math.pi, n)


def _symmetric_places(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """The same with mirrored pairs, stacked pairs, or fins evenly around the hull."""
    kind = rng.integers(3)
    if kind == 0:  # evenly around
        azimuth = 2.0 * math.pi * np.arange(n) / n + rng.uniform(0.0, 2.0 * math.pi)
        radius = rng.uniform(0.08, 0.35)
        position = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), np.zeros(n)], axis=-1)
        return position, np.asarray(wrapped(azimuth + rng.choice([0.0, rng.uniform(-math.pi, math.pi)])))
    half = n // 2
    one, turn = _places(rng, n - half)
    if kind == 1:  # port and starboard: the mirror image of a shaft's azimuth is its negative
        other, turned = one[:half] * np.array([1.0, -1.0, 1.0]), -turn[:half]
    else:  # one above the other
        one[:half, 2] = rng.uniform(0.0, 0.1)
        other, turned = one[:half] * np.array([1.0, 1.0, -1.0]), turn[:half]
    order = rng.permutation(n)
    return np.concatenate([one, other])[order], np.asarray(wrapped(np.concatenate([turn, turned])))[order]


def random_targets(rng: np.random.Generator, robot: EffortRobot, count: int) -> Array:
    """Normalized targets (count, 6): half are wrenches of uniform commands, a quarter of commands where some
    fins rest, a quarter one to three axes together, as far as no fin gives more than its largest force."""
    plant, quarter = robot.plant, count // 4
    command = plant.sample(rng, (count - quarter,))
    rests = rng.random((quarter, plant.n_fins)) > rng.uniform(0.3, 1.0, (quarter, 1))
    command[:quarter, :, :2] = np.where(rests[..., None], plant.lower[:, :2], command[:quarter, :, :2])
    full = robot.forces.effectiveness * np.repeat(robot.view.largest, 2)[:, None]
    axes = rng.random((quarter, 6)).argsort(axis=1) < rng.integers(1, 4, (quarter, 1))
    wanted = axes * rng.choice([-1.0, 1.0], (quarter, 6)) * rng.uniform(0.2, 1.0, (quarter, 6))
    share = wanted @ np.linalg.pinv(full.T @ full, rcond=1e-6) @ full.T
    largest = np.hypot(share[:, 0::2], share[:, 1::2]).max(1, keepdims=True)
    share *= rng.uniform(0.03, 0.9, (quarter, 1)) / np.maximum(largest, 1e-9)
    return np.concatenate([robot.commands.wrench(command), share @ full])
