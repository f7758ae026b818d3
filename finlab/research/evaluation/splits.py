"""Held-out test cases: seeded layouts and reachable targets, one definition per split name.

The experiments and many tests take their robots from here; no training sees these seeds.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.errors import DataError
from finlab.layout import Fin, FinModelSpec, Layout
from finlab.physics import Plant, TableLaw, make_law, write_table
from finlab.research.random_layouts import (
    TRAINING_BOX,
    ActuatorMaker,
    random_azimuth,
    random_fin_model,
    random_layout,
    random_robot,
    random_shaft_fin,
    random_thruster,
    random_tilt,
)

OOD_BOX = (0.45, 0.45, 0.20)
"""Largest |x|, |y|, |z| of a fin in split `ood` [m]; at least one fin lies outside the training
box."""
OOD_FINS = (6, 8)
"""Least and most fins in split `ood-fins`."""
MANY_FINS = (9, 12)
"""Least and most fins in split `many-fins`."""
NEAR_ANGLE = math.radians(2.0)
"""Nearly parallel shafts of split `near-singular` differ by at most this; opposite counts as
parallel."""
NEAR_POSITION = 0.005
"""Nearly coincident fins of split `near-singular` lie within this of each other along each axis
[m]."""
TEST_SEED_DOMAIN = 0x7E57
"""First number of the seed of every test case; training seeds begin otherwise."""
SPLITS_WITH_OWN_SIGMA = (
    "fins",
    "fins-mixed",
    "tables",
    "thrusters",
    "azimuths",
    "mixed-actuators",
    "any-shaft",
)
"""Splits in which errors are divided by the robot's own wrenches, since these are much smaller or
larger than those of the training data."""
N_SIGMA_COMMANDS = 4096
"""Uniform commands whose wrenches give such a robot's sigma."""
MIN_SIGMA_SHARE = 0.05
"""Smallest sigma of an axis, as a share of the largest one among the forces, or among the torques
[1]."""

TABLE_SHAPE = (8, 9, 12)
"""Amplitudes, frequencies and zero directions of a table; the first two range over the fin's
limits, the last over the circle."""
TABLE_NOISE = 0.03
"""Standard deviation of each component of a force, as a share of it."""


class SplitCase(NamedTuple):
    """One layout with targets that its healthy fins can deliver, and what errors on it are divided
    by."""

    layout: Layout
    """All actuators, lost ones included."""
    targets: Array
    """Desired wrenches (N, 6) [N, N m], each given by a command of the healthy actuators."""
    lost: tuple[str, ...]
    """Names of the actuators that do not work."""
    sigma: Array | None = None
    """What errors are divided by (6,) [N, N m]: standard deviation of the robot's own wrenches;
    None where it is that of the training data."""

    @property
    def healthy(self) -> Layout:
        """The layout without the actuators that are lost."""
        return self.layout.without(self.lost)


def make_split(name: str, n_layouts: int, n_targets: int, seed: int) -> list[SplitCase]:
    """Returns the test cases of a split.

    Layout k and its first targets depend on the split, the seed and k alone, so that a small run is
    the beginning of a large one.

    Args:
        name: the split, a key of `SPLITS`.
        n_layouts: number of layouts.
        n_targets: number of targets for each of them.
        seed: of layouts and targets.

    Raises:
        DataError: unknown split, fewer than one layout or target, or a negative seed.
    """
    if name not in SPLITS:
        raise DataError(f"split: expected one of {', '.join(SPLITS)}, got {name!r}")
    _check_at_least(1, "layouts", n_layouts)
    _check_at_least(1, "targets", n_targets)
    _check_at_least(0, "seed", seed)
    return [make_case(name, n_targets, seed, k) for k in range(n_layouts)]


def _check_at_least(minimum: int, argument: str, value: int) -> None:
    """Refuses smaller numbers. Raises DataError."""
    if value < minimum:
        raise DataError(f"{argument}: expected a number of at least {minimum}, got {value}")


def make_case(split: str, n_targets: int, seed: int, k: int) -> SplitCase:
    """Returns one test case of a split.

    Args:
        split: the split, a key of `SPLITS`.
        n_targets: number of targets.
        seed: of layouts and targets.
        k: number of the layout in the split.
    """
    number, draw = SPLITS[split]
    entropy = (TEST_SEED_DOMAIN, number, seed, k)
    layout_seed, target_seed, sigma_seed = np.random.SeedSequence(entropy).spawn(3)
    layout, lost = draw(np.random.default_rng(layout_seed), f"{split}-{seed}-{k}")
    plant = Plant(layout.without(lost))
    targets = plant.wrench(plant.sample(np.random.default_rng(target_seed), (n_targets,)))
    sigma = None
    if split in SPLITS_WITH_OWN_SIGMA:
        sigma = own_sigma(plant, np.random.default_rng(sigma_seed))
    return SplitCase(layout, targets, lost, sigma)


def own_sigma(plant: Plant, rng: np.random.Generator) -> Array:
    """Returns what errors on a robot are divided by: the standard deviation of its wrenches under
    uniform commands, with a floor.

    Args:
        plant: of the robot.
        rng: draws the commands.

    Returns:
        Standard deviation (6,) [N, N m].
    """
    deviation = plant.wrench(plant.sample(rng, (N_SIGMA_COMMANDS,))).std(axis=0).reshape(2, 3)
    least = MIN_SIGMA_SHARE * deviation.max(axis=1, keepdims=True)
    return np.asarray(np.maximum(deviation, least).reshape(6))


LayoutAndLost = tuple[Layout, tuple[str, ...]]
"""A random layout, and the names of its lost actuators."""
LayoutDraw = Callable[[np.random.Generator, str], LayoutAndLost]
"""Draws a layout with a generator, and gives it a name."""


def _undamaged(**options: Any) -> LayoutDraw:
    """Layouts of which no fin is lost; options of `random_layout`."""
    return lambda rng, name: (random_layout(rng, name, **options), ())


def _failure(rng: np.random.Generator, name: str) -> LayoutAndLost:
    """One or two fins lost, never all."""
    layout = random_layout(rng, name)
    n_lost = min(int(rng.integers(1, 3)), layout.n_fins - 1)
    lost = sorted(rng.choice(layout.n_fins, size=n_lost, replace=False))
    return layout, tuple(layout.names[i] for i in lost)


def _near_singular(rng: np.random.Generator, name: str) -> LayoutAndLost:
    """Half of the layouts have nearly parallel shafts, half have a nearly coincident pair of
    fins."""
    layout = random_layout(rng, name)
    (first, *others) = layout.fins
    angle = layout.mounting_angle[0]
    if rng.uniform() < 0.5:
        turns = rng.uniform(-NEAR_ANGLE, NEAR_ANGLE, len(others)) / 2
        turns += math.pi * rng.integers(0, 2, len(others))
        fins = [
            replace(fin, mounting_angle=float(wrapped(angle + turn)))
            for fin, turn in zip(others, turns, strict=True)
        ]
    else:
        displacement = rng.uniform(-NEAR_POSITION, NEAR_POSITION, 3)
        x, y, z = (np.array(first.position) + displacement).tolist()
        near_angle = float(wrapped(angle + rng.uniform(-NEAR_ANGLE, NEAR_ANGLE)))
        fins = [replace(others[0], position=(x, y, z), mounting_angle=near_angle), *others[1:]]
    return replace(layout, actuators=(first, *fins)), ()


def _fins(rng: np.random.Generator, name: str, mixed: bool = False) -> LayoutAndLost:
    """All fins of one random model, or each of a random model of its own."""
    layout = random_layout(rng, name)
    model = random_fin_model(rng)
    fins = [replace(layout.fins[0], model=model)]
    for fin in layout.fins[1:]:
        if mixed:
            model = random_fin_model(rng)
        fins.append(replace(fin, model=model))
    return replace(layout, actuators=tuple(fins)), ()


def _tables(rng: np.random.Generator, name: str) -> LayoutAndLost:
    """As `_fins`, each fin of a random model that is known by a noisy table alone."""
    layout, _ = _fins(rng, name, mixed=True)
    fins = []
    for fin, fin_rng in zip(layout.fins, rng.spawn(layout.n_fins), strict=True):
        fins.append(_noisy_table(fin_rng, fin, f"{name}-{fin.name}"))
    return replace(layout, actuators=tuple(fins)), ()


def _noisy_table(rng: np.random.Generator, fin: Fin, name: str) -> Fin:
    """A fin with a table of its model in place of the model; the file of that name is written
    once."""
    path = Path(_table_folder().name) / f"{name}.csv"
    if not path.exists():
        n_amplitudes, n_frequencies, n_directions = TABLE_SHAPE
        axes = [
            np.linspace(*fin.limits.amplitude, n_amplitudes),
            np.linspace(*fin.limits.frequency, n_frequencies),
            np.linspace(-np.pi, np.pi, n_directions, endpoint=False),
        ]
        force = make_law(fin.model).force(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
        noisy = np.asarray(force * (1.0 + TABLE_NOISE * rng.standard_normal(force.shape)))
        write_table(path, TableLaw(axes, noisy, periodic=True), *axes)
    return replace(fin, model=FinModelSpec("table", (("path", str(path)),)))


@cache
def _table_folder() -> "TemporaryDirectory[str]":
    """The folder of this process's tables, which is removed when it ends."""
    return TemporaryDirectory(prefix="finlab-tables-")


def _robots(*kinds: ActuatorMaker, count: tuple[int, int], each: bool = False) -> LayoutDraw:
    """Robots of random actuators of some kinds; options of `random_robot`."""
    return lambda rng, name: (random_robot(rng, name, count, kinds, each), ())


SPLITS: dict[str, tuple[int, LayoutDraw]] = {
    "id": (0, _undamaged()),
    "ood": (1, _undamaged(box=OOD_BOX, outside=TRAINING_BOX)),
    "ood-fins": (2, _undamaged(n_fins=OOD_FINS)),
    "limits": (3, _undamaged(limits="varied")),
    "failure": (4, _failure),
    "near-singular": (5, _near_singular),
    "fins": (6, _fins),
    "fins-mixed": (7, partial(_fins, mixed=True)),
    "tables": (8, _tables),
    "many-fins": (9, _undamaged(n_fins=MANY_FINS)),
    "thrusters": (18, _robots(random_thruster, count=(4, 10))),
    "azimuths": (19, _robots(random_azimuth, count=(2, 6))),
    "mixed-actuators": (
        20,
        _robots(
            random_shaft_fin, random_thruster, random_azimuth, random_tilt, count=(4, 10), each=True
        ),
    ),
    "any-shaft": (21, _robots(random_shaft_fin, count=(2, 8))),
}
"""Name -> a number that is part of the seed and of no other split, and the draw of its layouts."""
