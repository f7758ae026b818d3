"""Description of a robot: actuators, limits and body, as frozen values, files and padded arrays."""

from finlab.layout.body import Body as Body
from finlab.layout.body import Hull as Hull
from finlab.layout.commanded import Uncertainty as Uncertainty
from finlab.layout.damage import Damage as Damage
from finlab.layout.damage import Health as Health
from finlab.layout.effectiveness import layout_effectiveness as layout_effectiveness
from finlab.layout.effectiveness import own_effectiveness as own_effectiveness
from finlab.layout.file import layout_to_dict as layout_to_dict
from finlab.layout.file import parse_layout as parse_layout
from finlab.layout.file import save_layout as save_layout
from finlab.layout.fin import Fin as Fin
from finlab.layout.fin import Limits as Limits
from finlab.layout.fin import Servo as Servo
from finlab.layout.fin_model import FinModelSpec as FinModelSpec
from finlab.layout.layout import MAX_ACTUATORS as MAX_ACTUATORS
from finlab.layout.layout import Actuator as Actuator
from finlab.layout.layout import Layout as Layout
from finlab.layout.load import load_layout as load_layout
from finlab.layout.propellers import Azimuth as Azimuth
from finlab.layout.propellers import Thruster as Thruster
from finlab.layout.propellers import Tilt as Tilt
from finlab.layout.random_layouts import random_layout as random_layout
from finlab.layout.rudder import Rudder as Rudder
