"""Jets in the view: a cone behind each actuator that blows, and an arrow of what the jets take
there."""

import numpy as np
import viser

from finlab.arrays import Array
from finlab.interaction.interaction import jets_of
from finlab.interaction.jets import Jets
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.hull.mesh_file import Mesh
from webapp.handles import set_properties
from webapp.scene.actuator_shapes import NOTHING, force_arrow, tube
from webapp.scene.stage import Shape, part_size
from webapp.theme import TAKEN, WATER

LONGEST = 6.0
"""Length of the fastest jet, in diameters; slower ones are as much shorter."""
LEAST_SPEED, LEAST_TAKEN = 0.15, 0.01
"""Shares of the fastest jet's speed, and of the largest force, below which nothing is drawn."""

CLEAR = 0.06
"""How far from its actuator of size 1 an arrow begins [m], so that a duct does not hide it."""


class JetNodes:
    """Made when a robot with an interaction is met first, then updated."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._nodes: list[tuple[Shape, Shape]] = []
        self.drawn = 0
        """Actuators whose nodes may show something."""

    def refresh(self, layout: Layout | None, force: Array, scale: float, size: float) -> None:
        """Show the jets of forces (n, 3) [N], body frame, and what they take at rest, by the
        `scale` of arrows [m/N], as thick as `size` says; nothing for None, or for a layout without
        interaction."""
        interaction = None if layout is None else plant_of(layout).interaction
        if layout is None or interaction is None:
            self._hide(0)
            return
        diameter = interaction.geometry.diameter
        jets = jets_of(force, diameter)
        taken = interaction.at_rest(force)
        speed = np.where(diameter > 0.0, jets.speed, 0.0)
        fraction = speed / max(float(speed.max()), 1e-9)
        directions = -np.round((LONGEST * diameter * fraction)[:, None] * jets.ahead, 3)
        blows = (fraction >= LEAST_SPEED) & (np.linalg.norm(directions, axis=1) > 0.0)
        counts = np.linalg.norm(taken, axis=1) > LEAST_TAKEN * np.linalg.norm(force, axis=1).max()
        form = layout.interaction if isinstance(layout.interaction, Jets) else Jets()
        for i in range(layout.n):
            jet, arrow = self._node(i)
            set_properties(jet.node, visible=bool(blows[i]), position=layout.position[i])
            set_properties(
                arrow.node, visible=bool(counts[i]), position=layout.position[i], scale=size
            )
            if blows[i]:
                jet.show(cone, directions[i], float(diameter[i]), form.width, form.spread)
            if counts[i]:
                direction = taken[i] * scale
                start = CLEAR * part_size(layout) / size * direction / np.linalg.norm(direction)
                arrow.show(force_arrow, direction, start, 0.009)
        self._hide(layout.n)

    def _node(self, index: int) -> tuple[Shape, Shape]:
        if index == len(self._nodes):
            jet = Shape(self._scene, f"/robot/jets/{index}", WATER, opacity=0.3, cast_shadow=False)
            self._nodes.append(
                (jet, Shape(self._scene, f"/robot/taken/{index}", TAKEN, cast_shadow=False))
            )
        return self._nodes[index]

    def _hide(self, first: int) -> None:
        """Nothing from a place on."""
        for pair in self._nodes[first : self.drawn]:
            for shape in pair:
                set_properties(shape.node, visible=False)
        self.drawn = first


def cone(direction: Array, diameter: float, width: float, spread: float) -> Mesh:
    """A jet along `way` (3,) [m] from the origin, as wide as its water has 1/e of the speed in its
    middle."""
    length = float(np.linalg.norm(direction))
    if not length:
        return NOTHING
    along = np.linspace(0.0, length, 12)
    radius = diameter * np.sqrt(((along / diameter) ** 2 + width**2) / spread)
    return tube(along[:, None] * direction / length, radius, 24)
