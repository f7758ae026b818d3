"""What a network proposes, around the fins: in each plane of force the mixture's density and its samples."""

import numpy as np
import viser

from finlab.allocation.allocation import Allocation
from finlab.allocation.solution import Insight
from finlab.arrays import Array
from finlab.forces.envelopes import largest_forces
from finlab.layout.arrays import layout_effectiveness
from webapp.handles import Changes
from webapp.markup.mode_plot import sample_colors
from webapp.markup.proposals import asked_of_fins
from webapp.tasks.mode_names import Modes
from webapp.tasks.solver import Proposal
from webapp.theme import Rgb, fin_color

PIXELS = 96
"""Of the picture of a plane, to each side."""
VEIL = 0.62
"""Opacity where the mixture is densest."""
RIM = 0.5
"""Opacity of the circle around a plane."""
DOT = 0.006
"""Size of a sample [m]."""


class ForcePlanes:
    """A picture and a cloud of dots for each working fin."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Nothing is shown yet."""
        self._scene, self._changes = scene, Changes()
        self._nodes: list[viser.SceneNodeHandle] = []

    def refresh(
        self, answer: Allocation | None, modes: Modes | None, proposal: Proposal | None, scale: float
    ) -> None:
        """Show what was proposed on the way to an answer; nothing for None, or where nothing was drawn.

        Args:
            answer: the answer, whose samples are drawn.
            modes: its modes, which give the samples their colours.
            proposal: the mixture; without one the planes hold samples alone.
            scale: length of a newton [m/N], as that of the fins' arrows.
        """
        if not self._changes(answer, modes, proposal, scale):
            return
        for node in self._nodes:
            node.remove()
        self._nodes = []
        if answer is None or modes is None or answer.samples is None:
            return
        layout = answer.layout
        dots, _, rim = asked_of_fins(answer, answer.samples)
        axes = layout_effectiveness(layout)[:3].reshape(3, -1, 2)
        colors = np.array(sample_colors(modes, len(answer.samples)), dtype=np.uint8)
        largest = largest_forces(layout)
        for i, fin in enumerate(layout.fins):
            if not np.isfinite(answer.command[i, 0]):
                continue
            density = None
            if proposal is not None and fin.name in proposal.fins:
                density = density_on_plane(proposal.seen, proposal.fins.index(fin.name), rim / largest[i])
            self._add(i, fin.position, axes[:, i], density, dots[:, i], colors, rim, scale)

    def _add(
        self,
        index: int,
        position: tuple[float, float, float],
        axes: Array,
        density: Array | None,
        dots: Array,
        colors: np.ndarray,
        rim: float,
        scale: float,
    ) -> None:
        """The plane of one fin, spanned by `axes` (3, 2), with dots (K, 2) [N] and a rim [N]."""
        across, up = axes.T
        turn = np.stack([across, up, np.cross(across, up)], axis=1)
        name, side = f"/robot/planes/{index}", 2.0 * rim * scale
        picture = plane_picture(density, fin_color(index))
        wxyz = viser.transforms.SO3.from_matrix(turn).wxyz
        self._nodes.append(
            self._scene.add_image(
                name,
                picture,
                side,
                side,
                wxyz=wxyz,
                position=position,
                cast_shadow=False,
                receive_shadow=False,
            )
        )
        inside = np.linalg.norm(dots, axis=-1) <= rim
        points = np.pad(dots[inside] * scale, ((0, 0), (0, 1)))
        # A child of the picture, with which it goes.
        self._scene.add_point_cloud(
            f"{name}/samples", points, colors[inside], point_size=DOT, point_shape="circle"
        )


def density_on_plane(seen: Insight, fin: int, rim: float) -> Array:
    """The mixture's density (PIXELS, PIXELS) over a fin's plane, first row on top; its largest value is 1.

    It is that of the roots of the force's shares, in which the network draws; as a density of forces it would
    have no end at the middle.

    Args:
        seen: the mixture.
        fin: which of its fins.
        rim: half the side of the square, over the fin's largest force.
    """
    line = np.linspace(-rim, rim, PIXELS)
    share = line[None, :] + 1j * line[::-1, None]
    root = _root(share)[..., None]
    mean = _root(seen.mean[fin] @ np.array([1.0, 1j]))
    std = seen.std[fin]
    parts = seen.weight / std**2 * np.exp(-0.5 * np.abs(root - mean) ** 2 / std**2)
    density = parts.sum(axis=-1)
    return np.asarray(density / max(float(density.max()), 1e-300))


def _root(share: np.ndarray) -> np.ndarray:
    """Numbers in the same direction whose sizes are the roots of the sizes."""
    return np.asarray(share / np.sqrt(np.maximum(np.abs(share), 1e-12)))


def plane_picture(density: Array | None, color: Rgb) -> np.ndarray:
    """A disc with a rim, as opaque as the density (PIXELS, PIXELS), as RGBA bytes; the rim alone for None."""
    line = np.linspace(-1.0, 1.0, PIXELS)
    radius = np.hypot(line[None, :], line[:, None])
    veil = np.full((PIXELS, PIXELS), 0.06) if density is None else 0.06 + VEIL * np.sqrt(density)
    opacity = np.where(radius < 1.0, veil, 0.0)
    opacity = np.maximum(opacity, RIM * np.clip(1.0 - np.abs(radius - 0.97) * PIXELS / 3.0, 0.0, 1.0))
    picture = np.empty((PIXELS, PIXELS, 4), dtype=np.uint8)
    picture[..., :3] = color
    picture[..., 3] = np.round(255.0 * opacity)
    return picture
