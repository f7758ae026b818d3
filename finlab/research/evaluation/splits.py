"""Held-out test cases: seeded layouts and reachable targets, one definition per split name."""

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
DOMAIN = 0x7E57
"""Leads the seed of every test case; training seeds begin otherwise."""
OWN_SIGMA = (
    *("fins", "fins-mixed", "tables"),
    *("thrusters", "azimuths", "mixed-actuators", "any-shaft"),
)
"""Splits whose robots are each measured by their own wrenches, which are smaller or larger than
those of training: errors there are relative to what the robot can do."""
N_SIGMA = 4096
"""Uniform commands from which such a robot's wrench scale is computed."""
LEAST_SIGMA = 0.05
"""Least deviation on an axis, as a share of the largest one among the forces, or among the
torques."""

GRID = (8, 9, 12)
"""Amplitudes, frequencies and zero directions of a table; the first two range over the fin's
limits, the last over the circle."""
NOISE = 0.03
"""Standard deviation of each component of a force, as a share of it."""


class SplitCase(NamedTuple):
    """One layout with targets that its healthy fins can deliver, and what errors on it are divided
    by."""

    layout: Layout
    """All fins, lost ones included."""
    targets: Array
    """Desired wrenches (N, 6) [N, N m], each caused by a command of the healthy fins."""
    lost: tuple[str, ...]
    """Names of the fins that do not work."""
    sigma: Array | None = None
    """The robot's own wrench scale (6,); None where it is that of the training wrenches."""

    @property
    def healthy(self) -> Layout:
        """The layout without the fins that are lost."""
        return self.layout.without(self.lost)


def make_split(name: str, n_layouts: int, n_targets: int, seed: int) -> list[SplitCase]:
    """The test cases of a split, one of `SPLITS`: layouts, and targets for each of them.

    Layout k and its first targets depend on the split, the seed and k alone, so that a small run is
    the beginning of a large one. Raises DataError: unknown split, fewer than one, or a negative
    seed."""
    if name not in SPLITS:
        raise DataError(f"split: expected one of {', '.join(SPLITS)}, got {name!r}")
    for value, what, least in (
        (n_layouts, "layouts", 1),
        (n_targets, "targets", 1),
        (seed, "seed", 0),
    ):
        if value < least:
            raise DataError(f"{what}: expected a number of at least {least}, got {value}")
    return [make_case(name, n_targets, seed, k) for k in range(n_layouts)]


def make_case(split: str, n_targets: int, seed: int, k: int) -> SplitCase:
    """Case k of `make_split`."""
    entropy = (DOMAIN, SPLITS[split][0], seed, k)
    layout_seed, target_seed, sigma_seed = np.random.SeedSequence(entropy).spawn(3)
    layout, lost = SPLITS[split][1](np.random.default_rng(layout_seed), f"{split}-{seed}-{k}")
    plant = Plant(layout.without(lost))
    targets = plant.wrench(plant.sample(np.random.default_rng(target_seed), (n_targets,)))
    own = own_sigma(plant, np.random.default_rng(sigma_seed)) if split in OWN_SIGMA else None
    return SplitCase(layout, targets, lost, own)


def own_sigma(plant: Plant, rng: np.random.Generator) -> Array:
    """A robot's own wrench scale (6,): what its wrenches deviate by under uniform
    commands."""
    deviation = plant.wrench(plant.sample(rng, (N_SIGMA,))).std(axis=0).reshape(2, 3)
    least = LEAST_SIGMA * deviation.max(axis=1, keepdims=True)
    return np.asarray(np.maximum(deviation, least).reshape(6))


Draw = Callable[[np.random.Generator, str], tuple[Layout, tuple[str, ...]]]
"""From a generator and a name: a layout and its lost fins."""


def _whole(**options: Any) -> Draw:
    """Layouts of which no fin is lost; options of `random_layout`."""
    return lambda rng, name: (random_layout(rng, name, **options), ())


def _failure(rng: np.random.Generator, name: str) -> tuple[Layout, tuple[str, ...]]:
    """One or two fins lost, never all."""
    layout = random_layout(rng, name)
    n_lost = min(int(rng.integers(1, 3)), layout.n_fins - 1)
    lost = sorted(rng.choice(layout.n_fins, size=n_lost, replace=False))
    return layout, tuple(layout.names[i] for i in lost)


def _near_singular(rng: np.random.Generator, name: str) -> tuple[Layout, tuple[str, ...]]:
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
        x, y, z = (
            np.array(first.position) + rng.uniform(-NEAR_POSITION, NEAR_POSITION, 3)
        ).tolist()
        turned = float(wrapped(angle + rng.uniform(-NEAR_ANGLE, NEAR_ANGLE)))
        fins = [replace(others[0], position=(x, y, z), mounting_angle=turned), *others[1:]]
    return replace(layout, actuators=(first, *fins)), ()


def _fins(
    rng: np.random.Generator, name: str, mixed: bool = False
) -> tuple[Layout, tuple[str, ...]]:
    """All fins of one random model, or each of a random model of its own."""
    layout = random_layout(rng, name)
    model = random_fin_model(rng)
    models = [model, *(random_fin_model(rng) if mixed else model for _ in layout.fins[1:])]
    fins = (replace(fin, model=own) for fin, own in zip(layout.fins, models, strict=True))
    return replace(layout, actuators=tuple(fins)), ()


def _tables(rng: np.random.Generator, name: str) -> tuple[Layout, tuple[str, ...]]:
    """The same, each fin known by a noisy table."""
    layout, _ = _fins(rng, name, mixed=True)
    noise = zip(layout.fins, rng.spawn(layout.n_fins), strict=True)
    fins = (_noisy_table(own, fin, f"{name}-{fin.name}") for fin, own in noise)
    return replace(layout, actuators=tuple(fins)), ()


def _noisy_table(rng: np.random.Generator, fin: Fin, name: str) -> Fin:
    """A fin with a table of its model in place of the model; the file of that name is written
    once."""
    path = Path(_table_folder().name) / f"{name}.csv"
    if not path.exists():
        ranges = zip((fin.limits.amplitude, fin.limits.frequency), GRID, strict=False)
        axes = [np.linspace(*ends, count) for ends, count in ranges]
        axes.append(np.linspace(-np.pi, np.pi, GRID[2], endpoint=False))
        force = make_law(fin.model).force(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
        noisy = np.asarray(force * (1.0 + NOISE * rng.standard_normal(force.shape)))
        write_table(path, TableLaw(axes, noisy, periodic=True), *axes)
    return replace(fin, model=FinModelSpec("table", (("path", str(path)),)))


@cache
def _table_folder() -> "TemporaryDirectory[str]":
    """Where this process keeps its tables; gone when it ends."""
    return TemporaryDirectory(prefix="finlab-tables-")


def _robots(*kinds: ActuatorMaker, count: tuple[int, int], each: bool = False) -> Draw:
    """Robots of random actuators of some kinds; options of `random_robot`."""
    return lambda rng, name: (random_robot(rng, name, count, kinds, each), ())


SPLITS: dict[str, tuple[int, Draw]] = {
    "id": (0, _whole()),
    "ood": (1, _whole(box=OOD_BOX, outside=TRAINING_BOX)),
    "ood-fins": (2, _whole(n_fins=OOD_FINS)),
    "limits": (3, _whole(limits="varied")),
    "failure": (4, _failure),
    "near-singular": (5, _near_singular),
    "fins": (6, _fins),
    "fins-mixed": (7, partial(_fins, mixed=True)),
    "tables": (8, _tables),
    "many-fins": (9, _whole(n_fins=MANY_FINS)),
    "thrusters": (18, _robots(random_thruster, count=(4, 10))),
    "azimuths": (19, _robots(random_azimuth, count=(2, 6))),
    "mixed-actuators": (
        20,
        _robots(
            *(random_shaft_fin, random_thruster, random_azimuth, random_tilt),
            count=(4, 10),
            each=True,
        ),
    ),
    "any-shaft": (21, _robots(random_shaft_fin, count=(2, 8))),
}
"""Name -> a number that is part of the seed and of no other split, and how a layout and its lost
fins are drawn."""
