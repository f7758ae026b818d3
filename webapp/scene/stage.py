"""The water, the floor, the hull and its axes, and how large things are drawn."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import viser

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.swim.hull import Surface, hull_of
from finlab.swim.hull.mesh_file import Mesh
from finlab.swim.hull.surface import STATIONS, shape_mesh
from webapp.handles import set_properties
from webapp.scene.actuator_shapes import NOTHING
from webapp.theme import LIGHT, Rgb, look

BELOW = 0.22
"""How far the floor is below the keel [m]."""
SKY, DEEP, BRIGHT = (255, 255, 255), (150, 170, 185), 1.9
"""Colours of the light from above and from below, and how strong it is."""

WIDE = math.radians(75.0)
"""Angle of the view [rad]."""


def aim_camera(client: viser.ClientHandle, position: Array, target: Array) -> None:
    """Let the camera stand at a place (3,) and look at another one (3,) [m]."""
    with client.atomic():
        client.camera.fov = WIDE
        client.camera.up_direction = (0.0, 0.0, 1.0)
        client.camera.position = position
        client.camera.look_at = target


def add_floor(
    scene: viser.SceneApi, name: str, size: float, cell: float, section: float, **options: Any
) -> viser.GridHandle:
    """A grid of a size, with fine and strong lines so far apart [m]; `options` as viser has
    them."""
    lines: dict[str, Any] = {"cell_thickness": 0.6, "section_thickness": 1.0}
    return scene.add_grid(
        name, size, size, cell_size=cell, section_size=section, **lines, **options
    )


def paint_floor(floor: viser.GridHandle, dark: bool) -> None:
    """The floor's colours in the dark or the light theme."""
    set_properties(floor, cell_color=look(dark).grid, section_color=look(dark).grid_section)


BOW, PROUD = 0.72, 1.012
"""Where along a hull its window begins, and how much larger that is."""


class Stage:
    """Everything that stays where it is while fins are edited."""

    def __init__(self, scene: viser.SceneApi, hull: Surface) -> None:
        self._scene = scene
        self._hull = hull
        self._look: tuple[bool, bool] | None = None
        # Surfaces that mirror a picture, viser's default, take twice the time without a graphics
        # card.
        scene.configure_environment_map(None)
        scene.add_light_hemisphere("/light", sky_color=SKY, ground_color=DEEP, intensity=BRIGHT)
        mesh = hull.mesh
        bow = bow_of(hull)
        self._body = Shape(scene, "/robot/hull", LIGHT.hull, mesh, side="double")
        self._bow = Shape(
            scene, "/robot/hull/bow", LIGHT.glass, bow, side="double", cast_shadow=False
        )
        self._axes = scene.add_frame(
            "/robot/axes",
            axes_length=0.09,
            axes_radius=0.004,
            origin_radius=0.009,
            origin_color=(40, 40, 40),
        )
        fade: dict[str, Any] = {"fade_distance": 5.0, "fade_strength": 1.6, "shadow_opacity": 0.22}
        self.floor = add_floor(scene, "/floor", 6.0, 0.1, 0.5, **fade)

    def refresh(
        self, hull: Surface, dark: bool, shadows: bool, net: bool, glass: bool, size: float
    ) -> None:
        """Show another hull, theme or quality; a hull of glass, or a mere net, lets one look
        inside. Axes and floor are as large as `size` says."""
        opacity = 0.35 if glass or net else None
        set_properties(self._body.node, opacity=opacity, wireframe=net)
        set_properties(self._bow.node, opacity=opacity, visible=not net)
        if hull != self._hull:
            self._hull = hull
            self._body.become(hull.mesh)
            self._bow.become(bow_of(hull))
        for node in (self._axes, self.floor):
            set_properties(node, scale=size)
        set_properties(
            self.floor, position=np.array([0.0, 0.0, hull.center[2] - hull.half[2] - BELOW * size])
        )
        if self._look != (dark, shadows):
            self._look = dark, shadows
            self._scene.configure_default_lights(cast_shadow=shadows)
            paint_floor(self.floor, dark)
            water = np.linspace(look(dark).water_top, look(dark).water_bottom, 64)[:, None]
            self._scene.set_background_image(
                np.repeat(water, 8, axis=1).astype(np.uint8), format="png"
            )
            set_properties(self._body.node, color=look(dark).hull)
            set_properties(self._bow.node, color=look(dark).glass)


class Shape:
    """A node and the arguments that its present shape was made from."""

    def __init__(
        self, scene: viser.SceneApi, name: str, color: Rgb, mesh: Mesh = NOTHING, **options: Any
    ) -> None:
        """Add the node, with viser's `options`; shadows fall on the floor alone."""
        self.node = scene.add_mesh_simple(
            name, mesh.vertices, mesh.faces, color=color, receive_shadow=False, **options
        )
        self._made_from: list[Any] | None = None

    def show(self, make: Callable[..., Mesh], *arguments: Any) -> None:
        """Give the node the shape `make(*arguments)`; always called with the same function."""
        key = []
        for argument in arguments:
            key.append(argument.tobytes() if isinstance(argument, np.ndarray) else argument)
        if key != self._made_from:
            self.become(make(*arguments))
            self._made_from = key

    def become(self, mesh: Mesh) -> None:
        """Give the node another shape."""
        self.node.vertices = mesh.vertices.astype(np.float32)
        if not np.array_equal(self.node.faces, mesh.faces):
            self.node.faces = mesh.faces.astype(np.uint32)


def bow_of(hull: Surface) -> Mesh:
    """A dark window over the foremost part of a shape; a mesh from a file shows its bow by
    itself."""
    if hull.file is not None:
        return NOTHING
    stations = np.concatenate([[BOW], STATIONS[STATIONS > BOW]])
    return shape_mesh(hull.shape, hull.half, hull.center, stations, PROUD)


HALF_DIAGONAL, MEAN_SIZE = 0.3455, 0.35
"""Of the U-CAT's hull: half its diagonal, and the geometric mean of its three sizes [m]."""
APART = 0.12
"""Actuators of size 1 that stand so far apart [m] do not touch."""
LEAST_SIZE = 0.15
"""Smallest size of actuators, over the size after the hull."""
STEPS = np.array([0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0])
"""Lengths of arrows are whole numbers of something that a legend can say."""


@lru_cache(maxsize=8)
def view_size(layout: Layout) -> float:
    """How far the robot reaches, and hence how far off the camera stands."""
    hull = hull_of(layout)
    reach = np.linalg.norm(layout.position - np.array(hull.center), axis=1).max()
    return max(float(np.linalg.norm(hull.half)), float(reach)) / HALF_DIAGONAL


@lru_cache(maxsize=8)
def hull_top(layout: Layout) -> float:
    """Height [m] of the highest point of the hull."""
    hull = hull_of(layout)
    return hull.center[2] + hull.half[2]


@lru_cache(maxsize=8)
def arrow_size(layout: Layout) -> float:
    """How much larger arrows and rings are than for a U-CAT: one of `STEPS`."""
    return float(STEPS[np.argmin(np.abs(np.log(STEPS / view_size(layout))))])


@lru_cache(maxsize=8)
def part_size(layout: Layout) -> float:
    """Size of the actuators: after the hull, and no larger than there is room between them. Two
    that overlap even at the least size, as two at one place do, make the others no smaller."""
    between = layout.position[:, None] - layout.position
    apart = np.linalg.norm(between, axis=-1)[~np.eye(layout.n, dtype=bool)]
    by_hull = 2.0 * math.prod(hull_of(layout).half) ** (1 / 3) / MEAN_SIZE
    least = LEAST_SIZE * by_hull
    rooms = apart / APART
    room = float(rooms[rooms >= least].min(initial=np.inf))
    return min(by_hull, room)
