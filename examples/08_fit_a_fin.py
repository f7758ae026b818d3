# %% [markdown]
# # From a load cell to an exact allocation
# A noisy file becomes a fin that no formula describes. You will see what the fit is worth, and a command for
# each fin of layout A, were they all such fins.

# %%
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import finlab
from finlab.fit import fit_fin, read_measurements, write_fin
from finlab.fit.fin_fit import summary
from finlab.layout import FinModelSpec

here = Path(__file__).parent if "__file__" in globals() else Path.cwd()
data = read_measurements([here / "soft_fin.csv"])
fit = fit_fin(data)
print("\n".join(summary(fit)))

# %% [markdown]
# What was measured: the force of each sample over the product of amplitude and frequency.

# %%
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(data.command[:, 0] * data.command[:, 1], np.linalg.norm(data.force, axis=1), ".")
axes.set(xlabel="A f [rad Hz]", ylabel="force [N]")
plt.show()

# %%
with TemporaryDirectory() as folder:
    path = Path(folder) / "fin.csv"
    write_fin(fit, path)
    model = FinModelSpec("table", (("path", str(path)),))
    layout = finlab.load_layout("A")
    layout = replace(layout, actuators=tuple(replace(fin, model=model) for fin in layout.fins))
    result = finlab.Allocator(layout).allocate([1, 0, 0.5, 0, 0, 0.1])
    print(result)
result
