"""What fins may really do while a robot swims, by name: the truth that methods and fits are held against."""

from collections.abc import Callable

from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.sim.fin_force import FinForce, FlexibleForce, MeanForce, RippleForce
from finlab.sim.inflow import InflowForce
from finlab.sim.offset import OffsetForce
from finlab.sim.wake import WakeForce

PLANTS: dict[str, Callable[[Layout], FinForce]] = {
    "mean": MeanForce,
    "ripple": RippleForce,
    "flexible": FlexibleForce,
    "wake": WakeForce,
    "inflow": InflowForce,
    "offset": OffsetForce,
}
"""`mean`: the layout's fin law. `ripple`: the same within the cycle. The others are what no layout says:
`flexible`, fins with soft tips; `wake`, fins in each other's jets; `inflow`, thrust that falls with speed;
`offset`, a robot that is not built as drawn."""


def make_plant(name: str, layout: Layout) -> FinForce:
    """The fin force model called `name`; a `FinlabError` where there is none."""
    if name not in PLANTS:
        raise FinlabError(f"plant: expected one of {', '.join(PLANTS)}, got {name!r:.60}")
    return PLANTS[name](layout)
