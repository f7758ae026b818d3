"""The ways in which a fin's force can be simulated, by name."""

from __future__ import annotations

from collections.abc import Callable

from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.sim.fin_force import FinForce, MeanForce, RippleForce
from finlab.sim.flexible_fin import FlexibleForce

PLANTS: dict[str, Callable[[Layout], FinForce]] = {
    "mean": MeanForce,
    "ripple": RippleForce,
    "flexible": FlexibleForce,
}
"""`mean`: the layout's fin law. `ripple`: the same within the cycle. `flexible`: fins with soft tips, other
physics than any method knows."""


def make_plant(name: str, layout: Layout) -> FinForce:
    """The fin force model called `name`.

    Raises:
        FinlabError: there is none of that name.
    """
    if name not in PLANTS:
        raise FinlabError(f"plant: expected one of {', '.join(PLANTS)}, got {name!r:.60}")
    return PLANTS[name](layout)
