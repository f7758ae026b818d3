"""Robots of which policies are asked in these tests: quick to compile, and with answers that are
known."""

import numpy as np

from finlab.actuators.thrust_model import PowerLaw
from finlab.actuators.thruster import Thruster
from finlab.arrays import Array
from finlab.layout.layout import Layout
from finlab.research.random_layouts import (
    random_azimuth,
    random_robot,
    random_thruster,
    random_tilt,
)


def mixed_robot(number: int) -> Layout:
    """A robot of eight thrusters and pods."""
    rng = np.random.default_rng([17, number])
    return random_robot(rng, "mixed", (8, 8), [random_thruster, random_azimuth, random_tilt])


def six_thrusters(seed: int = 3) -> Layout:
    """Six thrusters of different laws ~ F^1.5, the same both ways, whose forces are what a wrench
    needs, whatever they take."""
    rng = np.random.default_rng(seed)
    thrusters = []
    for i in range(6):
        axis = rng.normal(size=3)
        x, y, z = (axis / np.linalg.norm(axis)).tolist()
        place = rng.uniform(-0.3, 0.3, 3).tolist()
        most = float(rng.uniform(10.0, 40.0))
        coefficient = float(rng.uniform(0.5, 2.0))
        thrusters.append(
            Thruster(
                f"t{i + 1}",
                (place[0], place[1], place[2]),
                (x, y, z),
                (-most, most),
                PowerLaw(coefficient, coefficient, 1.5),
            )
        )
    return Layout("six", tuple(thrusters))


def multipliers_of_six(layout: Layout, effectiveness: Array, wrench: Array) -> Array:
    """The exact multipliers (N, 6) of six thrusters: B' lambda = 1.5 k |F|^0.5 sign F at the forces
    F = B^-1 w.

    Args:
        layout: of `six_thrusters`.
        effectiveness: wrench per newton of each (6, 6), in rows.
        wrench: (N, 6) [N, N m].
    """
    force = np.linalg.solve(effectiveness.T, wrench.T).T
    coefficient = np.array([each.model.forward for each in layout.actuators])  # type: ignore[attr-defined]
    price = 1.5 * coefficient * np.sqrt(np.abs(force)) * np.sign(force)
    return np.asarray(np.linalg.solve(effectiveness, price.T).T)
