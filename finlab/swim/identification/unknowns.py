"""Unknowns of a fit, with what is believed before: each in units of how far it may be off."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""The six axes, as they are called in the labels of unknowns."""
BASE = (
    "strength",
    "mounting",
    "lean",
    "center",
    "bias",
    "buoyancy",
    "lift",
    "current",
    "inertia",
    "linear",
    "quadratic",
    "delay",
)
"""Blocks that every fit looks for."""
SHAPE = "shape"
"""The block that is looked for besides in robots of fins, where it helps: another law of
thrust."""

SENSORS = {
    "position and heading": (0, 1, 5),
    "depth": (2,),
    "attitude and rates": (3, 4, 9, 10, 11),
    "velocity": (6, 7, 8),
}
"""What comes from one sensor, and is late together: channels of a swim."""

COMMON_SCALE_DEVIATION = 0.003
"""How far the common scale of all inertia may be off, as a share."""


@dataclass(frozen=True)
class Block:
    """Unknowns of one kind."""

    name: str
    labels: tuple[str, ...]
    """What each of the k unknowns is, in words."""
    unit: str
    scale: Array
    """How far each may be off (k,): one standard deviation of what is believed before a swim."""
    moves_wrench: bool
    """Whether the wrench of the actuators depends on them."""


def blocks_of(names: Sequence[str], damping: Array) -> dict[str, Block]:
    """Returns all blocks of a robot by name.

    Args:
        names: of its actuators.
        damping: how far its linear and quadratic damping may be off (2, 6).
    """

    def block(
        name: str, labels: Sequence[str], scale: ArrayLike, unit: str, moves_wrench: bool = True
    ) -> Block:
        scales = np.broadcast_to(scale, len(labels)).astype(float)
        return Block(name, tuple(labels), unit, scales, moves_wrench)

    shape = ("amplitude", "frequency", "amplitude^2", "amplitude x frequency", "frequency^2")
    blocks = (
        block("strength", [f"strength of {name}, logarithm" for name in names], 0.3, ""),
        block("mounting", [f"mounting angle of {name}" for name in names], 0.1, "rad"),
        block("lean", [f"lean of {name}" for name in names], 0.1, "rad"),
        block("center", [f"centre of gravity, {axis}" for axis in "xyz"], 0.02, "m"),
        block("buoyancy", [f"centre of buoyancy, {axis}" for axis in "xyz"], 0.01, "m", False),
        block("lift", ["buoyancy less weight"], 2.0, "N", False),
        block(
            "bias", [f"constant {axis}" for axis in ("Fx", "Fy", "Tz")], (1.0, 1.0, 0.1), "N, N m"
        ),
        block("current", ["current along x", "current along y"], 0.05, "m/s", False),
        block(
            "inertia", [f"inertia with water in {axis}, logarithm" for axis in AXES], 0.1, "", False
        ),
        block(
            "linear",
            [f"linear damping in {axis}" for axis in AXES],
            damping[0],
            "N s/m, N m s",
            False,
        ),
        block(
            "quadratic", [f"quadratic damping in {axis}" for axis in AXES], damping[1], "", False
        ),
        block("delay", [f"delay of {sensor}" for sensor in SENSORS], 0.05, "s", False),
        block(SHAPE, [f"thrust by {name}" for name in shape], (0.5, 0.5, 0.3, 0.3, 0.3), ""),
    )
    return {each.name: each for each in blocks}


class Unknowns:
    """A vector of some blocks, each entry in units of its scale, so that all are believed to be 0
    +- 1."""

    def __init__(self, blocks: dict[str, Block], chosen: Sequence[str]) -> None:
        """Lays blocks one after the other.

        Args:
            blocks: all blocks by name, as `blocks_of` makes them.
            chosen: names of those that are looked for.
        """
        self.blocks = [blocks[name] for name in chosen]
        self._slices: dict[str, slice] = {}
        labels: list[str] = []
        units: list[str] = []
        moves_wrench: list[bool] = []
        for block in self.blocks:
            begin = len(labels)
            labels += block.labels
            units += [block.unit] * len(block.labels)
            moves_wrench += [block.moves_wrench] * len(block.labels)
            self._slices[block.name] = slice(begin, len(labels))
        self.size = len(labels)
        self.scale = np.concatenate([block.scale for block in self.blocks])
        """One standard deviation of what is believed before a swim, in own units (size,)."""
        self.labels = tuple(labels)
        """What each unknown is, in words."""
        self.units = tuple(units)
        self.moves_wrench = np.array(moves_wrench)
        """Whether the wrench of the actuators depends on each (size,)."""

    @cached_property
    def prior_information(self) -> Array:
        """Inverse covariance (size, size) of what is believed before a swim: each is 0 +- 1, and
        the common scale of all inertia is as the layout says. Motion cannot tell it, so nothing
        else must move it."""
        inertia = self._slices["inertia"]
        mean_weight = np.zeros(self.size)
        n_axes = inertia.stop - inertia.start
        mean_weight[inertia] = self.scale[inertia] / n_axes / COMMON_SCALE_DEVIATION
        return np.eye(self.size) + np.outer(mean_weight, mean_weight)

    def optional_block(self, name: str, vector: Array) -> Array | None:
        """As `block`; None where the block is not looked for."""
        return self.block(name, vector) if name in self._slices else None

    def block(self, name: str, vector: Array) -> Array:
        """Returns the unknowns (..., k) of one block in its own units.

        Args:
            name: of the block.
            vector: all unknowns (..., size), in scales.
        """
        columns = self._slices[name]
        return np.asarray(vector[..., columns] * self.scale[columns])

    def slice_of(self, name: str) -> slice:
        """Where a block stands in a vector (size,)."""
        return self._slices[name]
