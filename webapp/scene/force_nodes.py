"""Forces of all actuators as arrows, and the fans that blades sweep: unit meshes that are moved and
scaled.

Both are one node for the whole robot, so a page is sent a few numbers for each step, and no mesh.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.swim.hull.mesh_file import Mesh
from finlab.swim.hull.surface import Surface
from webapp.handles import set_properties
from webapp.scene.actuator_node import shape_of
from webapp.scene.actuator_shapes import CHORD, RADIUS, ROOT, SHORTEST, SPAN
from webapp.scene.outline import DIGITS, HEAD_LENGTH, HEAD_RADIUS, Outline
from webapp.theme import Rgb, fin_color, look
from webapp.viser_internals import assign

THICKNESS = 0.007
"""Radius of the shafts of forces, for arrows of size 1 [m]."""
HALO = 0.0022
"""How far the outline of such an arrow stands off it, for size 1 [m]."""
FREE = 0.014
"""How far from blade, foil or duct an arrow begins, for actuators of size 1 [m]."""
BEHIND = 0.045
"""Length of a fin's housing on the other side of its blade, for size 1 [m]."""
STOCK = 0.54
"""How far a rudder's stock reaches from its middle, in spans."""
WEDGES = 10
"""A fan is so many wedges beside each other."""
WEDGE = 0.05
"""Half the angle of the unit wedge [rad]."""


class Arrows:
    """Some arrows, each with its colour; viser moves and scales a unit shaft and a unit head."""

    def __init__(self, scene: viser.SceneApi, name: str, thickness: float) -> None:
        """No arrow yet; `thickness` is the radius of their shafts, for size 1 [m]."""
        self.node = scene.add_arrows(
            name,
            np.zeros((1, 2, 3)),
            np.zeros((1, 3), dtype=np.uint8),
            shaft_radius=thickness,
            head_radius=HEAD_RADIUS * thickness,
            head_length=HEAD_LENGTH * thickness,
            visible=False,
        )
        self._thickness = thickness
        self._is_visible = False
        self._size = 0.0
        self._colors: NDArray[np.uint8] | None = None
        """Of all arrows of which some are drawn, as they were given last."""
        self._drawn = b""
        """Which of them are."""
        self._points: NDArray[np.float32] | None = None

    def thicken(self, factor: float) -> None:
        """Draw all arrows thicker by a factor."""
        thickness = factor * self._thickness
        set_properties(
            self.node,
            shaft_radius=thickness,
            head_radius=HEAD_RADIUS * thickness,
            head_length=HEAD_LENGTH * thickness,
        )

    def show(self, starts: Array, vectors: Array, colors: NDArray[np.uint8], size: float) -> None:
        """Show arrows; those of no length are left out.

        Args:
            starts: where they begin (n, 3) [m].
            vectors: from there to their tips (n, 3) [m].
            colors: of each (n, 3), in linear light; nobody changes them.
            size: factor of the thickness of their shafts.
        """
        is_drawn = (vectors * vectors).sum(axis=1) > (SHORTEST * size) ** 2
        n_drawn = np.count_nonzero(is_drawn)
        is_visible = bool(n_drawn)
        if is_visible != self._is_visible:
            self.node.visible = self._is_visible = is_visible
        if not is_visible:
            return
        points = np.empty((len(starts), 2, 3))
        points[:, 0] = starts
        points[:, 1] = starts + vectors
        points /= size
        if n_drawn < len(points):
            points = points[is_drawn]
        self._send(points.round(DIGITS).astype(np.float32), colors, is_drawn, size)

    def _send(
        self,
        points: NDArray[np.float32],
        colors: NDArray[np.uint8],
        is_drawn: NDArray[np.bool_],
        size: float,
    ) -> None:
        """Sends what has changed: ends of the arrows (m, 2, 3) that are drawn of n, and their
        looks."""
        changed: dict[str, Any] = {}
        if size != self._size:
            changed["scale"] = self._size = size
        drawn = is_drawn.tobytes()
        if colors is not self._colors or drawn != self._drawn:
            self._colors = colors
            self._drawn = drawn
            changed["colors"] = colors[is_drawn]
        if self._points is None or points.tobytes() != self._points.tobytes():
            changed["points"] = self._points = points
        if changed:
            assign(self.node, changed)


class ForceNodes:
    """Arrows at the roots of actuators, and the fans of their blades."""

    def __init__(self, scene: viser.SceneApi, robot: str = "/robot") -> None:
        """Nothing is shown yet; `robot` is the node of the robot."""
        self._arrows = Arrows(scene, f"{robot}/forces", THICKNESS)
        self._halo = Outline(scene, f"{robot}/halo", THICKNESS, HALO, linear_of(look(False).halo))
        self._is_dark = False
        wedge = unit_wedge()
        self._fans = scene.add_batched_meshes_simple(
            f"{robot}/fans",
            wedge.vertices,
            wedge.faces,
            np.array([[1.0, 0.0, 0.0, 0.0]]),
            np.zeros((1, 3)),
            batched_scales=np.ones((1, 3)),
            batched_colors=np.zeros((1, 3), dtype=np.uint8),
            lod="off",
            opacity=0.3,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )
        self._colors = np.zeros((0, 3), dtype=np.uint8)
        """Of each actuator (n, 3), in linear light."""
        self._middles = self._turns = self._starts = np.zeros((0, 3))
        self._clearance = np.zeros(0)
        """How far along its force each arrow begins from there (n,) [m]."""
        self._outward = np.zeros((0, 3))
        """Directions (n, 3) away from the hull; zero within it."""
        self._gaps = np.zeros(0)
        """Distances of the arrows' starts from the hull (n,) [m]."""
        self._sizes = (1.0, 1.0)
        self._swept: tuple[list[float], list[float]] = ([], [])
        """Half angles and angles [rad] of the fans that are shown (n,)."""

    def thicken(self, factor: float) -> None:
        """Draw the arrows thicker by a factor."""
        self._arrows.thicken(factor)
        self._halo.thicken(factor)

    def place(self, layout: Layout, hull: Surface, sizes: tuple[float, float]) -> None:
        """Where actuators stand beside a hull; `sizes` are of them and of arrows."""
        size, _ = self._sizes = sizes
        self._colors = linear([fin_color(k) for k in range(layout.n)])
        shafts = layout.frames[:, 0] * layout.is_fin[:, None]
        self._middles = layout.position + size * (ROOT + SPAN / 2) * shafts
        starts = []
        clearance = []
        outward = []
        gaps = []
        for actuator, place, frame in zip(
            layout.actuators, layout.position, layout.frames, strict=True
        ):
            is_outside = float((place - np.array(hull.center)) @ frame[0]) >= 0.0
            start = place
            free = 0.0
            if actuator.KIND.drawn_as == "fin":
                end = ROOT + SPAN + FREE if is_outside else -BEHIND - FREE
                start = place + size * end * frame[0]
            elif actuator.KIND.drawn_as == "foil":
                _, span = shape_of(actuator, size)
                end = STOCK * span + FREE * size
                start = place + (end if is_outside else -end) * frame[0]
            else:
                free = size * (RADIUS / 2 + FREE)
            away = start - hull.anchor(start)
            gap = float(np.linalg.norm(away))
            starts.append(start)
            clearance.append(free)
            outward.append(away / gap if gap > 0.0 else np.zeros(3))
            gaps.append(gap)
        self._starts = np.array(starts)
        self._clearance = np.array(clearance)
        self._outward = np.array(outward)
        self._gaps = np.array(gaps)
        self._turns = np.array([quaternion(frame.T) for frame in layout.frames])
        self._swept = ([], [])  # the fans are elsewhere

    def paint(self, is_dark: bool) -> None:
        """The outlines' colour of the dark or the light theme."""
        if is_dark != self._is_dark:
            self._is_dark = is_dark
            self._halo.paint(linear_of(look(is_dark).halo))

    def _clear_starts(self, forces: Array) -> Array:
        """Where arrows of forces (n, 3) [m] begin, clear of what gives them; one that would end in
        the hull ends at its actuator instead."""
        length = np.sqrt((forces * forces).sum(axis=1, keepdims=True))
        free = self._clearance[:, None] * forces / np.maximum(length, SHORTEST)
        is_into_hull = (forces * self._outward).sum(axis=1) < -self._gaps
        is_into_hull &= self._gaps > 0.0
        ahead = self._starts + free
        behind = self._starts - free - forces
        return np.asarray(np.where(is_into_hull[:, None], behind, ahead))

    def command(self, forces: Array, half_angles: list[float], middles: list[float]) -> str:
        """Show forces (n, 3) as arrows [m], and fans of half angles (n,) about angles (n,)
        [rad].

        Returns:
            A script that tells the page where the outlines end; empty where it knows.
        """
        starts = self._clear_starts(forces)
        self._arrows.show(starts, forces, self._colors, self._sizes[1])
        script = self._halo.show(starts, forces, self._sizes[1])
        swept = ([round(x, DIGITS) for x in half_angles], [round(x, DIGITS) for x in middles])
        if swept == self._swept:
            return script
        self._swept = swept
        amplitudes, angles = np.array(swept)
        beats = amplitudes > 0.0
        fans = self._fans
        fans.visible = bool(beats.any())
        if not beats.any():
            return script
        half = amplitudes[beats, None] / WEDGES
        across = half * (2.0 * np.arange(WEDGES) + 1.0 - WEDGES) + angles[beats, None]
        size = self._sizes[0]
        scales = np.full((*across.shape, 3), size)
        scales[..., 2] *= np.tan(half) / math.tan(WEDGE)
        turns = turned_about_x(self._turns[beats, None], across)
        positions = np.broadcast_to(self._middles[beats, None], (*across.shape, 3))
        set_properties(
            fans,
            batched_colors=np.repeat(self._colors[beats], WEDGES, axis=0),
            batched_positions=_rows(positions),
            batched_scales=_rows(scales),
            batched_wxyzs=_rows(turns),
        )
        return script


def _rows(values: Array) -> NDArray[np.float32]:
    """Values of all wedges, one a row."""
    return values.reshape(-1, values.shape[-1]).round(DIGITS).astype(np.float32)


def linear(colors: Sequence[Rgb]) -> NDArray[np.uint8]:
    """Colours (n, 3) in linear light (IEC 61966-2-1): viser takes those of instances for that, and
    those of other meshes for sRGB (its `BatchedMeshBase.tsx`, `setRGB` without a colour space)."""
    share = np.array(colors) / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.asarray((255.0 * light).round().astype(np.uint8))


def linear_of(color: Rgb) -> Rgb:
    """A colour in linear light."""
    red, green, blue = linear([color])[0].tolist()
    return red, green, blue


def unit_wedge() -> Mesh:
    """A narrow piece of the ring that a blade sweeps about its shaft, in the middle of its
    width."""
    inner = 0.035
    outer = CHORD - 0.004
    ends = np.array([[inner, -1.0], [outer, -1.0], [outer, 1.0], [inner, 1.0]])
    radius, side = ends.T
    vertices = np.stack([0.0 * radius, -radius, radius * side * math.tan(WEDGE)], axis=1)
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))


def quaternion(rotation: Array) -> Array:
    """The unit quaternion (4,) of a rotation matrix (3, 3), by its largest component (Shepperd,
    1978)."""
    trace = float(np.trace(rotation))
    k = int(np.argmax([trace, *np.diag(rotation)]))
    if k == 0:
        wxyz = np.array([1.0 + trace, *_skew(rotation)])
    else:
        wxyz = np.zeros(4)
        wxyz[0] = _skew(rotation)[k - 1]
        wxyz[1:] = rotation[:, k - 1] + rotation[k - 1]
        wxyz[k] = 1.0 + 2.0 * rotation[k - 1, k - 1] - trace
    return np.asarray(wxyz / np.linalg.norm(wxyz))


def _skew(rotation: Array) -> Array:
    """The vector (3,) of a matrix less its transpose."""
    difference = rotation - rotation.T
    return np.array([difference[2, 1], difference[0, 2], difference[1, 0]])


def turned_about_x(wxyz: Array, angle: Array) -> Array:
    """Quaternions (..., 4) that turn by angles (...) [rad] about x before they turn by others (...,
    4)."""
    c = np.cos(angle / 2)
    s = np.sin(angle / 2)
    w, x, y, z = np.moveaxis(wxyz, -1, 0)
    return np.stack([w * c - x * s, w * s + x * c, y * c + z * s, z * c - y * s], axis=-1)
