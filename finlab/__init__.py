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
    from finlab.layout import PropellerRudder as PropellerRudder
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
    "PropellerRudder",
    "Rudder",
    "Thruster",
    "Tilt",
    "load_layout",
    "save_layout",
]

_MODULE_OF_NAME = {
    "Allocation": "finlab.allocation.allocation",
    "Allocator": "finlab.allocation.allocator",
    "Azimuth": "finlab.layout",
    "Body": "finlab.layout",
    "Damage": "finlab.layout",
    "Fin": "finlab.layout",
    "FinlabError": "finlab.errors",
    "Layout": "finlab.layout",
    "Limits": "finlab.layout",
    "Policy": "finlab.allocation.policy",
    "PowerLaw": "finlab.actuators.thrust_model",
    "PowerTable": "finlab.actuators.thrust_model",
    "PropellerRudder": "finlab.layout",
    "Rudder": "finlab.layout",
    "Thruster": "finlab.layout",
    "Tilt": "finlab.layout",
    "load_layout": "finlab.layout",
    "save_layout": "finlab.layout",
}
"""Public name -> the module that has it, which is imported when the name is first used."""


def __getattr__(name: str) -> object:
    """Imports a public name on first use (PEP 562)."""
    if name not in _MODULE_OF_NAME:
        known = ", ".join(sorted(_MODULE_OF_NAME))
        raise AttributeError(f"module 'finlab' has no attribute {name!r}; it has {known}")
    return resolve_name(f"{_MODULE_OF_NAME[name]}:{name}")


def __dir__() -> list[str]:
    """Lists public names that have not been imported yet, too, for completion."""
    return sorted([*globals(), *_MODULE_OF_NAME])
