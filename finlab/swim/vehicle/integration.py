"""One step of an ordinary differential equation y' = f(y), by two explicit Runge-Kutta rules.

A state is a sequence of components: floats of one robot, or arrays of many robots side by side. So
the rules stand here once, for what swims in simulation (`vehicle.py`), for the fault monitor's
model of it, and for the thousands of robots that a fit integrates (`many_bodies.py`).
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


def midpoint_step(
    derivative: Callable[[Sequence[Component]], Sequence[Component]],
    y: Sequence[Component],
    h: float,
) -> list[Component]:
    """Returns the state after a step by the midpoint rule, of order 2, in half the time.

    y <- y + h f(y + h/2 f(y)); arguments as of `runge_kutta_step`.
    """
    k1 = derivative(y)
    k2 = derivative([a + 0.5 * h * b for a, b in zip(y, k1, strict=True)])
    return [a + h * b for a, b in zip(y, k2, strict=True)]
