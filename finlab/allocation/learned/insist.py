"""The few targets that the quick way did not reach: they are hard, or out of reach."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.pool import TOLERANCE, Pool, improve
from finlab.allocation.learned.prepared import Prepared
from finlab.allocation.learned.proposal import Proposal
from finlab.forces.force_space import PlanarProblem, polar, realize
from finlab.forces.nearest import nearest, wrench_of

Array = NDArray[Any]

FIRST_PATIENCE, NEAREST_PATIENCE, LAST_PATIENCE = 5, 8, 25
"""Levenberg-Marquardt steps for the few targets that the quick way did not reach: at once, from the
nearest wrench that the fins can deliver, and from fresh starts."""
RESTARTS = 32
"""Fresh starts for the very few that even so stay further away than they need to."""
NEEDLESS = (5e-4, 2e-3)
"""Normalized error beyond what is proven to be needed that is not worth further starts: a constant and a
share."""
SPARING_STEPS = 3
"""Levenberg-Marquardt steps after an inexact answer was made cheaper."""

Lead = Callable[[PlanarProblem, Array], Array | None]
"""From targets (R, 6) that were missed to planar forces (R, n, 2) [N] that come near them, or None."""


def nearest_forces(problem: PlanarProblem, target: Array) -> Array:
    """The forces (R, n, 2) whose wrench is nearest."""
    return nearest(problem, target).force


def insist(
    prepared: Prepared,
    target: Array,
    proposal: Proposal,
    pool: Pool,
    missed: NDArray[np.bool_],
    lead: Lead,
) -> None:
    """Improve, in place, the answers to targets that were missed: they are hard, or out of reach."""
    improve(prepared, target, pool, missed, None, FIRST_PATIENCE)
    missed = pool.error[:, 0] > TOLERANCE
    if not missed.any():
        return
    force = lead(prepared.planar, target[missed])
    if force is None:
        return
    needed = np.zeros(len(target))
    left = target[missed] - wrench_of(prepared.planar.columns, force)
    needed[missed] = np.linalg.norm(left, axis=-1)
    start, _ = realize(prepared.planar, polar(prepared.planar, force))
    improve(prepared, target, pool, missed, start[:, None], NEAREST_PATIENCE)
    missed &= pool.error[:, 0] > np.maximum(TOLERANCE, NEEDLESS[0] + (1.0 + NEEDLESS[1]) * needed)
    if missed.any():
        fresh = _fresh_starts(prepared, proposal.command[missed], RESTARTS)
        improve(prepared, target, pool, missed, fresh, LAST_PATIENCE)
    _spare(prepared, target, pool)


def _spare(prepared: Prepared, target: Array, pool: Pool) -> None:
    """Give inexact answers, in place, the amplitudes and frequencies by which their forces cost least."""
    missed = pool.error[:, 0] > TOLERANCE
    if missed.any():
        force = prepared.commands.fin.force(pool.command[missed, 0])[..., 1:]
        cheap, _ = realize(prepared.planar, polar(prepared.planar, force))
        improve(prepared, target, pool, missed, cheap[:, None], SPARING_STEPS)


def _fresh_starts(prepared: Prepared, proposed: Array, count: int) -> Array:
    """Commands (N, count, n, 3): raw candidates of the network and random ones, half and half."""
    raw = proposed[:, : count // 2].astype(np.float64)
    lower, upper = prepared.commands.lower, prepared.commands.upper
    unit = np.random.default_rng(0).random((count - raw.shape[1], len(lower), 3))
    spread = np.broadcast_to(lower + unit * (upper - lower), (len(proposed), *unit.shape))
    return np.concatenate([raw, spread], axis=1)
