"""The few targets that the first search did not reach: they are hard, or out of reach."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.prepared import Prepared
from finlab.allocation.learned.proposal import Proposal
from finlab.allocation.learned.refined_candidates import RANKING, RefinedCandidates, improve
from finlab.forces.force_space import PlanarProblem, polar, realize
from finlab.forces.nearest import nearest, wrench_of

Array = NDArray[Any]


@dataclass(frozen=True)
class MissedSettings:
    """How long targets are refined that the first search did not reach."""

    first_lm_steps: int = 5
    """Levenberg-Marquardt steps on the answers that are there, since most need only a few more."""
    nearest_lm_steps: int = 8
    """Steps from the nearest wrench that the fins can deliver: the start is off by as much as the surrogate's
    force differs from the planar model."""
    last_lm_steps: int = 25
    """Steps from fresh starts, which begin anywhere."""
    restarts: int = 32
    """Fresh starts for the very few that even so stay further away than they need to."""
    needless_error: float = 5e-4
    """Normalized error beyond what is proven to be needed that is not worth further starts."""
    needless_share: float = 2e-3
    """The same as a share of what is needed."""
    energy_lm_steps: int = 3
    """Steps after an inexact answer was made cheaper, which changes its error a little."""


MISSED = MissedSettings()
"""How long missed targets are refined."""

FallbackForces = Callable[[PlanarProblem, Array], Array | None]
"""From targets (R, 6) that were missed to planar forces (R, n, 2) [N] that come near them, or None."""


def nearest_forces(problem: PlanarProblem, target: Array) -> Array:
    """The forces (R, n, 2) whose wrench is nearest."""
    return nearest(problem.sets, target).force


def refine_missed(
    prepared: Prepared,
    target: Array,
    proposal: Proposal,
    candidates: RefinedCandidates,
    missed: NDArray[np.bool_],
    fallback: FallbackForces,
    settings: MissedSettings = MISSED,
) -> None:
    """Improve, in place, the answers to targets that were missed.

    Args:
        prepared: the layout.
        target: normalized wrenches (N, 6).
        proposal: the network's raw candidates.
        candidates: the answers so far.
        missed: which targets (N,) were missed.
        fallback: where to start from when more steps do not help; None from it ends the search.
        settings: how long to go on.
    """
    improve(prepared, target, candidates, missed, None, settings.first_lm_steps)
    missed = candidates.error[:, 0] > RANKING.exact_error
    if not missed.any():
        return
    force = fallback(prepared.planar, target[missed])
    if force is None:
        return
    needed = np.zeros(len(target))
    left = target[missed] - wrench_of(prepared.planar.columns, force)
    needed[missed] = np.linalg.norm(left, axis=-1)
    start, _ = realize(prepared.planar, polar(prepared.planar, force))
    improve(prepared, target, candidates, missed, start[:, None], settings.nearest_lm_steps)
    acceptable = settings.needless_error + (1.0 + settings.needless_share) * needed
    missed &= candidates.error[:, 0] > np.maximum(RANKING.exact_error, acceptable)
    if missed.any():
        fresh = _fresh_starts(prepared, proposal.command[missed], settings.restarts)
        improve(prepared, target, candidates, missed, fresh, settings.last_lm_steps)
    reduce_energy(prepared, target, candidates, settings.energy_lm_steps)


def reduce_energy(prepared: Prepared, target: Array, candidates: RefinedCandidates, lm_steps: int) -> None:
    """Give inexact answers, in place, the amplitudes and frequencies by which their forces cost least."""
    missed = candidates.error[:, 0] > RANKING.exact_error
    if missed.any():
        force = prepared.commands.fin.force(candidates.command[missed, 0])[..., 1:]
        cheap, _ = realize(prepared.planar, polar(prepared.planar, force))
        improve(prepared, target, candidates, missed, cheap[:, None], lm_steps)


def _fresh_starts(prepared: Prepared, proposed: Array, count: int) -> Array:
    """Commands (N, count, n, 3): raw candidates of the network and random ones, half and half."""
    raw = proposed[:, : count // 2].astype(np.float64)
    lower, upper = prepared.commands.lower, prepared.commands.upper
    unit = np.random.default_rng(0).random((count - raw.shape[1], len(lower), 3))
    spread = np.broadcast_to(lower + unit * (upper - lower), (len(proposed), *unit.shape))
    return np.concatenate([raw, spread], axis=1)
