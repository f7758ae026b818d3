"""The distinct ways in which a robot of fins can deliver a wrench: candidates that do the same are
one mode, which the page shows once.

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

RESTING = 0.15
"""Share of the strongest fin's thrust below which a fin counts as resting."""
STILL = 0.01
"""Share of the strongest fin's thrust below which a fin truly rests."""
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
    """Indices of the fins that do not push, by their own laws; others of `resting` hardly do."""
    signature: ModeSignature
    """What distinguishes it from other ways."""
    sources: tuple[str, ...]
    """Where these come from, in words, each once."""

    @property
    def resting(self) -> tuple[int, ...]:
        """Indices of the fins that hardly push, by their own laws."""
        return tuple(np.flatnonzero(self.signature.resting).tolist())


def find_modes(
    candidates: Candidates, force: Array, lower: Array, upper: Array
) -> tuple[Mode, ...]:
    """Finds the modes among candidates.

    Args:
        candidates: K of them, best first.
        force: sizes (K, n) [N] of each fin's force, as `force_sizes` has them.
        lower: lower limits (n, 3) of the commands.
        upper: upper limits (n, 3).

    Returns:
        The modes, in the order of their best candidates.
    """
    modes = []
    width = np.maximum(upper - lower, 1e-9)
    signatures = mode_signature(candidates.command, force)
    for members in cluster(signatures):
        best = members[0]
        command = candidates.command[best]
        force_of_best = force[best]
        used_share = ((command - lower) / width)[:, :2]
        still = np.flatnonzero(force_of_best < STILL * force_of_best.max())
        sources = dict.fromkeys([candidates.source[k] for k in members])
        mode = Mode(
            command=command,
            err_norm=float(candidates.err_norm[best]),
            effort=float(candidates.effort[best]),
            power=float(candidates.power[best]),
            saturation=float(np.clip(np.nanmax(used_share), 0.0, 1.0)),
            still=tuple(still.tolist()),
            signature=_rows_of(signatures, best),
            sources=tuple(sources),
        )
        modes.append(mode)
    return tuple(modes)


def cluster(signatures: ModeSignature) -> list[list[int]]:
    """Returns the indices of K signatures in groups that are the same, each led by its first."""
    groups: list[list[int]] = []
    left = np.arange(len(signatures.thrust))
    while len(left):
        same = same_signature(_rows_of(signatures, left[0]), _rows_of(signatures, left))
        groups.append(left[same].tolist())
        left = left[~same]
    return groups


def _rows_of(signatures: ModeSignature, rows: Any) -> ModeSignature:
    """One of K signatures, or some."""
    return ModeSignature._make([values[rows] for values in signatures])


def force_sizes(layout: Layout, command: Array) -> Array:
    """Returns the size of each fin's force.

    Args:
        layout: the robot.
        command: (..., n, 3), NaN for lost fins.

    Returns:
        (..., n) [N] by the fins' own laws, zero for lost ones.
    """
    return np.asarray(np.linalg.norm(plant_of(layout).forces(command), axis=-1))


def mode_signature(command: Array, force: Array) -> ModeSignature:
    """Returns what matters of commands.

    Args:
        command: (..., n, 3).
        force: sizes (..., n) [N] of the forces that they give.

    Returns:
        The signatures (...).
    """
    works = np.isfinite(command).all(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        thrust = np.log(force)
        style = np.log(command[..., 0]) - np.log(command[..., 1])
    strongest = np.where(works, force, 0.0).max(axis=-1, keepdims=True, initial=0.0)
    resting = works & (force < RESTING * strongest)
    pushes = works & ~resting & np.isfinite(thrust)
    return ModeSignature(resting, *np.where(pushes, (thrust, command[..., 2], style), np.nan))


def signature_difference(a: ModeSignature, b: ModeSignature) -> Array:
    """Returns how two signatures differ.

    Args:
        a: of commands (..., n, 3).
        b: of others.

    Returns:
        (3, ..., n): by how much `b` is turned, stronger and of another style; 1 is what counts as
        different, 0 where a fin rests in either.
    """
    turn = wrapped(b.direction - a.direction) / SAME_DIRECTION
    logarithms = np.array([b.thrust - a.thrust, b.style - a.style]) / SAME_SIZE
    return np.asarray(np.nan_to_num(np.concatenate([turn[None], logarithms])))


def same_signature(a: ModeSignature, b: ModeSignature) -> NDArray[np.bool_]:
    """Returns whether commands with these signatures are one mode, for one pair or many (...)."""
    alike = (np.abs(signature_difference(a, b)) < 1.0).all(axis=(0, -1))
    return np.asarray(alike & (a.resting == b.resting).all(axis=-1))
