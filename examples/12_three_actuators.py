# %% [markdown]
# # What method `dual` does, in thirty lines of numpy
# The robot has two thrusters at the stern and an azimuth at the bow. Each actuator answers a price [W/N] with
# the force that is worth most; Newton finds the right prices. You will see the forces of a surge, a sway and
# a yaw at the least watts, and what another answer could save.

# %%
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array

B = np.array([[1.0, 1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [-0.4, 0.4, 0.0, 0.9]])
"""Wrench (Fx, Fy, Tz) of 1 N of the thrusters at y = 0.4 and -0.4 m, and of the azimuth at x = 0.9 m."""
# watts over N^1.5
FORWARD = 0.997
REVERSE = 1.449
# N, forward and in reverse
MOST = 51.44
LEAST = 39.91


def answers(price: Array) -> tuple[Array, Array, float]:
    """Forces (4,) [N] that are worth most at prices (4,) [W/N], their derivative (4, 4) and their watts."""
    size = np.array([*np.abs(price[:2]), *2 * [np.hypot(*price[2:])]]) + 1e-12
    back = np.array([*(price[:2] < 0.0), False, False])
    scale = np.where(back, REVERSE, FORWARD)
    most = np.where(back, LEAST, MOST)
    free = (size / (1.5 * scale)) ** 2  # the marginal watts of k F^1.5 are 1.5 k F^0.5
    force = np.minimum(free, most)
    along = np.where(free < most, 2.0 * force / size, 0.0)
    unit = price / size
    derivative = np.diag(along)
    ahead = np.outer(unit[2:], unit[2:])
    derivative[2:, 2:] = along[2] * ahead + force[2] / size[2] * (np.eye(2) - ahead)
    return force * unit, derivative, float((scale * force**1.5)[:3].sum())


def solve(wrench: ArrayLike) -> tuple[Array, float, float]:
    """Forces (4,) [N] for a wrench (3,), their watts, and the watts that no answer can undercut."""
    target = np.asarray(wrench, np.float64)
    ridge = 1e-2
    best = -np.inf
    guess = np.linalg.pinv(B) @ target
    prices = np.linalg.lstsq(B.T, 1.5 * np.sign(guess) * np.sqrt(np.abs(guess)), rcond=None)[0]
    for _ in range(100):
        force, derivative, watts = answers(B.T @ prices)
        missing = target - B @ force
        value = watts + prices @ missing  # of the dual: never above the watts of any answer
        if value > best or np.linalg.norm(missing) < 1e-9:
            kept = (prices, missing, B @ derivative @ B.T, force, watts)
            best = value
            ridge = 0.1 * ridge
        else:
            ridge *= 10.0
        start, missing, hessian, force, watts = kept
        if np.linalg.norm(missing) < 1e-9 or ridge > 1e6:
            break
        prices = start + np.linalg.solve(hessian + ridge * np.trace(hessian) * np.eye(3), missing)
    return force, watts, best


# %%
force, watts, bound = solve([40.0, 12.0, -5.0])
print("thrusters [N]:", np.round(force[:2], 3), " azimuth (x, y) [N]:", np.round(force[2:], 3))
print(f"{watts:.4f} W, of which any other answer saves at most {max(watts - bound, 0.0):.1e} W")

# %%
sway = np.linspace(-30.0, 30.0, 61)
forces = np.array([solve([40.0, each, 0.0])[0] for each in sway])
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
axes.plot(sway, forces, label=("left", "right", "azimuth, x", "azimuth, y"))
axes.set(xlabel="sway asked for beside 40 N of surge [N]", ylabel="force [N]")
axes.legend()
plt.show()
