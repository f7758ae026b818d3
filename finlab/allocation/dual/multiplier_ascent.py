"""Better multipliers for a bound, where those of an answer stand for other forces than the laws
give, as with measured tables.

Of each actuator i, commands u_k are sampled around the answer, with powers P_ik and normalized
wrenches w_ik. The dual of these samples (Eq. 3, its conjugates maxima over k) has kinks; smoothed
at a temperature tau [W] by the logarithm of a sum of exponentials it is

    g_tau(lambda) = lambda^T w - tau sum_i log sum_k exp((lambda^T w_ik - P_ik) / tau),

whose gradient and Hessian are, with the weights p_ik of the samples (the exponentials over their
sum) and their means m_i = sum_k p_ik w_ik,

    grad g = w - sum_i m_i,    - Hess g = sum_i (sum_k p_ik w_ik w_ik^T - m_i m_i^T) / tau.

Newton's method climbs it while the temperature falls. Any multipliers prove a bound (weak duality),
so that the samples decide how high it is and not whether it holds.
"""

from typing import NamedTuple

import numpy as np

from finlab.arrays import CLOSE, NOTHING, ROUNDS, Array
from finlab.physics.plant import Plant

SAMPLES = 800
"""Commands of each actuator at which its law is asked."""
TEMPERATURES = np.geomspace(0.3, 0.003, 14)
"""Temperatures, as shares of the mean power of an actuator: from the first the ascent finds the
region, at the last the smoothing is below what is asked of a bound."""
FIRST_RIDGE = 10.0 * CLOSE
"""Damping of the first step, over the trace of the Hessian."""
RIDGE_KEPT = 0.1
"""Factor of the damping after a step that is kept."""
RIDGE_REFUSED = 10.0
"""Factor of the damping after a step that lowers the dual, and is refused."""


def raised_multipliers(
    plant: Plant, wrench_scale: Array, wrench: Array, multipliers: Array, command: Array
) -> Array:
    """Raises the bound that multipliers prove, by the laws of a plant.

    Args:
        plant: the laws of n actuators, in the flow of the answer.
        wrench_scale: (6,) [N, N m], by which wrenches are normalized.
        wrench: (6,) [N, N m] that a command gives.
        multipliers: its lambda (6,) [W/N, W/(N m)], where the ascent begins.
        command: (n, 3).

    Returns:
        Multipliers (6,) [W/N, W/(N m)].
    """
    low = plant.layout.lower
    high = plant.layout.upper
    rng = np.random.default_rng(0)
    change = rng.uniform(-1.0, 1.0, (SAMPLES, *command.shape)) * (high - low)
    reach = np.geomspace(10.0 * CLOSE, 1.0, SAMPLES)[:, None, None]
    commands = (command + reach * change).clip(low, high)
    commands[0] = command
    sampled = _SampledDual(
        wrench=np.einsum("kna,naw->nkw", plant.force(commands), plant.effectiveness) / wrench_scale,
        power=plant.power(commands).T,
        target=wrench / wrench_scale,
    )
    multipliers_scaled = multipliers * wrench_scale
    ridge = FIRST_RIDGE
    for temperature in TEMPERATURES * sampled.power[:, 0].mean():
        negative_dual, weights = sampled.smoothed(multipliers_scaled, temperature)
        mean = np.einsum("nk,nkw->nw", weights, sampled.wrench)
        weighted = (sampled.wrench * weights[..., None]).swapaxes(1, 2)
        covariance = (weighted @ sampled.wrench).sum(axis=0) - mean.T @ mean
        gradient = sampled.target - mean.sum(axis=0)
        for _ in range(ROUNDS):
            damped = covariance + (ridge * np.trace(covariance) + NOTHING) * np.eye(6)
            step = temperature * np.linalg.solve(damped, gradient)
            if sampled.smoothed(multipliers_scaled + step, temperature)[0] <= negative_dual:
                multipliers_scaled = multipliers_scaled + step
                ridge = RIDGE_KEPT * ridge
                break
            ridge *= RIDGE_REFUSED
    return multipliers_scaled / wrench_scale


class _SampledDual(NamedTuple):
    """The dual of sampled commands of n actuators."""

    wrench: Array
    """Normalized wrenches w_ik (n, SAMPLES, 6)."""
    power: Array
    """Powers P_ik (n, SAMPLES) [W]."""
    target: Array
    """Normalized wrench (6,) that is given."""

    def smoothed(self, multipliers_scaled: Array, temperature: float) -> tuple[float, Array]:
        """Returns -g_tau [W] at scaled multipliers (6,) [W], and the weights p_ik (n, SAMPLES)."""
        exponent = (self.wrench @ multipliers_scaled - self.power) / temperature
        largest = exponent.max(axis=1, keepdims=True)
        exponential = np.exp(exponent - largest)  # shifted by the largest: none overflows
        total = exponential.sum(axis=1, keepdims=True)
        conjugates = temperature * (largest + np.log(total)).sum()
        return float(conjugates - self.target @ multipliers_scaled), exponential / total
