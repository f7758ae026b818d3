"""What to do when a robot cannot deliver the wrench it is asked for."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import CommandError
from finlab.layout.angles import is_full_turn

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
"""The wrench's axes, in order."""
KINDS = ("closest", "direction", "priority")
"""`closest`: least weighted error. `direction`: the same direction, scaled down. `priority`: groups of axes,
each served as far as those before it allow."""


@dataclass(frozen=True)
class Policy:
    """One way to answer an unreachable wrench; reachable ones are delivered whole by all of them."""

    kind: str = "closest"
    """One of `KINDS`."""
    axis_weights: tuple[float, ...] = (1.0,) * 6
    """For `closest`: weight of each axis of the normalized error."""
    order: tuple[tuple[str, ...], ...] = (("Fz",), ("Tx", "Ty", "Tz"), ("Fx", "Fy"))
    """For `priority`: groups of axes, most important first; axes that are not named come last."""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise CommandError(f"policy: expected one of {', '.join(KINDS)}, got {self.kind!r}")
        try:
            weights = np.asarray(self.axis_weights, dtype=np.float64)
        except (TypeError, ValueError):
            weights = np.empty(0)
        if weights.shape != (6,) or not (
            np.isfinite(weights).all() and (weights >= 0).all() and weights.any()
        ):
            raise CommandError(
                f"axis weights: expected six numbers from 0, not all 0, got {self.axis_weights}"
            )
        if not isinstance(self.order, Sequence) or any(isinstance(g, str) for g in self.order):
            raise CommandError(
                f"priority: expected groups of axes such as (('Fz',), ('Tx', 'Ty')), got {self.order}"
            )
        named = [axis for group in self.order for axis in group]
        if unknown := [axis for axis in named if axis not in AXES]:
            raise CommandError(f"priority: expected axes among {', '.join(AXES)}, got {unknown[0]!r}")
        if len(set(named)) < len(named):
            raise CommandError(f"priority: every axis may be named once, got {', '.join(named)}")

    @property
    def is_plain(self) -> bool:
        """Whether it asks for nothing but the least plain error, which every method minimizes."""
        return self.kind == "closest" and len(set(self.axis_weights)) == 1

    @property
    def groups(self) -> list[NDArray[np.bool_]]:
        """For `priority`: masks (6,) of the groups of axes in order; those that are not named come last."""
        named = {axis for group in self.order for axis in group}
        rest = tuple(axis for axis in AXES if axis not in named)
        groups = (*self.order, *((rest,) if rest else ()))
        return [np.array([axis in group for axis in AXES]) for group in groups if group]


CLOSEST = Policy()
"""The default."""


def as_policy(policy: Policy | str) -> Policy:
    """A policy from its name."""
    return policy if isinstance(policy, Policy) else Policy(policy)


def describe_binding(
    names: Sequence[str], command: Array, lower: Array, upper: Array, pull: Array
) -> list[str]:
    """Sentences about the limits that keep a robot from delivering what is missing.

    Args:
        names: the fins.
        command: (n, 3), NaN for a failed fin.
        lower: lower limits (n, 3).
        upper: upper limits (n, 3).
        pull: where each fin would have to push (n, 2), in its thrust plane, to lessen what is missing.
    """
    tolerance = 1e-3 * (upper - lower) + 1e-9
    at_low, at_high = command <= lower + tolerance, command >= upper - tolerance
    wanted = np.arctan2(pull[:, 1], pull[:, 0])
    sentences = []
    for i, name in enumerate(names):
        if np.isnan(command[i]).any():
            continue
        rests = at_low[i, 0] and at_low[i, 1]
        if at_high[i, 0] and at_high[i, 1]:
            sentences.append(f"{name} at full thrust")
        if is_full_turn(upper[i, 2] - lower[i, 2]):
            continue
        middle, half = 0.5 * (lower[i, 2] + upper[i, 2]), 0.5 * (upper[i, 2] - lower[i, 2])
        outside = abs((wanted[i] - middle + np.pi) % (2 * np.pi) - np.pi) > half
        if rests and outside:
            sentences.append(f"{name} cannot point where it is needed")
        elif not rests and outside and (at_low[i, 2] or at_high[i, 2]):
            sentences.append(f"{name} at the end of its arc")
    return sentences


def policy_from(kind: str, axis_weights: Any = None, priority: Sequence[str] | None = None) -> Policy:
    """A policy as the command line names it: groups of `priority` are axes joined by commas."""
    options: dict[str, Any] = {}
    if axis_weights is not None:
        options["axis_weights"] = tuple(float(w) for w in axis_weights)
    if priority:
        options["order"] = tuple(tuple(group.split(",")) for group in priority)
    return Policy(kind, **options)
