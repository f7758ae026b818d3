"""Unknowns of a fit, with what is believed before: each in units of how far it may be off."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
BASE = tuple("strength mounting lean center bias buoyancy lift current".split())  # noqa: SIM905
BASE += ("inertia", "linear", "quadratic", "delay")
SHAPE = "shape"
"""What is looked for besides in robots of fins, where it helps: another law of thrust."""

SENSORS = {
    "position and heading": (0, 1, 5),
    "depth": (2,),
    "attitude and rates": (3, 4, 9, 10, 11),
    "velocity": (6, 7, 8),
}
"""What comes from one sensor, and is late together: channels of a swim."""

SAME_SCALE = 0.003
"""How far the common scale of all inertia may be off, as a share."""


@dataclass(frozen=True)
class Block:
    """Unknowns of one kind: how far each may be off, one standard deviation of what is believed
    before a swim, and whether the wrench of the actuators depends on them."""

    name: str
    labels: tuple[str, ...]
    unit: str
    scale: Array
    force: bool


def blocks_of(names: Sequence[str], damping: Array) -> dict[str, Block]:
    """All unknowns of actuators of these names and their robot, whose damping may be off by (2,
    6)."""

    def block(
        name: str, labels: Sequence[str], scale: ArrayLike, unit: str, force: bool = True
    ) -> Block:
        return Block(
            name, tuple(labels), unit, np.broadcast_to(scale, len(labels)).astype(float), force
        )

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
    return {one.name: one for one in blocks}


class Unknowns:
    """A vector of some blocks, each entry in units of its scale, so that all are believed to be 0
    +- 1."""

    def __init__(self, blocks: dict[str, Block], chosen: Sequence[str]) -> None:
        self.blocks = [blocks[name] for name in chosen]
        ends = np.cumsum([0, *(len(block.labels) for block in self.blocks)]).tolist()
        places = zip(self.blocks, ends, ends[1:], strict=False)
        self._where = {block.name: slice(begin, end) for block, begin, end in places}
        self.size: int = ends[-1]
        self.scale = np.concatenate([block.scale for block in self.blocks])
        """(size,)."""
        self.labels = tuple(label for block in self.blocks for label in block.labels)
        self.units = tuple(block.unit for block in self.blocks for _ in block.labels)
        self.force = np.array([block.force for block in self.blocks for _ in block.labels])
        """Whether the wrench of the actuators depends on each (size,)."""

    @cached_property
    def prior_information(self) -> Array:
        """Inverse covariance (size, size) of what is believed before a swim: each is 0 +- 1, and
        the common scale of all inertia is as the layout says. Motion cannot tell it, so nothing
        else must move it."""
        place = self._where["inertia"]
        gauge = np.zeros(self.size)
        gauge[place] = self.scale[place] / (place.stop - place.start) / SAME_SCALE
        return np.eye(self.size) + np.outer(gauge, gauge)

    def part(self, name: str, vector: Array) -> Array | None:
        """The unknowns (..., k) of one block in its own units, from vectors (..., size); None where
        it is not looked for."""
        return self.of(name, vector) if name in self._where else None

    def of(self, name: str, vector: Array) -> Array:
        """The unknowns (..., k) of a block that every fit looks for, as `part` gives them."""
        where = self._where[name]
        return np.asarray(vector[..., where] * self.scale[where])

    def place(self, name: str) -> slice:
        """Where a block stands in a vector (size,)."""
        return self._where[name]
