"""Description of a robot: actuators, limits and body, as frozen values, files and padded arrays."""

from finlab.actuators.actuator import Actuator as Actuator
from finlab.actuators.actuator import Uncertainty as Uncertainty
from finlab.actuators.azimuth import Azimuth as Azimuth
from finlab.actuators.azimuth import Tilt as Tilt
from finlab.actuators.fin.fin import Fin as Fin
from finlab.actuators.fin.fin import Servo as Servo
from finlab.actuators.fin.fin_model import FinModelSpec as FinModelSpec
from finlab.actuators.fin.fin_model import Limits as Limits
from finlab.actuators.rudder import Rudder as Rudder
from finlab.actuators.thruster import Thruster as Thruster
from finlab.layout.body import Body as Body
from finlab.layout.body import Hull as Hull
from finlab.layout.damage import Damage as Damage
from finlab.layout.effectiveness import layout_effectiveness as layout_effectiveness
from finlab.layout.effectiveness import own_effectiveness as own_effectiveness
from finlab.layout.file import layout_to_dict as layout_to_dict
from finlab.layout.file import parse_layout as parse_layout
from finlab.layout.file import save_layout as save_layout
from finlab.layout.layout import MAX_ACTUATORS as MAX_ACTUATORS
from finlab.layout.layout import Layout as Layout
from finlab.layout.load import load_layout as load_layout
from finlab.layout.random_layouts import random_layout as random_layout

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
    "Rudder",
    "Servo",
    "Thruster",
    "Tilt",
    "Uncertainty",
    "layout_effectiveness",
    "layout_to_dict",
    "load_layout",
    "own_effectiveness",
    "parse_layout",
    "random_layout",
    "save_layout",
]
