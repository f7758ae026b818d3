"""What a layout may hold: every type of actuator, as one type."""

from finlab.layout.azimuth import Azimuth
from finlab.layout.fin import Fin
from finlab.layout.rudder import Rudder
from finlab.layout.thruster import Thruster

Actuator = Fin | Thruster | Azimuth | Rudder
"""An actuator of a robot: `name`, `type`, `position` [m], `frame` (3 x 3, rows in the body frame), and
`lower` and `upper`, the limits of its command (3,)."""
