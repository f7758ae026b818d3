"""The water, the floor, the hull and its axes."""

import numpy as np
import viser

from webapp.handles import Changes, put
from webapp.scene.meshes.hull import AnyHull
from webapp.scene.shape import Shape
from webapp.theme import LIGHT, Look, look

FLOOR_SIZE = 6.0
"""Side of the floor's grid [m]."""


class Stage:
    """Everything that stays where it is while fins are edited."""

    def __init__(self, scene: viser.SceneApi, hull: AnyHull) -> None:
        """Build the stage around a hull."""
        self._scene = scene
        self._new_theme, self._new_lights = Changes(), Changes()
        self._hull = hull
        mesh, bow = hull.mesh(), hull.bow()
        self._body = Shape(scene, "/robot/hull", LIGHT.hull, mesh, side="double")
        self._bow = Shape(scene, "/robot/hull/bow", LIGHT.glass, bow, side="double", cast_shadow=False)
        self._center = scene.add_label(
            "/robot/axes/center",
            "⊕ centre of gravity",
            anchor="bottom-left",
            font_screen_scale=0.85,
            visible=False,
        )
        scene.add_frame(
            "/robot/axes", axes_length=0.09, axes_radius=0.004, origin_radius=0.009, origin_color=(40, 40, 40)
        )
        self._grid = scene.add_grid(
            "/floor",
            FLOOR_SIZE,
            FLOOR_SIZE,
            cell_size=0.1,
            section_size=0.5,
            cell_thickness=0.6,
            section_thickness=1.0,
            fade_distance=5.0,
            fade_strength=1.6,
            shadow_opacity=0.22,
        )

    def refresh(self, hull: AnyHull, dark: bool, shadows: bool, glass: bool, center: bool, net: bool) -> None:
        """Show another hull, theme or quality; a hull of glass, or a mere net, lets one look inside."""
        opacity = 0.35 if glass else None
        put(self._body.node, opacity=opacity, wireframe=net)
        put(self._bow.node, opacity=opacity, visible=not net)
        put(self._center, visible=center)
        if hull != self._hull:
            self._hull = hull
            self._body.become(hull.mesh())
            self._bow.become(hull.bow())
        put(self._grid, position=np.array([0.0, 0.0, self.floor_height(hull)]))
        if self._new_lights(shadows):
            self._scene.configure_default_lights(cast_shadow=shadows)
        if self._new_theme(dark):
            self._paint(look(dark))

    def show_floor(self, visible: bool) -> None:
        """Show the floor, or leave it to others."""
        put(self._grid, visible=visible)

    @staticmethod
    def floor_height(hull: AnyHull) -> float:
        """Height of the floor: a hand below the keel [m]."""
        return hull.center[2] - hull.half[2] - 0.22

    def _paint(self, colors: Look) -> None:
        fade = np.linspace(0, 1, 64)[:, None, None]
        water = (1 - fade) * np.array(colors.water_top) + fade * np.array(colors.water_bottom)
        self._scene.set_background_image(np.repeat(water, 8, axis=1).astype(np.uint8), format="png")
        put(self._grid, cell_color=colors.grid, section_color=colors.grid_section)
        put(self._body.node, color=colors.hull)
        put(self._bow.node, color=colors.glass)
