"""Random layouts, in numpy: for held-out splits, tests and data on disk.

The numbers that define the training distribution (box, fin counts, spread of limits) are here and nowhere
else.
"""

import math
from typing import Literal

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout.arrays import LayoutArrays, empty_arrays
from finlab.layout.fin import Fin, Limits
from finlab.layout.layout import Layout

TRAINING_BOX = (0.3, 0.3, 0.1)
"""Largest |x|, |y|, |z| of a fin in training and in split `id` [m]."""
TRAINING_FINS = (2, 5)
"""Least and most fins of a layout in training and in split `id`."""
AMPLITUDE_MAX_RANGE = (0.3, 0.8)
"""Where a varied amplitude maximum is drawn from [rad]."""
FREQUENCY_MAX_RANGE = (1.0, 3.0)
"""Where a varied frequency maximum is drawn from [Hz]."""
ARC_SHARE = 1.0 / 3.0
"""Share of fins with varied limits whose zero direction is confined to an arc."""
ARC_RANGE = (math.pi / 2, 1.5 * math.pi)
"""Where the width of such an arc is drawn from [rad]; the arc lies within [-pi, pi]."""

LimitsKind = Literal["nominal", "varied", "mixed"]


def random_layouts(
    rng: np.random.Generator,
    n: int,
    n_fins: int | tuple[int, int] = TRAINING_FINS,
    box: tuple[float, float, float] = TRAINING_BOX,
    limits: LimitsKind | float = "nominal",
    outside: tuple[float, float, float] | None = None,
) -> LayoutArrays:
    """Returns n random layouts as one batch, padded to the largest possible fin count.

    Positions are uniform in the box and angles in [-pi, pi). With `limits="varied"` every fin gets its own
    limits as in split `limits`; with a number, this share of the layouts; `"mixed"` is half of them.

    Args:
        rng: source of randomness.
        n: how many layouts.
        n_fins: the fin count, or its least and most (uniform).
        box: largest |x|, |y|, |z| [m].
        limits: see above.
        outside: when given, at least one fin of each layout lies outside this smaller box.

    Raises:
        DataError: `outside` is not smaller than `box` in any direction, so no such layout exists.
    """
    least, most = (n_fins, n_fins) if isinstance(n_fins, int) else n_fins
    extent = np.array(box)
    if outside is not None and not np.any(extent > np.array(outside)):
        raise DataError(f"no fin within {box} can lie outside {outside}; make the first box larger")
    arrays = empty_arrays(n, most)
    count = rng.integers(least, most + 1, size=n)
    arrays.mask[:] = np.arange(arrays.mask.shape[1]) < count[:, None]
    arrays.position[:] = rng.uniform(-1.0, 1.0, arrays.position.shape) * extent
    while outside is not None and (redo := ~_any_outside(arrays, outside)).any():
        arrays.position[redo] = rng.uniform(-1.0, 1.0, arrays.position[redo].shape) * extent
    arrays.position[~arrays.mask] = 0.0
    arrays.mounting_angle[:] = np.where(arrays.mask, rng.uniform(-math.pi, math.pi, arrays.mask.shape), 0.0)
    if limits != "nominal":
        varied = arrays.mask
        if limits != "varied":
            varied = varied & (rng.uniform(size=(n, 1)) < (0.5 if limits == "mixed" else limits))
        _vary_limits(rng, arrays, varied)
    return arrays


def random_layout(
    rng: np.random.Generator,
    name: str = "random",
    n_fins: int | tuple[int, int] = TRAINING_FINS,
    box: tuple[float, float, float] = TRAINING_BOX,
    limits: LimitsKind = "nominal",
    outside: tuple[float, float, float] | None = None,
) -> Layout:
    """Returns one random layout with fins `fin_1`, `fin_2`, ...; arguments as for `random_layouts`."""
    return layout_from_arrays(random_layouts(rng, 1, n_fins, box, limits, outside), 0, name)


def layout_from_arrays(arrays: LayoutArrays, row: int = 0, name: str = "random") -> Layout:
    """Returns row `row` of a padded batch as a layout with fins `fin_1`, `fin_2`, ..."""
    fins: list[Fin] = []
    for i in np.flatnonzero(arrays.mask[row]):
        x, y, z = arrays.position[row, i].tolist()
        pairs = [tuple(p) for p in np.stack([arrays.lower[row, i], arrays.upper[row, i]], axis=1).tolist()]
        angle = float(arrays.mounting_angle[row, i])
        fins.append(Fin(f"fin_{len(fins) + 1}", (x, y, z), angle, Limits(*pairs)))
    return Layout(name=name, actuators=tuple(fins))


def _any_outside(arrays: LayoutArrays, box: tuple[float, float, float]) -> np.ndarray:
    beyond = (np.abs(arrays.position) > np.array(box)).any(axis=-1)
    return np.asarray((beyond & arrays.mask).any(axis=-1))


def _vary_limits(rng: np.random.Generator, arrays: LayoutArrays, varied: np.ndarray) -> None:
    """Overwrites the limits of the fins where `varied` (B, n) is true."""
    shape = varied.shape
    amplitude: Array = rng.uniform(*AMPLITUDE_MAX_RANGE, shape)
    frequency: Array = rng.uniform(*FREQUENCY_MAX_RANGE, shape)
    width: Array = rng.uniform(*ARC_RANGE, shape)
    center: Array = rng.uniform(-1.0, 1.0, shape) * (math.pi - width / 2)
    arc = varied & (rng.uniform(size=shape) < ARC_SHARE)
    arrays.upper[..., 0] = np.where(varied, amplitude, arrays.upper[..., 0])
    arrays.upper[..., 1] = np.where(varied, frequency, arrays.upper[..., 1])
    arrays.lower[..., 2] = np.where(arc, center - width / 2, arrays.lower[..., 2])
    arrays.upper[..., 2] = np.where(arc, center + width / 2, arrays.upper[..., 2])
