# %% [markdown]
# # Fins and thrusters in one robot
# Light loads go to the fins, heavy ones to the thrusters. You will see what more and more lift takes beside
# the least that any answer takes, and what becomes of a lift out of reach by two policies.

# %%
import matplotlib.pyplot as plt
import numpy as np

import finlab
from finlab.actuators.thruster import ThrusterCommand

layout = finlab.load_layout("turtle_hybrid")
allocator = finlab.Allocator(layout)
layout

# %%
for lift in (1.0, 10.0, 40.0, 100.0):
    result = allocator.allocate([2.0, 0.0, lift, 0.0, 0.0, 0.0])
    thrust = sum(
        each.force for each in result.commands.values() if isinstance(each, ThrusterCommand)
    )
    print(f"{lift:5.0f} N up: {thrust:5.2f} N by thrusters, {result.power:6.2f} W", end=", ")
    print(f"least {result.bound:6.2f} W")

# %% [markdown]
# Out of reach: `closest` comes as near as can be, `direction` keeps the direction of the wrench.

# %%
for policy in ("closest", "direction"):
    result = allocator.allocate(
        [10.0, 0.0, 150.0, 0.0, 0.0, 0.0], lost=["lift_left"], policy=policy
    )
    missing = ", ".join(f"{value:+.1f}" for value in result.unallocated)
    print(f"one thruster lost, {policy:<9}: err_norm {result.err_norm:.3f}, missing [{missing}]")

# %%
lifts = np.linspace(0.0, 60.0, 121)
batch = allocator.allocate_batch(np.outer(lifts, [0, 0, 1, 0, 0, 0]))
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
fins = np.flatnonzero(layout.is_fin)
thrusters = np.flatnonzero(~layout.is_fin)
axes.stackplot(
    lifts,
    *(batch.forces[:, rows, 2].sum(axis=1) for rows in (fins, thrusters)),
    labels=("fins", "thrusters"),
)
axes.set(xlabel="lift asked for [N]", ylabel="lift given [N]")
axes.legend(loc="upper left")
plt.show()
