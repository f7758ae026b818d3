"""What every allocation method answers: commands, what they give, and what is left undone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.modes import Mode, find_modes
from finlab.allocation.policy import describe_binding
from finlab.layout import Layout
from finlab.layout.arrays import layout_effectiveness
from finlab.physics.energy import command_energy

Array = NDArray[np.float64]

REACHED = 0.01
"""Normalized error up to which a wrench counts as delivered."""


class Candidates(NamedTuple):
    """Several commands for one target, best first. Failed fins hold NaN."""

    command: Array
    """Commands (K, n, 3): amplitude [rad], frequency [Hz], zero direction [rad]."""
    wrench: Array
    """Wrench (K, 6) that the method's own model expects [N, N m]."""
    err_norm: Array
    """Normalized error (K,) of that wrench."""
    energy: Array
    """Energy proxy (K,)."""
    source: tuple[str, ...]
    """Where each one comes from, in words."""


class Solution(NamedTuple):
    """What a method's solver returns for N targets on the n healthy fins of one layout."""

    command: Array
    """Chosen commands (N, n, 3)."""
    wrench_surrogate: Array | None = None
    """Wrench (N, 6) that the method itself believed, where it used a model of its own."""
    candidates: Callable[[], Candidates] | None = None
    """Gives the refined candidates, for a single target; made only when asked for."""
    samples: Callable[[], Candidates] | None = None
    """Gives the raw candidates before refinement, for a single target."""
    alternatives: Callable[[], Candidates] | None = None
    """Gives many refined answers to a single target, the chosen one first, by a wider search."""


@dataclass(frozen=True)
class Allocation:
    """The answer to one allocation problem; it can judge itself with the analytic fin model."""

    layout: Layout
    """The whole layout, failed fins included."""
    failed: tuple[str, ...]
    """Names of the fins that were left out."""
    target: Array
    """Desired wrench (6,), [N, N m], body frame."""
    command: Array
    """Command (n, 3) of every fin: amplitude [rad], frequency [Hz], zero direction [rad]; NaN if failed."""
    sigma: Array
    """Per-axis standard deviation (6,) of the error measure."""
    method: str
    """Name of the method that answered."""
    solve_ms: float
    """Time spent solving [ms], scoring by the plant not included."""
    checkpoint: str | None = None
    """Name of the checkpoint that was used, if any."""
    wrench_surrogate: Array | None = None
    """Wrench (6,) that the method itself expected, if it used a learned model."""
    notes: tuple[str, ...] = ()
    """Sentences that the user should read, such as a fin model that the checkpoint never saw."""
    make_candidates: Callable[[], Candidates | None] = field(default=lambda: None, repr=False, compare=False)
    """Gives `candidates` when they are first asked for."""
    make_samples: Callable[[], Candidates | None] = field(default=lambda: None, repr=False, compare=False)
    """Gives `samples` when they are first asked for."""

    make_alternatives: Callable[[], Candidates | None] = field(
        default=lambda: None, repr=False, compare=False
    )
    """Gives the alternatives among which `modes` are found."""
    previous: Array | None = field(default=None, repr=False, compare=False)
    """Command (n, 3) of the previous tick, if it was told."""

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """Distinct ways to deliver the wrench, the chosen one first; none for methods with a single answer.

        Found by a wider search when first asked for.
        """
        alternatives = self.make_alternatives() or self.candidates
        if alternatives is None:
            return ()
        return find_modes(alternatives, *self._limits, self.previous)

    @cached_property
    def candidates(self) -> Candidates | None:
        """Refined candidates, best first; None for methods that have a single answer."""
        return self.make_candidates()

    @cached_property
    def samples(self) -> Candidates | None:
        """Raw candidates before refinement, best first; None for methods that draw none."""
        return self.make_samples()

    @property
    def fins(self) -> tuple[str, ...]:
        """Names of the fins, in the order of `command`."""
        return self.layout.names

    @cached_property
    def fin_forces(self) -> Array:
        """Force of each fin (n, 3) in the body frame [N], by the analytic fin model."""
        from finlab.physics import Plant  # torch is loaded only where the plant is asked

        return Plant(self.layout).fin_forces(self.command)

    @cached_property
    def wrench(self) -> Array:
        """Delivered wrench (6,) by the analytic fin model [N, N m]."""
        force = self.fin_forces
        position = self.layout.position
        return np.concatenate([force.sum(0), np.cross(position, force).sum(0)])

    @property
    def unallocated(self) -> Array:
        """What the robot does not deliver: target minus delivered wrench (6,)."""
        return self.target - self.wrench

    @property
    def err_norm(self) -> float:
        """Normalized error of the delivered wrench, scored by the analytic fin model."""
        return float(np.linalg.norm(self.unallocated / self.sigma))

    @property
    def reachable(self) -> bool:
        """Whether the target is delivered, scored by the analytic fin model: err_norm of at most 0.01."""
        return self.err_norm <= REACHED

    @property
    def scale(self) -> float:
        """Share of the target that is delivered in its own direction; 1 where nothing is asked."""
        asked, given = self.target / self.sigma, self.wrench / self.sigma
        size = float(asked @ asked)
        return 1.0 if size < 1e-12 else float(asked @ given) / size

    @property
    def binding(self) -> tuple[str, ...]:
        """Sentences about the limits that keep the robot from delivering the target; none where it does."""
        if self.reachable:
            return ()
        missing = self.unallocated / self.sigma**2
        pull = (missing @ layout_effectiveness(self.layout)).reshape(-1, 2)
        return tuple(describe_binding(self.fins, self.command, *self._limits, pull))

    @property
    def _limits(self) -> tuple[Array, Array]:
        """Lower and upper limits (n, 3) of all fins."""
        limits = [fin.limits for fin in self.layout.fins]
        return np.array([limit.lower for limit in limits]), np.array([limit.upper for limit in limits])

    @cached_property
    def energy(self) -> float:
        """Energy proxy of the command."""
        return float(command_energy(self.command, self._limits[1]))


class BatchAllocation(NamedTuple):
    """Answers to N targets on one layout."""

    command: Array
    """Commands (N, n, 3), NaN for failed fins."""
    wrench_surrogate: Array | None
    """Wrenches (N, 6) that the method itself expected, if it used a learned model."""
    solve_ms: Array
    """Time per target (N,) [ms]; the whole time divided by N where targets were solved together."""
