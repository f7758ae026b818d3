"""Command to force to wrench, and what it costs: the fins' laws, the plant, power and effort.

Names are imported on first use.
"""

from pkgutil import resolve_name
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from finlab.actuators.fin.fin_laws import make_law as make_law
    from finlab.actuators.fin.force_table_file import write_table as write_table
    from finlab.actuators.fin.table_law import TableLaw as TableLaw
    from finlab.actuators.fin.table_law import read_table as read_table
    from finlab.actuators.law import FinLaw as FinLaw
    from finlab.physics.plant import Plant as Plant
    from finlab.physics.plant import plant_of as plant_of

__all__ = ["FinLaw", "Plant", "TableLaw", "make_law", "plant_of", "read_table", "write_table"]

_MODULE_OF_NAME = {
    "make_law": "finlab.actuators.fin.fin_laws",
    "write_table": "finlab.actuators.fin.force_table_file",
    "TableLaw": "finlab.actuators.fin.table_law",
    "read_table": "finlab.actuators.fin.table_law",
    "FinLaw": "finlab.actuators.law",
    "Plant": "finlab.physics.plant",
    "plant_of": "finlab.physics.plant",
}
"""Public name -> the module in which it stands."""


def __getattr__(name: str) -> object:
    if name not in _MODULE_OF_NAME:
        raise AttributeError(f"module 'finlab.physics' has no attribute {name!r}")
    return resolve_name(f"{_MODULE_OF_NAME[name]}:{name}")
