# %% [markdown]
# # Many targets at once
# A robot turns to and fro while it swims forward. You will see how many targets per second one call
# allocates, the worst error among them, and the frequency of each fin along the way.

# %%
import time

import matplotlib.pyplot as plt
import numpy as np

import finlab

N_TARGETS = 512
layout = finlab.load_layout("ucat")
phase = np.linspace(0, 2 * np.pi, N_TARGETS)
targets = np.zeros((N_TARGETS, 6))
targets[:, 0] = 1.0
targets[:, 5] = 0.2 * np.sin(phase)

allocator = finlab.Allocator(layout)
start = time.perf_counter()
result = allocator.allocate_batch(targets)
seconds = time.perf_counter() - start
print(f"{N_TARGETS / seconds:.0f} targets per second, worst err_norm {result.err_norm.max():.1e}")

# %%
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
axes.plot(targets[:, 5], result.command[:, :, 1], label=layout.names)
axes.set(xlabel="yaw asked for [N m]", ylabel="frequency [Hz]")
axes.legend()
plt.show()
