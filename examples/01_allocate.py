# %% [markdown]
# # A wrench becomes commands
# A layout and a target wrench go in, one command per fin comes out: half amplitude, frequency and zero
# direction. You will see layout A of the paper, its four commands, and their power beside the least that any
# answer takes.

# %%
import finlab

layout = finlab.load_layout("A")
layout

# %% [markdown]
# The wrench is `[Fx, Fy, Fz, Tx, Ty, Tz]` in N and N m: x forward, y left, z up.

# %%
result = finlab.Allocator(layout).allocate([1, 0, 0.5, 0, 0, 0.1], seed=0)
for name, row in zip(result.names, result.command, strict=True):
    print(f"{name:<12}", row.round(3))
print(f"error {result.err_norm:.1e} of what the robot can push")
print(f"power {result.power:.4f} W, no answer takes less than {result.bound:.4f} W")
result
