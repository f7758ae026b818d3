# %% [markdown]
# # What jets take, from twenty samples
# Jets that meet other actuators or the hull weaken them. You will see what the laws alone miss, and what the
# fitted jets leave of it. The tank here is a robot whose jets spread and weaken otherwise than usual.

# %%
from dataclasses import replace

import numpy as np

import finlab
from finlab.fit.interaction.constants import fit_constants
from finlab.fit.interaction.samples import Samples
from finlab.interaction.jets import Jets
from finlab.physics import Plant

believed = finlab.load_layout("bluerov2_heavy")
tank = Plant(replace(believed, interaction=Jets(spread=28.0, lag=0.8, hull=0.45)))
rng = np.random.default_rng(0)
command = tank.sample(rng, (20,))
wrench = tank.wrench(command)
measured = wrench + 0.02 * wrench.std(axis=0) * rng.normal(size=wrench.shape)

# %%
fit = fit_constants(Samples(believed, command, measured))
print(f"laws alone miss {fit.laws:.3f} of the wrench scale, with jets {fit.left:.3f}")
print(fit.jets)

# %%
target = np.array([40.0, 0.0, 20.0, 0.0, 0.0, 1.0])
for layout in (believed, replace(believed, interaction=fit.jets)):
    result = finlab.Allocator(layout).allocate(target)
    missed = tank.wrench(result.command) - target
    print(f"{result.power:.1f} W, in the tank off by {np.linalg.norm(missed[:3]):.2f} N")
result
