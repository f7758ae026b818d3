"""How forces of actuators become commands, and commands forces, in numbers for the core (finlab/core/law.c)."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Literal, NamedTuple

import numpy as np

from finlab.actuators.fin.hermite_grid import Grid, HermiteGrids
from finlab.arrays import Array
from finlab.precision import NOTHING

CELLS = (16, 1), (64, 1), (256, 1), (16, 16), (64, 64)
"""Cells of amplitude and frequency that are tried for the law of a fin."""


class Form(NamedTuple):
    """How a force of one actuator becomes a command, and a command a force, for the core (finlab/core/law.c)."""

    kind: Literal["thruster", "pod", "fin", "foil"]
    """A force; an angle and a force; a beat of a fin; an angle of a foil."""
    axes: Array | None = None
    """Axes (3, 3) of the law's forces in the actuator's own ones; None where they are the same."""
    law: Array | None = None
    """A grid of the law, see `grid_numbers`."""
    beat: Array | None = None
    """Of a fin: (K + 1, 2) amplitudes and frequencies of the shares (j / K)^2 of its largest force. Of a foil:
    coefficients of lift, rising, and angles (K, 2)."""
    deflection: Array | None = None
    """Of a fin with a gauge: angles (POINTS,) [rad] from the direction of the command to that of the force."""
    numbers: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    """Sign of a thruster's command; lean, unevenness and its angle of a fin, or the course of a foil as lean;
    pressure [N], angle without lift and drag there of a foil."""


def grid_numbers(
    axes: Sequence[Array], values: Array, period: float = 0.0, product: bool = False, root: bool = False
) -> Array:
    """Returns a grid of values (a, f, d, c) on three axes as the core takes it: `product` says that the first
    one is amplitude times frequency, `root` that the values are square roots."""
    head = [*map(len, axes), period, product, values.shape[-1], root]
    return np.concatenate([np.array(head, np.float64), *axes, values.ravel()])


def size_numbers(size: Callable[[Array, Array], Array], lower: Array, upper: Array) -> Array:
    """Returns the size of a fin's force over amplitude and frequency within limits (3,) as a grid for the core,
    on as few knots as say it: the size or its root, over amplitude or its product with frequency."""
    share = np.random.default_rng(0).uniform(size=(300, 3))
    command = lower + share * (upper - lower)
    wanted, best, least = size(command[:, 0], command[:, 1]), np.empty(0), np.inf
    for cells, beat, root in product(CELLS, (False, True), (True, False)):
        ends = [(lower[0] * lower[1], upper[0] * upper[1]) if beat else (lower[0], upper[0]), (lower[1], upper[1])]
        axes = [_knots(*end, count) for end, count in zip(ends, cells, strict=True)]
        first, second = np.meshgrid(*axes, indexing="ij")
        amplitude = np.abs(first) / np.maximum(np.abs(second), NOTHING) if beat else np.abs(first)
        value = size(amplitude, np.abs(second))
        value = np.sign(first) * np.sign(second) ** (not beat) * np.sqrt(value) if root else value
        at = np.stack([command[:, 0] * command[:, 1] if beat else command[:, 0], command[:, 1], share[:, 2]], axis=-1)
        grid = Grid([*axes, np.array([0.0, 1.0])], np.stack([value, value], axis=-1)[..., None], False)
        got = HermiteGrids([grid])(at, 1)[:, 0, 0, 0, 0] ** (2 if root else 1)
        error = float(np.abs(got - wanted).max())
        if error < least:
            least, best = error, grid_numbers([*axes, np.zeros(1)], value[..., None, None], 0.0, beat, root)
        if error <= NOTHING * wanted.max():
            break
    return best


def _knots(low: float, high: float, cells: int) -> Array:
    """Knots of equal cells between two ends, and one more on either side: slopes at the ends are as good."""
    width = max(high - low, NOTHING) / cells
    return low + width * np.arange(-1.0, cells + 2.0)
