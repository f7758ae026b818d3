"""A robot that swims as seen from above: hull, fins as they point, and their forces."""

import math
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.evaluation.plots.closed_loop_run import FIN_COLOURS
from finlab.evaluation.plots.style import GREY, INK
from finlab.layout import Layout
from finlab.physics.vehicle import euler
from finlab.sim import RunLog

BLADE_M = 0.2
"""Length of a drawn fin [m]."""
ARROW_M = 0.1
"""Length of a force [m/N]."""
HULL_M = (0.5, 0.25)
"""Length and width of a hull where the layout does not say [m]."""
BOW = 0.62
"""Share of the half length from which the hull is dark, so that one sees where it heads."""


class ShapeFromAbove:
    """Made once on an axis in metres; `place` moves it. Whoever makes it draws its artists."""

    def __init__(self, axis: Any, layout: Layout, log: RunLog, colour: str) -> None:
        """Takes the robot's layout and its log, which have the same fins, and the colour of its hull."""
        from matplotlib.patches import Polygon

        self._layout, self._log = layout, log
        self._outline = outline(layout)
        length = np.ptp(self._outline[:, 0])
        ahead = self._outline[:, 0] >= self._outline[:, 0].max() - 0.5 * (1.0 - BOW) * length
        self._bow = self._outline[ahead]
        self._hull_patch = Polygon(self._outline, closed=True, fc=colour, ec=colour, alpha=0.4, animated=True)
        self._bow_patch = Polygon(self._bow, closed=True, fc=INK, ec="none", alpha=0.75, animated=True)
        for patch in (self._hull_patch, self._bow_patch):
            axis.add_patch(patch)

        def lines(width: float) -> list[Any]:
            return [axis.plot([], [], lw=width, solid_capstyle="butt", animated=True)[0] for _ in layout.fins]

        self._blades, self._forces = lines(4.5), lines(1.4)
        self.artists: list[Any] = [*self._blades, self._hull_patch, self._bow_patch, *self._forces]
        """What to draw, from the lowest to the uppermost."""

    def place(self, k: int) -> None:
        """Where it is, and what its fins do, at row k of the log."""
        log = self._log
        yaw = float(euler(log.quaternion[k])[2])
        turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
        here = log.position[k, :2]
        self._hull_patch.set_xy(here + self._outline @ turn)
        self._bow_patch.set_xy(here + self._bow @ turn)
        for i, fin in enumerate(self._layout.fins):
            root = np.array(fin.position[:2])
            along = np.array([-math.sin(fin.mounting_angle), math.cos(fin.mounting_angle)])
            # Thrust leaves along the fin's angle, so the blade trails the other way.
            tip = root - BLADE_M * math.cos(float(log.fin_angle[k, i])) * along
            end = root + ARROW_M * log.fin_force[k, i, :2]
            self._blades[i].set_data(*(here + np.stack([root, tip]) @ turn).T)
            self._blades[i].set_color(FIN_COLOURS[i % len(FIN_COLOURS)] if log.alive[k, i] else GREY)
            self._forces[i].set_data(*(here + np.stack([root, end]) @ turn).T)
            self._forces[i].set_color(INK)


def outline(layout: Layout) -> Array:
    """The hull from above (N, 2) [m], a rounded box, bow ahead."""
    hull = None if layout.body is None else layout.body.hull
    length, width = HULL_M if hull is None or hull.size_m is None else hull.size_m[:2]
    middle = (0.0, 0.0) if hull is None else hull.center_m[:2]
    angle = np.linspace(-math.pi, math.pi, 97)[:-1]
    rounded = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    shape = np.sign(rounded) * np.abs(rounded) ** 0.6
    found: Array = shape * np.array([0.5 * length, 0.5 * width]) + np.array(middle)
    return found
