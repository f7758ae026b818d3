# %% [markdown]
# # A robot loses fins and goes on
# Nothing is trained again. You will see one target for four fins, for three and for two, what the loss of
# each single fin costs, and a swim on which a fin breaks.

# %%
import finlab
from finlab.analysis import score_card
from finlab.swim.simulation import ClosedLoop, make_trajectory

layout = finlab.load_layout("A")
allocator = finlab.Allocator(layout)
for lost in ([], ["front_right"], ["front_right", "back_left"]):
    result = allocator.allocate([0.5, 0, 0.5, 0, 0, 0.05], lost=lost, seed=0)
    missing = ", ".join(f"{value:+.2f}" for value in result.unallocated)
    names = ", ".join(lost) or "none"
    print(f"lost: {names:<22}  err_norm {result.err_norm:8.4f}  missing [{missing}]")

# %% [markdown]
# The score card says what the robot can do, and what is left of it without each fin.

# %%
score_card(layout)

# %% [markdown]
# After 8 s of this circle a fin stops. The controller asks for the same wrench; the allocator takes it from
# the other three.

# %%
swim = ClosedLoop(
    layout, allocator, make_trajectory("circle", 40.0), failures=[("front_right", 8.0)]
).run()
print(
    f"{swim.n_ticks} ticks, at the end {abs(swim.position[-1] - swim.reference[-1]).max():.2f} m off"
)
swim
