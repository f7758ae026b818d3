"""The distinct ways in which a robot can deliver a wrench: alternatives that do the same are one
mode.

A fin that hardly pushes counts as resting, however it does so. Two commands are the same mode if
the same fins rest and all others push about as hard in about the same direction, angles compared
the shorter way round.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.solution import Candidates, PlainData
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.layout import Layout
from finlab.physics import plant_of

RESTING, STILL = 0.15, 0.01
"""Shares of the strongest fin's thrust below which a fin counts as resting, and below which it
truly does."""
SAME_DIRECTION = float(np.radians(25.0))
"""Zero directions closer than this are the same [rad]."""
SAME_SIZE = 0.25
"""Thrusts, and ratios of amplitude to frequency, whose logarithms differ by less are the same."""


class ModeSignature(NamedTuple):
    """What matters of commands: numbers per fin (..., n), NaN where the fin rests or is lost."""

    resting: NDArray[np.bool_]
    """Fins that rest."""
    thrust: Array
    """Logarithm of the force [N]."""
    direction: Array
    """Zero direction [rad]."""
    style: Array
    """Logarithm of amplitude over frequency."""


@dataclass(frozen=True, eq=False)
class Mode(PlainData):
    """One way to deliver the wrench: the best of the alternatives that do the same."""

    command: Array
    """(n, 3): amplitude [rad], frequency [Hz], zero direction [rad]; NaN for lost fins."""
    err_norm: float
    """Normalized error of that wrench."""
    effort: float
    """Effort `J_en`, the paper's energy proxy."""
    power: float
    """Mean mechanical power [W]."""
    saturation: float
    """Largest share of any fin's range of amplitude or frequency that is used; 1 is a limit."""
    still: tuple[int, ...]
    """Places of the fins that do not push, by their own laws; others of `resting` hardly do."""
    signature: ModeSignature
    """What distinguishes it from other ways."""
    sources: tuple[str, ...]
    """Where these come from, in words, each once."""

    @property
    def resting(self) -> tuple[int, ...]:
        """Places of the fins that hardly push, by their own laws."""
        return tuple(np.flatnonzero(self.signature.resting).tolist())


def find_modes(
    candidates: Candidates, force: Array, lower: Array, upper: Array
) -> tuple[Mode, ...]:
    """The modes among K candidates, best first, in their order, by the size of each fin's force (K,
    n) [N] as `force_sizes` has it, and the lower and upper limits (n, 3)."""
    modes = []
    span = np.maximum(upper - lower, 1e-9)
    signatures = mode_signature(candidates.command, force)
    for members in cluster(signatures):
        first = members[0]
        command = candidates.command[first]
        own = force[first]
        figures = float(candidates.err_norm[first]), float(candidates.effort[first])
        saturation = float(np.clip(np.nanmax(((command - lower) / span)[:, :2]), 0.0, 1.0))
        still = tuple(np.flatnonzero(own < STILL * own.max()).tolist())
        sources = tuple(dict.fromkeys([candidates.source[k] for k in members]))
        signature = _row(signatures, first)
        power = float(candidates.power[first])
        modes.append(Mode(command, *figures, power, saturation, still, signature, sources))
    return tuple(modes)


def cluster(signatures: ModeSignature) -> list[list[int]]:
    """Places of K signatures that are the same, each group led by its first."""
    groups: list[list[int]] = []
    left = np.arange(len(signatures.thrust))
    while len(left):
        same = same_signature(_row(signatures, left[0]), _row(signatures, left))
        groups.append(left[same].tolist())
        left = left[~same]
    return groups


def _row(signatures: ModeSignature, place: Any) -> ModeSignature:
    return ModeSignature._make([values[place] for values in signatures])


def force_sizes(layout: Layout, command: Array) -> Array:
    """Size of each fin's force (..., n) [N] by its own law for commands (..., n, 3), zero for lost
    fins."""
    return np.asarray(np.linalg.norm(plant_of(layout).forces(command), axis=-1))


def mode_signature(command: Array, force: Array) -> ModeSignature:
    """What matters of commands (..., n, 3) with forces of these sizes (..., n) [N]."""
    works = np.isfinite(command).all(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        thrust = np.log(force)
        style = np.log(command[..., 0]) - np.log(command[..., 1])
    strongest = np.where(works, force, 0.0).max(axis=-1, keepdims=True, initial=0.0)
    resting = works & (force < RESTING * strongest)
    pushes = works & ~resting & np.isfinite(thrust)
    return ModeSignature(resting, *np.where(pushes, (thrust, command[..., 2], style), np.nan))


def signature_difference(a: ModeSignature, b: ModeSignature) -> Array:
    """How `b` differs from `a` (3, ..., n) in direction, thrust and style; 1 is what counts as
    different."""
    turn = wrapped(b.direction - a.direction) / SAME_DIRECTION
    rest = np.array([b.thrust - a.thrust, b.style - a.style]) / SAME_SIZE
    return np.asarray(np.nan_to_num(np.concatenate([turn[None], rest])))


def same_signature(a: ModeSignature, b: ModeSignature) -> NDArray[np.bool_]:
    """Whether commands with these signatures are one mode, for one pair or many (...)."""
    alike = (np.abs(signature_difference(a, b)) < 1.0).all(axis=(0, -1))
    return np.asarray(alike & (a.resting == b.resting).all(axis=-1))
