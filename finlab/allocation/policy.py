"""Policies: what to give for wrenches that a robot cannot deliver (Eqs. 12 to 15)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from finlab.axes import AXES, Axis, mask_of
from finlab.errors import CommandError

PolicyName = Literal["closest", "direction", "priority", "falling"]
"""`closest`: least weighted error. `direction`: the same direction, scaled down. `priority`: groups
of axes, each served as far as those before it allow. `falling`: least error with no axis given more
than was asked for, nor anything the other way."""
POLICY_NAMES: tuple[PolicyName, ...] = get_args(PolicyName)
"""Names of all policies."""


def check_order(groups: Any, argument: str) -> None:
    """Refuses what is no groups of axes.

    Args:
        groups: such as `(("Fz",), ("Tx", "Ty"))`.
        argument: what the groups were given as, with which the sentence begins.

    Raises:
        CommandError: they are no groups, or name what is no axis, or one twice.
    """
    if not isinstance(groups, Sequence) or any(isinstance(group, str) for group in groups):
        raise CommandError(
            f"{argument}: expected groups of axes such as (('Fz',), ('Tx', 'Ty')), got "
            f"{groups!r:.100}"
        )
    named = [axis for group in groups for axis in group]
    unknown = [axis for axis in named if axis not in AXES]
    if unknown:
        raise CommandError(
            f"{argument}: expected axes among {', '.join(AXES)}, got {unknown[0]!r:.60}"
        )
    if len(set(named)) < len(named):
        raise CommandError(f"{argument}: every axis may be named once, got {', '.join(named)}")


@dataclass(frozen=True)
class Policy:
    """One way to answer an unreachable wrench; reachable ones are delivered whole by all of
    them."""

    kind: PolicyName = "closest"
    """One of `POLICY_NAMES`."""
    axis_weights: tuple[float, ...] = (1.0,) * 6
    """For `closest`: weight of each axis of the normalized error."""
    order: tuple[tuple[Axis, ...], ...] = (("Fz",), ("Tx", "Ty", "Tz"), ("Fx", "Fy"))
    """For `priority`: groups of axes, most important first; axes that are not named come last."""
    falling: tuple[Axis, ...] = AXES
    """For `falling`: axes along which less may be given than was asked for, down to nothing, and
    never more; the others may go either way."""

    def __post_init__(self) -> None:
        if self.kind not in POLICY_NAMES:
            raise CommandError(
                f"policy: expected one of {', '.join(POLICY_NAMES)}, got {self.kind!r}"
            )
        try:
            weights = np.asarray(self.axis_weights, dtype=np.float64)
        except (TypeError, ValueError):
            weights = np.empty(0)
        if weights.shape != (6,) or not (
            np.isfinite(weights).all() and (weights >= 0).all() and weights.any()
        ):
            raise CommandError(
                f"axis_weights: expected six numbers from 0, not all 0, got {self.axis_weights}"
            )
        check_order(self.order, "order")
        check_order((self.falling,), "falling")

    @property
    def is_plain(self) -> bool:
        """Whether it asks for nothing but the least plain error, which every method minimizes."""
        return self.kind == "closest" and len(set(self.axis_weights)) == 1

    @property
    def groups(self) -> list[NDArray[np.bool_]]:
        """For `priority`: masks (6,) of the groups of axes in order; those that are not named come
        last. For `falling`: the mask of the axes that fall."""
        if self.kind == "falling":
            return [mask_of(self.falling)]
        unnamed = set(AXES)
        for group in self.order:
            unnamed -= set(group)
        last = tuple(axis for axis in AXES if axis in unnamed)
        return [mask_of(group) for group in (*self.order, last) if group]


CLOSEST = Policy()
"""The least plain error, the default: all axes weigh the same."""
_BY_NAME = {name: CLOSEST if name == CLOSEST.kind else Policy(name) for name in POLICY_NAMES}
"""Policies with their usual weights and order: a control loop names the same one in each tick."""


def as_policy(policy: Policy | PolicyName) -> Policy:
    """Returns a policy from its name, or itself. Raises CommandError: no policy is called so."""
    if isinstance(policy, Policy):
        return policy
    usual = _BY_NAME.get(policy) if isinstance(policy, str) else None
    return Policy(policy) if usual is None else usual


def policy_from(
    kind: str,
    axis_weights: Any = None,
    priority: Sequence[str] | None = None,
    falling: str | None = None,
) -> Policy:
    """Makes a policy as the command line names it.

    Args:
        kind: one of `POLICY_NAMES`.
        axis_weights: for `closest`: six weights; all 1 when None.
        priority: for `priority`: groups of axes joined by commas, such as `["Fz", "Tx,Ty"]`.
        falling: for `falling`: axes joined by commas; all when None.

    Returns:
        The policy.

    Raises:
        CommandError: one of them is not as it should be.
    """
    options: dict[str, Any] = {}
    if axis_weights is not None:
        options["axis_weights"] = tuple(float(w) for w in axis_weights)
    if priority:
        options["order"] = tuple(tuple(group.split(",")) for group in priority)
        check_order(options["order"], "priority")
    if falling:
        options["falling"] = tuple(falling.split(","))
    return Policy(cast("PolicyName", kind), **options)  # which checks it
