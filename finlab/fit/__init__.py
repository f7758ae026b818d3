"""From measurements to models: fins, thrusters, and in `robot` a layout from swims.

Nothing here uses what `finlab.swim.simulation` knows to be true; fits come from data alone.
"""

from finlab.fit.fin_fit import FinFit, fit_fin, write_fin
from finlab.fit.measurements import Measurements, read_measurements

__all__ = ["FinFit", "Measurements", "fit_fin", "read_measurements", "write_fin"]
