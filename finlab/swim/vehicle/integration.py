"""One step of an ordinary differential equation y' = f(y), by the classical Runge-Kutta rule.

A state is a sequence of components, arrays of many robots side by side: the thousands that a fit
integrates (`many_bodies.py`). One body alone is integrated by the core (`vehicle.py`).
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

from finlab.arrays import Array

Component = TypeVar("Component", float, Array)


def runge_kutta_step(
    derivative: Callable[[Sequence[Component]], Sequence[Component]],
    y: Sequence[Component],
    h: float,
) -> list[Component]:
    """Returns the state after a step by the classical rule of order 4.

        k1 = f(y),  k2 = f(y + h/2 k1),  k3 = f(y + h/2 k2),  k4 = f(y + h k3),
        y <- y + h/6 (k1 + 2 k2 + 2 k3 + k4)

    Args:
        derivative: f, from a state to its rate of change.
        y: components of the state.
        h: length of the step [s].
    """
    k1 = derivative(y)
    k2 = derivative([a + 0.5 * h * b for a, b in zip(y, k1, strict=True)])
    k3 = derivative([a + 0.5 * h * b for a, b in zip(y, k2, strict=True)])
    k4 = derivative([a + h * b for a, b in zip(y, k3, strict=True)])
    return [
        a + h / 6.0 * (b + 2.0 * (c + d) + e)
        for a, b, c, d, e in zip(y, k1, k2, k3, k4, strict=True)
    ]
