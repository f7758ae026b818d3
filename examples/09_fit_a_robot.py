# %% [markdown]
# # A robot that is not built as drawn
# From a swim to where its fins and its centre of gravity really are. You will see what the fit is worth, and
# what an allocation for the drawn robot and for the fitted one gives.

# %%
import math
from pathlib import Path
from tempfile import TemporaryDirectory

import finlab
from finlab.swim.identification.fitted_robot import summary, write_robot
from finlab.swim.identification.robot_fit import fit_robot
from finlab.swim.identification.swim import read_swim
from finlab.swim.simulation import perturbed
from finlab.swim.simulation.excite import excitation

drawn = finlab.load_layout("A")
built = perturbed(drawn, askew=math.radians(5.0), center=(-0.016, 0.012, 0.0))

# %% [markdown]
# A real robot writes a CSV file in place of this simulated log; `10_swim_from_rosbag.py` makes one of a
# rosbag.

# %%
with TemporaryDirectory() as folder:
    log = Path(folder) / "log.npz"
    path = Path(folder) / "mine.yaml"
    excitation(drawn, 60.0, truth=built).run().save(log)
    fit = fit_robot(drawn, [read_swim(log, drawn)], other_law=False)
    print("\n".join(summary(fit)))
    fitted = write_robot(fit, path)

# %%
for robot in (drawn, fitted):
    result = finlab.Allocator(robot).allocate([1.0, 0.0, 0.5, 0.0, 0.0, 0.1])
    print(result)
result
