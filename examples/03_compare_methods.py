# %% [markdown]
# # Methods side by side
# Every method answers through the same interface, and the fins' own laws judge them all. You will see error,
# power, effort and time of six methods on one target, and a picture of two of them.

# %%
import matplotlib.pyplot as plt

import finlab
from finlab.allocation import MethodName

METHODS: tuple[MethodName, ...] = ("dual", "mdn", "paper", "analytic", "qp", "sqp")
layout = finlab.load_layout("A")
results = {}
print(f"{'method':<10}  err_norm  power [W]   effort        ms")
for method in METHODS:
    allocator = finlab.Allocator(layout, method)
    allocator.allocate([1, 0, 0, 0, 0, 0])  # the first call is slower
    result = results[method] = allocator.allocate([1, 0, 0.5, 0, 0, 0.1], seed=0)
    costs = f"{result.power:9.3f}  {result.effort:7.3f}"
    print(f"{method:<10}  {result.err_norm:8.1e}  {costs}  {result.solve_ms:8.1f}")

# %% [markdown]
# `dual` keeps watts least, `mdn` the paper's effort; both deliver the wrench exactly.

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
left.bar(METHODS, [result.power for result in results.values()])
left.set(ylabel="power [W]")
right.bar(METHODS, [max(result.err_norm, 1e-10) for result in results.values()])
right.set(yscale="log", ylabel="error")
plt.show()
