"""Numbers for the core: how forces of actuators become commands, and commands forces.

finlab/core/src/command_law.c reads them.
"""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Literal, NamedTuple

import numpy as np

from finlab.actuators.fin.hermite_grid import Grid, HermiteGrids
from finlab.arrays import Array
from finlab.precision import NOTHING

_CELLS = (16, 1), (64, 1), (256, 1), (1024, 1), (16, 16), (64, 64)
"""Cells of amplitude and frequency that are tried for the law of a fin."""


class Form(NamedTuple):
    """How a force of one actuator becomes a command, and a command a force."""

    kind: Literal["thruster", "pod", "fin", "foil"]
    """A force; an angle and a force; a beat of a fin; an angle of a foil."""
    axes: Array | None = None
    """Axes (3, 3) of the law's forces in the actuator's own ones; None where they are the same."""
    law: Array | None = None
    """A grid of the law, see `grid_numbers`."""
    beat: Array | None = None
    """Of a fin: amplitudes and frequencies (K + 1, 2) of the shares (j / K)^2 of its largest force. Of a
    foil: coefficients of lift, rising, and angles (K, 2)."""
    deflection: Array | None = None
    """Of a fin with a gauge: angles (POINTS,) [rad] from the command's direction to the force's."""
    sign: float = 1.0
    """Of a thruster's command over its force: -1 where it only pulls."""
    lean: float = 0.0
    """Angle [rad] from the command of a fin to its force; of a foil the direction of travel."""
    uneven: float = 0.0
    """Of a fin, whose force grows by the factor 1 + uneven cos(angle - uneven_at)."""
    uneven_at: float = 0.0
    """See `uneven` [rad]."""
    pressure: float = 1.0
    """Dynamic pressure times area of a foil [N]."""
    zero_lift_angle: float = 0.0
    """Command of a foil at which it has no lift [rad]."""
    zero_lift_drag: float = 0.0
    """Coefficient of its drag there."""


def grid_numbers(
    axes: Sequence[Array], values: Array, period: float = 0.0, product: bool = False, root: bool = False
) -> Array:
    """Returns a grid of values (a, f, d, c) on three axes as the core takes it: `product` says that the first
    one is amplitude times frequency, `root` that the values are square roots."""
    head = [*map(len, axes), period, product, values.shape[-1], root]
    return np.concatenate([np.array(head, np.float64), *axes, values.ravel()])


def size_numbers(size: Callable[[Array, Array], Array], lower: Array, upper: Array) -> Array:
    """Returns the size of a fin's force over amplitude and frequency within limits (3,) as a grid for the
    core, on as few knots as say it: the size or its root, over amplitude or its product with frequency."""
    share = np.random.default_rng(0).uniform(size=(300, 3))
    command = lower + share * (upper - lower)
    wanted, best, least = size(command[:, 0], command[:, 1]), np.empty(0), np.inf
    for (cells, more), beat, root in product(_CELLS, (False, True), (True, False)):
        ends = (lower[0] * lower[1], upper[0] * upper[1]) if beat else (lower[0], upper[0])
        # Of the product alone, the frequency does not matter; powers of it bend most near 0.
        axes = [_knots(*ends, cells, 2.0 if beat else 1.0), _knots(lower[1], upper[1], more, 1.0)]
        if beat and more == 1:
            axes[1] = np.array([0.5 * (lower[1] + upper[1])])
        first, second = np.meshgrid(*axes, indexing="ij")
        amplitude = np.abs(first) / np.maximum(np.abs(second), NOTHING) if beat else np.abs(first)
        value = np.maximum(size(amplitude, np.abs(second)), 0.0)
        if root:
            value = np.sqrt(value) * np.sign(first) * (1.0 if beat else np.sign(second))
        at = np.stack(
            [command[:, 0] * command[:, 1] if beat else command[:, 0], command[:, 1], share[:, 2]], axis=-1
        )
        known = [np.append(axis, axis + 1.0) if len(axis) == 1 else axis for axis in (*axes, np.zeros(1))]
        values = np.broadcast_to(value[..., None, None], (len(known[0]), len(known[1]), 2, 1))
        got = HermiteGrids([Grid(known, values, False)])(at, 1)[:, 0, 0, 0, 0] ** (2 if root else 1)
        error = float(np.abs(got - wanted).max())
        if error < least:
            least, best = error, grid_numbers([*axes, np.zeros(1)], value[..., None, None], 0.0, beat, root)
        if error <= NOTHING * wanted.max():
            break
    return best


def _knots(low: float, high: float, cells: int, power: float) -> Array:
    """Knots between two ends, as dense towards the lower one as a power of equal steps, and one more on
    either side: slopes at the ends are as good."""
    width, share = max(high - low, NOTHING), (np.arange(cells + 2.0) / cells) ** power
    return low + width * np.concatenate([[-share[1]], share])
