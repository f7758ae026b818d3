"""What every allocation method answers: commands, what they give, and what is left undone."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.evaluate import REACHED, Judge, evaluate
from finlab.allocation.policy import CLOSEST, Policy, describe_binding
from finlab.allocation.solution import Candidates, PlainData
from finlab.allocation.tables import allocation_html, allocation_text
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.arrays import layout_effectiveness


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer(PlainData):
    """What answers to one target and to many share, as plain data; many have N rows of each array."""

    layout: Layout
    """The whole layout, failed fins included, with the limits that damage has left."""
    failed: tuple[str, ...]
    """Names of the fins that were left out."""
    target: Array
    """Desired wrench (6,) or (N, 6), [N, N m], body frame."""
    command: Array
    """Command (n, 3) or (N, n, 3) of every fin: amplitude [rad], frequency [Hz], zero direction [rad]; NaN if
    failed."""
    fin_forces: Array
    """Force (n, 3) or (N, n, 3) that the judge finds for each fin [N], body frame; zero if failed."""
    wrench: Array
    """Delivered wrench (6,) or (N, 6) as the judge finds it [N, N m]."""
    sigma: Array
    """Per-axis standard deviation (6,) of the error measure."""
    evaluated_by: Judge
    """Who computed `fin_forces` and `wrench`: the plant, that is the fins' own laws and tables."""
    method: str
    """Name of the method that answered."""
    checkpoint: str | None = None
    """Name of the checkpoint that was used, if any."""
    policy: Policy = CLOSEST
    """What was to be done if a target was out of reach."""
    seed: int = 0
    """Seed that makes the answer repeatable."""
    flow: Array | None = None
    """Velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at rest."""
    wrench_surrogate: Array | None = None
    """Wrench (6,) or (N, 6) that the method itself expected, if it used a learned model."""
    unknown_fins: tuple[str, ...] = ()
    """Names of fins whose model the method's networks have not learned; answers for them are wrong."""
    notes: tuple[str, ...] = ()
    """Sentences that the user should read, such as a fin model that the checkpoint never saw."""

    @property
    def fins(self) -> tuple[str, ...]:
        """Names of the fins, in the order of `command`."""
        return self.layout.names

    @property
    def unallocated(self) -> Array:
        """What the robot does not deliver: target minus delivered wrench (6,) or (N, 6)."""
        return self.target - self.wrench


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class BatchAllocation(Answer):
    """Answers to N targets on one layout: plain data, as an `Allocation` is."""

    err_norm: Array
    """Sizes (N,) of what is missing from the targets, each axis over its `sigma`."""
    effort: Array
    """Effort `J_en` (N,) of the commands, the paper's energy proxy."""
    power: Array
    """Mean mechanical power (N,) [W] of the commands, by the fins' own models."""
    solve_ms: Array = field(compare=False)
    """Time per target (N,) [ms]; the whole time divided by N where targets were solved together."""

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """Which targets are delivered (N,): an `err_norm` of at most 0.01."""
        return self.err_norm <= REACHED

    def __len__(self) -> int:
        return len(self.target)

    def __repr__(self) -> str:
        worst = f"{self.err_norm.max():.2e}" if len(self) else "none"
        return (
            f"BatchAllocation({len(self)} targets, layout={self.layout.name!r:.60}, fins={len(self.fins)}, "
            f"method={self.method!r}, delivered={int(self.reachable.sum())}, "
            f"largest err_norm={worst} by the {self.evaluated_by})"
        )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Allocation(Answer):
    """The answer to one allocation problem, as plain data: it can be compared, copied, pickled and printed.

    `print(result)` shows it as a table.
    """

    err_norm: float
    """Size of what is missing from the target, each axis over its `sigma`."""
    effort: float
    """Effort `J_en` of the command, the paper's energy proxy."""
    power: float
    """Mean mechanical power [W] of the command, by the fins' own models."""
    solve_ms: float = field(compare=False)
    """Time spent solving [ms], judging not included."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the method, by name."""
    previous: Array | None = None
    """Command (n, 3) of the previous tick, if it was given."""
    candidates: Candidates | None = None
    """Refined candidates, best first; None for methods that have a single answer."""
    samples: Candidates | None = None
    """Raw candidates before refinement, best first; None for methods that draw none."""

    @property
    def reachable(self) -> bool:
        """Whether the target is delivered: an `err_norm` of at most 0.01."""
        return self.err_norm <= REACHED

    @property
    def scale(self) -> float:
        """Share of the target that is delivered in its own direction; 1 where nothing is asked."""
        asked, given = self.target / self.sigma, self.wrench / self.sigma
        size = float(asked @ asked)
        return 1.0 if size < 1e-12 else float(asked @ given) / size

    @property
    def binding(self) -> tuple[str, ...]:
        """Sentences about the limits that keep the robot from delivering the target.

        None where it does, nor where the method does not know the fins: then limits are not what keeps it.
        """
        if self.reachable or self.unknown_fins:
            return ()
        missing = self.unallocated / self.sigma**2
        pull = (missing @ layout_effectiveness(self.layout)).reshape(-1, 2)
        return tuple(describe_binding(self.fins, self.command, self.layout.lower, self.layout.upper, pull))

    def with_command(self, command: Array) -> "Allocation":
        """The same question with another command (n, 3) in place of the answer, judged by the plant."""
        verdict = evaluate(self.layout, command[None], self.target[None], self.sigma, self.flow)
        return replace(
            self,
            command=command,
            fin_forces=verdict.fin_forces[0],
            wrench=verdict.wrench[0],
            err_norm=float(verdict.err_norm[0]),
            effort=float(verdict.effort[0]),
            power=float(verdict.power[0]),
            evaluated_by="plant",
            wrench_surrogate=None,
        )

    def __repr__(self) -> str:
        failed = f", failed={', '.join(self.failed)!r:.60}" if self.failed else ""
        return (
            f"Allocation(layout={self.layout.name!r:.60}, fins={len(self.fins)}{failed}, "
            f"method={self.method!r}, err_norm={self.err_norm:.2e} by the {self.evaluated_by}, "
            f"power={self.power:.3g} W, effort={self.effort:.3f}, reachable={self.reachable}, "
            f"solve_ms={self.solve_ms:.1f})"
        )

    def __str__(self) -> str:
        return allocation_text(self)

    def _repr_html_(self) -> str:
        """The table of the command line, for notebooks."""
        return allocation_html(self)
