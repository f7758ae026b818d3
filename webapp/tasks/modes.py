"""The distinct ways in which fins can deliver a wrench: commands that do the same are one mode.

A fin that hardly pushes counts as resting, whatever its command is. Two commands are the same mode
if the same fins rest and all others push about as hard in about the same direction, angles compared
the shorter way round. The solver of the app groups the candidates of a network by it.
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
"""Share of the strongest fin's thrust below which a fin does not push at all."""
SAME_DIRECTION = float(np.radians(25.0))
"""Zero directions closer than this are the same [rad]."""
SAME_SIZE = 0.25
"""Thrusts, and ratios of amplitude to frequency, whose logarithms differ by less are the same."""
LEAST_SPAN = 1e-9
"""Span that a limited command is taken to have at least, for shares of it."""
FIN_RANGES = slice(0, 2)
"""Numbers of a fin's command that have a range to use: amplitude and frequency."""
LEAST_THRUST = 1e-9
"""What full thrust counts as at least [N], for shares of it."""


class ModeSignature(NamedTuple):
    """What tells the commands of a mode from those of another: numbers per fin (..., n), NaN where
    the fin rests or is lost."""

    resting: NDArray[np.bool_]
    """Fins that rest."""
    thrust: Array
    """Logarithm of the force [N]."""
    direction: Array
    """Zero direction [rad]."""
    style: Array
    """Logarithm of amplitude over frequency."""

    def row(self, index: Any) -> "ModeSignature":
        """The signature of one of many commands, or of some, by their indices."""
        return ModeSignature(
            self.resting[index], self.thrust[index], self.direction[index], self.style[index]
        )


@dataclass(frozen=True, eq=False)
class Mode(PlainData):
    """One way to deliver the wrench: the best of the candidates that do the same."""

    command: Array
    """(n, 3): amplitude [rad], frequency [Hz], zero direction [rad]; NaN for lost fins."""
    err_norm: float
    """Normalized error of its wrench."""
    effort: float
    """Effort `J_en`, the paper's energy proxy."""
    power: float
    """Mean mechanical power [W]."""
    saturation: float
    """Largest share that an actuator uses, see `largest_used_share`; 1 is a limit."""
    still: tuple[int, ...]
    """Indices of the fins that do not push, by their own laws; others of `resting` hardly do."""
    signature: ModeSignature
    """What distinguishes it from other modes."""
    sources: tuple[str, ...]
    """Where its candidates come from, in words, each once."""

    @property
    def resting(self) -> tuple[int, ...]:
        """Indices of the fins that hardly push, by their own laws."""
        return tuple(np.flatnonzero(self.signature.resting).tolist())


def find_modes(
    candidates: Candidates, force: Array, lower: Array, upper: Array
) -> tuple[Mode, ...]:
    """Groups candidates by what they do.

    Args:
        candidates: K of them, best first.
        force: size of each fin's force (K, n) [N], see `force_sizes`.
        lower: lower limits (n, 3) of commands.
        upper: upper limits (n, 3).

    Returns:
        The modes, in the order of their best candidates.
    """
    modes = []
    span = np.maximum(upper - lower, LEAST_SPAN)
    signatures = mode_signature(candidates.command, force)
    for members in cluster(signatures):
        first = members[0]
        command = candidates.command[first]
        used = (command - lower) / span
        size = force[first]
        mode = Mode(
            command=command,
            err_norm=float(candidates.err_norm[first]),
            effort=float(candidates.effort[first]),
            power=float(candidates.power[first]),
            saturation=float(np.clip(np.nanmax(used[:, FIN_RANGES]), 0.0, 1.0)),
            still=tuple(np.flatnonzero(size < STILL * size.max()).tolist()),
            signature=signatures.row(first),
            sources=tuple(dict.fromkeys(map(candidates.source.__getitem__, members))),
        )
        modes.append(mode)
    return tuple(modes)


def largest_used_share(layout: Layout, command: Array, size: Array, full_thrust: Array) -> float:
    """Returns the largest share that an actuator uses: a fin of its range of amplitude or
    frequency, another one of its full thrust.

    Args:
        layout: the robot of n actuators.
        command: (n, 3), NaN for lost ones.
        size: of each force (n,) [N].
        full_thrust: largest force (n,) of each [N].
    """
    span = np.maximum(layout.upper - layout.lower, LEAST_SPAN)
    range_shares = ((command - layout.lower) / span)[:, FIN_RANGES].max(axis=1)
    thrust_shares = size / np.maximum(full_thrust, LEAST_THRUST)
    shares = np.where(layout.is_fin, range_shares, thrust_shares)
    return float(np.clip(np.nanmax(shares), 0.0, 1.0))


def cluster(signatures: ModeSignature) -> list[list[int]]:
    """Groups K signatures that are the same.

    Returns:
        Indices of the members of each group, led by the first that was in no group before.
    """
    groups: list[list[int]] = []
    is_free = np.ones(len(signatures.thrust), bool)
    while is_free.any():
        first = int(is_free.argmax())
        is_member = is_free & same_signature(signatures.row(first), signatures)
        is_member[first] = True
        groups.append(np.flatnonzero(is_member).tolist())
        is_free &= ~is_member
    return groups


def force_sizes(layout: Layout, command: Array) -> Array:
    """Size of each fin's force (..., n) [N] by its own law for commands (..., n, 3), zero for lost
    fins."""
    return np.asarray(np.linalg.norm(plant_of(layout).forces(command), axis=-1))


def mode_signature(command: Array, force: Array) -> ModeSignature:
    """Signatures of commands (..., n, 3) whose forces have sizes (..., n) [N]."""
    is_working = np.isfinite(command).all(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        thrust = np.log(force)
        style = np.log(command[..., 0]) - np.log(command[..., 1])
    strongest = np.where(is_working, force, 0.0).max(axis=-1, keepdims=True, initial=0.0)
    is_resting = is_working & (force < RESTING * strongest)
    is_pushing = is_working & ~is_resting & np.isfinite(thrust)
    return ModeSignature(
        resting=is_resting,
        thrust=np.where(is_pushing, thrust, np.nan),
        direction=np.where(is_pushing, command[..., 2], np.nan),
        style=np.where(is_pushing, style, np.nan),
    )


def signature_difference(a: ModeSignature, b: ModeSignature) -> Array:
    """How `b` differs from `a` (3, ..., n) in direction, thrust and style; 1 is what counts as
    different."""
    direction = wrapped(b.direction - a.direction) / SAME_DIRECTION
    thrust = (b.thrust - a.thrust) / SAME_SIZE
    style = (b.style - a.style) / SAME_SIZE
    return np.asarray(np.nan_to_num(np.stack([direction, thrust, style])))


def same_signature(a: ModeSignature, b: ModeSignature) -> NDArray[np.bool_]:
    """Whether commands with these signatures are one mode, for one pair or many (...)."""
    is_alike = (np.abs(signature_difference(a, b)) < 1.0).all(axis=(0, -1))
    return np.asarray(is_alike & (a.resting == b.resting).all(axis=-1))
