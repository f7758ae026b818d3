"""Command to force to wrench, and what it costs: the fins' laws, the plant, power and effort."""

from finlab.actuators.fin.fin_laws import TableLaw as TableLaw
from finlab.actuators.fin.fin_laws import make_law as make_law
from finlab.actuators.fin.fin_laws import read_table as read_table
from finlab.actuators.fin.force_table_file import write_table as write_table
from finlab.actuators.law import FinLaw as FinLaw
from finlab.physics.plant import Plant as Plant
from finlab.physics.plant import plant_of as plant_of

__all__ = ["FinLaw", "Plant", "TableLaw", "make_law", "plant_of", "read_table", "write_table"]
