"""Layouts whose geometry is hard: moved by hand, in line, in a heap, on one place, very big or very small."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from finlab.assets import PAPER_LAYOUTS
from finlab.layout import Fin, FinModelSpec, Layout, load_layout, random_layout
from finlab.layout.angles import wrapped
from finlab.layout.random import TRAINING_BOX

MOVED_M, TURNED_RAD = 0.02, math.radians(20.0)
"""How far their fins are moved along each axis [m] and turned, at most, as a builder's hand may."""
CLUSTER_M = 0.03
"""Fins of a cluster lie within this of its middle along each axis [m]."""
BIG, TINY = 10.0, 1.0 / 6.0
"""Length over that of the training layouts: fins out to 3 m and to 5 cm."""

DrawLayout = Callable[[np.random.Generator, str], Layout]
"""From a generator and a name: a layout."""


def perturbed(rng: np.random.Generator, name: str) -> Layout:
    """One of the paper's robots, its fins moved and turned a little."""
    layout = load_layout(str(rng.choice(PAPER_LAYOUTS)))
    moves = rng.uniform(-MOVED_M, MOVED_M, (layout.n_fins, 3))
    turns = rng.uniform(-TURNED_RAD, TURNED_RAD, layout.n_fins)
    return replace(layout, name=name, fins=_placed(layout.fins, _positions(layout.fins) + moves, turns))


def parallel(rng: np.random.Generator, name: str) -> Layout:
    """All shafts along one direction, or against it."""
    layout = random_layout(rng, name)
    halves = math.pi * rng.integers(0, 2, layout.n_fins)
    angles = [fin.mounting_angle for fin in layout.fins]
    turns = layout.fins[0].mounting_angle + halves - angles
    return replace(layout, fins=_placed(layout.fins, _positions(layout.fins), turns))


def collinear(rng: np.random.Generator, name: str) -> Layout:
    """All fins on one line through the box, three and more of them."""
    layout = random_layout(rng, name, n_fins=(3, 5))
    first, last = rng.uniform(-1.0, 1.0, (2, 3)) * TRAINING_BOX
    along = rng.uniform(0.0, 1.0, (layout.n_fins, 1))
    return replace(layout, fins=_placed(layout.fins, first + along * (last - first)))


def clustered(rng: np.random.Generator, name: str) -> Layout:
    """All fins within a few centimetres of one place."""
    layout = random_layout(rng, name)
    middle = rng.uniform(-1.0, 1.0, 3) * TRAINING_BOX
    around = rng.uniform(-CLUSTER_M, CLUSTER_M, (layout.n_fins, 3))
    return replace(layout, fins=_placed(layout.fins, middle + around))


def coincident(rng: np.random.Generator, name: str) -> Layout:
    """Two of three to six fins share their place, with shafts along or against each other."""
    layout = random_layout(rng, name, n_fins=(3, 6))
    first, second, *others = layout.fins
    turned = first.mounting_angle + (math.pi if rng.random() < 0.5 else 0.0)
    twin = replace(second, position=first.position, mounting_angle=math.remainder(turned, 2.0 * math.pi))
    return replace(layout, fins=(first, twin, *others))


def stacked(rng: np.random.Generator, name: str) -> Layout:
    """Two to four pairs of fins, one above the other, at the same height above and below the centre."""
    fins: list[Fin] = []
    for low in random_layout(rng, name, n_fins=(2, 4)).fins:
        x, y, _ = low.position
        height = float(rng.uniform(0.02, TRAINING_BOX[2]))
        for where, z in (("up", height), ("down", -height)):
            fins.append(replace(low, name=f"{low.name}_{where}", position=(x, y, z)))
    return Layout(name, tuple(fins))


def scaled(size: float) -> DrawLayout:
    """Layouts as in training, times a size: places and blades; a bigger blade's tip moves no faster."""

    def draw(rng: np.random.Generator, name: str) -> Layout:
        layout = random_layout(rng, name)
        blade = FinModelSpec().values()
        bigger = ("area", float(blade["area"]) * size**2), ("lever", float(blade["lever"]) * size)
        model = FinModelSpec("drag", bigger)
        fins = _placed(layout.fins, size * _positions(layout.fins))
        low, high = fins[0].limits.frequency
        slower = (low / max(size, 1.0), high / max(size, 1.0))
        return replace(
            layout,
            fins=tuple(
                replace(fin, model=model, limits=replace(fin.limits, frequency=slower)) for fin in fins
            ),
        )

    return draw


def _positions(fins: tuple[Fin, ...]) -> np.ndarray:
    """Places of fins (n, 3) [m]."""
    return np.array([fin.position for fin in fins])


def _placed(fins: tuple[Fin, ...], positions: np.ndarray, turns: np.ndarray | float = 0.0) -> tuple[Fin, ...]:
    """Fins at other places (n, 3) [m], turned (n,) [rad]."""
    angles = wrapped(np.array([fin.mounting_angle for fin in fins]) + turns)
    return tuple(
        replace(fin, position=tuple(position), mounting_angle=float(angle))
        for fin, position, angle in zip(fins, positions.tolist(), angles, strict=True)
    )
