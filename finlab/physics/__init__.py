"""Command to force to wrench: fin models and the plant, in torch, batched and differentiable."""

from finlab.physics.drag import Drag as Drag
from finlab.physics.fin_model import FinModel as FinModel
from finlab.physics.fin_model import make_fin_model as make_fin_model
from finlab.physics.lighthill import Lighthill as Lighthill
from finlab.physics.plant import Plant as Plant
from finlab.physics.table import TableFinModel as TableFinModel
from finlab.physics.table import write_table as write_table
from finlab.physics.wrench import assemble_wrench as assemble_wrench
from finlab.physics.wrench import body_force as body_force
from finlab.physics.wrench import effectiveness_matrix as effectiveness_matrix
from finlab.physics.wrench import wrench_of_forces as wrench_of_forces
