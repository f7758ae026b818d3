"""Control allocation for underwater robots with fins, thrusters, azimuths and rudders, in any
layout.

A layout says where the actuators of a robot sit. A wrench says what the body should feel. An
allocator turns both into one command per actuator:

    layout = finlab.load_layout("A")
    result = finlab.Allocator(layout).allocate([1, 0, 0.5, 0, 0, 0.1])

Names are imported on first use, so that `import finlab` needs neither torch nor the time to load
it.
"""

from pkgutil import resolve_name
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from finlab.actuators.thrust_model import PowerLaw as PowerLaw
    from finlab.actuators.thrust_model import PowerTable as PowerTable
    from finlab.allocation.allocation import Allocation as Allocation
    from finlab.allocation.allocator import Allocator as Allocator
    from finlab.allocation.policy import Policy as Policy
    from finlab.errors import FinlabError as FinlabError
    from finlab.layout import Azimuth as Azimuth
    from finlab.layout import Body as Body
    from finlab.layout import Damage as Damage
    from finlab.layout import Fin as Fin
    from finlab.layout import Layout as Layout
    from finlab.layout import Limits as Limits
    from finlab.layout import Rudder as Rudder
    from finlab.layout import Thruster as Thruster
    from finlab.layout import Tilt as Tilt
    from finlab.layout import load_layout as load_layout
    from finlab.layout import save_layout as save_layout

__version__ = "0.1.0"

__all__ = [
    "Allocation",
    "Allocator",
    "Azimuth",
    "Body",
    "Damage",
    "Fin",
    "FinlabError",
    "Layout",
    "Limits",
    "Policy",
    "PowerLaw",
    "PowerTable",
    "Rudder",
    "Thruster",
    "Tilt",
    "load_layout",
    "save_layout",
]

_KINDS = ("Fin", "Thruster", "Azimuth", "Tilt", "Rudder")
_OF_LAYOUTS = (*_KINDS, "Body", "Damage", "Layout", "Limits", "load_layout", "save_layout")
_HOME = dict.fromkeys(_OF_LAYOUTS, "finlab.layout") | {
    "PowerLaw": "finlab.actuators.thrust_model",
    "PowerTable": "finlab.actuators.thrust_model",
    "Allocation": "finlab.allocation.allocation",
    "Allocator": "finlab.allocation.allocator",
    "Policy": "finlab.allocation.policy",
    "FinlabError": "finlab.errors",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(
            f"module 'finlab' has no attribute {name!r}; it has {', '.join(sorted(_HOME))}"
        )
    return resolve_name(f"{_HOME[name]}:{name}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
