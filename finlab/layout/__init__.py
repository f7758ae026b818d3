"""Description of a robot: actuators, limits and body, as frozen values, files and padded arrays.

Names are imported on first use: a robot of fins needs no rudders.
"""

from pkgutil import resolve_name
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from finlab.actuators.actuator import Actuator as Actuator
    from finlab.actuators.actuator import Uncertainty as Uncertainty
    from finlab.actuators.azimuth import Azimuth as Azimuth
    from finlab.actuators.azimuth import Tilt as Tilt
    from finlab.actuators.fin.fin import Fin as Fin
    from finlab.actuators.fin.fin import Servo as Servo
    from finlab.actuators.fin.fin_model import FinModelSpec as FinModelSpec
    from finlab.actuators.fin.fin_model import Limits as Limits
    from finlab.actuators.propeller_rudder import PropellerRudder as PropellerRudder
    from finlab.actuators.rudder import Rudder as Rudder
    from finlab.actuators.thruster import Thruster as Thruster
    from finlab.layout.body import Body as Body
    from finlab.layout.body import Hull as Hull
    from finlab.layout.clear_sectors import kept_clear as kept_clear
    from finlab.layout.damage import Damage as Damage
    from finlab.layout.effectiveness import layout_effectiveness as layout_effectiveness
    from finlab.layout.effectiveness import own_effectiveness as own_effectiveness
    from finlab.layout.layout import MAX_ACTUATORS as MAX_ACTUATORS
    from finlab.layout.layout import Layout as Layout
    from finlab.layout.load import load_layout as load_layout
    from finlab.layout.load import parse_layout as parse_layout
    from finlab.layout.save import layout_to_dict as layout_to_dict
    from finlab.layout.save import save_layout as save_layout

__all__ = [
    "MAX_ACTUATORS",
    "Actuator",
    "Azimuth",
    "Body",
    "Damage",
    "Fin",
    "FinModelSpec",
    "Hull",
    "Layout",
    "Limits",
    "PropellerRudder",
    "Rudder",
    "Servo",
    "Thruster",
    "Tilt",
    "Uncertainty",
    "kept_clear",
    "layout_effectiveness",
    "layout_to_dict",
    "load_layout",
    "own_effectiveness",
    "parse_layout",
    "save_layout",
]

_MODULE_OF_NAME = {
    "Actuator": "finlab.actuators.actuator",
    "Uncertainty": "finlab.actuators.actuator",
    "Azimuth": "finlab.actuators.azimuth",
    "Tilt": "finlab.actuators.azimuth",
    "Fin": "finlab.actuators.fin.fin",
    "Servo": "finlab.actuators.fin.fin",
    "FinModelSpec": "finlab.actuators.fin.fin_model",
    "Limits": "finlab.actuators.fin.fin_model",
    "PropellerRudder": "finlab.actuators.propeller_rudder",
    "Rudder": "finlab.actuators.rudder",
    "Thruster": "finlab.actuators.thruster",
    "Body": "finlab.layout.body",
    "Hull": "finlab.layout.body",
    "kept_clear": "finlab.layout.clear_sectors",
    "Damage": "finlab.layout.damage",
    "layout_effectiveness": "finlab.layout.effectiveness",
    "own_effectiveness": "finlab.layout.effectiveness",
    "parse_layout": "finlab.layout.load",
    "MAX_ACTUATORS": "finlab.layout.layout",
    "Layout": "finlab.layout.layout",
    "load_layout": "finlab.layout.load",
    "layout_to_dict": "finlab.layout.save",
    "save_layout": "finlab.layout.save",
}
"""Public name -> the module that defines it, which is imported when the name is first used."""


def __getattr__(name: str) -> object:
    """Imports a public name on first use (PEP 562)."""
    if name not in _MODULE_OF_NAME:
        raise AttributeError(f"module 'finlab.layout' has no attribute {name!r}")
    return resolve_name(f"{_MODULE_OF_NAME[name]}:{name}")
