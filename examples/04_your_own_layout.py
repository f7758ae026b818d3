# %% [markdown]
# # A robot of your own
# Describe a robot in Python, see what it can push, save it as a layout file, and allocate with it. You will
# see a robot of three thrusters, the file, the forces that it can give, and one answer.

# %%
from pathlib import Path
from tempfile import TemporaryDirectory

import finlab
from finlab.analysis import attainable_set

T200 = finlab.PowerLaw(forward=0.997, reverse=1.449)  # watts = 0.997 F^1.5
FORCE = (-39.91, 51.44)  # N
layout = finlab.Layout(
    name="tripod",
    description="Two thrusters ahead, one up at the stern.",
    actuators=(
        finlab.Thruster("port", (0.0, 0.2, 0.0), (1.0, 0.0, 0.0), FORCE, T200),
        finlab.Thruster("starboard", (0.0, -0.2, 0.0), (1.0, 0.0, 0.0), FORCE, T200),
        finlab.Thruster("lift", (-0.25, 0.0, 0.0), (0.0, 0.0, 1.0), FORCE, T200),
    ),
    axes=("Fx", "Fz", "Tz"),  # what it commands; the other axes take what comes
)
layout

# %%
with TemporaryDirectory() as folder:
    path = Path(folder) / "tripod.yaml"
    finlab.save_layout(layout, path)
    print(path.read_text())
    layout = finlab.load_layout(path)

# %% [markdown]
# Forces that it can give with no torque about z: a sheet in surge and heave. Of two thrusters side by side
# both have to push alike.

# %%
attainable_set(layout, "force")

# %%
result = finlab.Allocator(layout).allocate([20, 0, 10, 0, 0, 2])
for name, row in zip(result.names, result.command, strict=True):
    print(f"{name:<10} {row[0]:6.2f} N")
result
