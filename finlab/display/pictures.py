"""Pictures of robots, forces, attainable sets, ranges and swims; matplotlib is imported when one is
drawn."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from finlab.arrays import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's, which most people can tell apart."""
THIN = 0.15
"""Least side of a drawn space, as a share of its longest."""
ARROW = 0.35
"""Longest arrow, as a share of the robot."""
SHARPNESS = {"box": 0.2}
"""Exponent of the superellipsoid that stands for a hull; 1 is an ellipsoid."""


def drawn(picture: Callable[[], Figure], form: str, dpi: int = 80) -> bytes:
    """Returns a picture as the content of a file: png, svg or pdf, of `dpi` pixels per inch. Text
    in it is no formula: it may be a stranger's. Raises ImportError: matplotlib is not installed."""
    import matplotlib

    content = io.BytesIO()
    with matplotlib.rc_context({"text.parse_math": False}):
        picture().savefig(content, format=form, dpi=dpi, bbox_inches="tight")
    return content.getvalue()


def robot_picture(layout: Any, forces: Array | None = None) -> Figure:
    """Returns a robot (a `finlab.Layout`) in the body frame, with an arrow at each actuator: where
    it points, or its force (n, 3) [N]."""
    place = layout.position
    arrow = np.array([part.direction for part in layout.actuators]) if forces is None else forces
    most = float(np.linalg.norm(arrow, axis=-1).max())
    hull = None if layout.body is None else layout.body.hull
    points = [place]
    if hull is not None and hull.size_m is not None:
        sides = np.array(hull.size_m)
        center = np.array(hull.center_m)
        around, up = np.meshgrid(
            np.linspace(-np.pi, np.pi, 33), np.linspace(-np.pi / 2, np.pi / 2, 17)
        )
        ball = np.stack(
            [np.cos(around) * np.cos(up), np.sin(around) * np.cos(up), np.sin(up)], axis=-1
        )
        skin = center + sides / 2 * np.sign(ball) * np.abs(ball) ** SHARPNESS.get(hull.shape, 1.0)
        points.append(skin.reshape(-1, 3))
    size = max(float(np.ptp(np.concatenate(points), axis=0).max()), 1e-2)
    arrow = arrow * ARROW * size / max(most, 1e-12)
    words = layout.name if forces is None else f"{layout.name}\nlongest arrow {most:.3g} N"
    figure, axes = _space(words, np.concatenate([*points, place + arrow]), "m")
    if len(points) > 1:
        axes.plot_surface(*np.moveaxis(skin, -1, 0), color=COLORS[0], alpha=0.12)
    for k, (name, at, towards) in enumerate(zip(layout.names, place, arrow, strict=True)):
        axes.quiver(*at, *towards, color=COLORS[k % len(COLORS)], linewidth=2.0)
        axes.text(*at, name, fontsize="small")
    return figure


def body_picture(title: str, unit: str, body: Any) -> Figure:
    """Returns an attainable set (a `finlab.analysis.AttainableSet`) about the origin."""
    figure, axes = _space(title, np.concatenate([body.vertices, np.zeros((1, 3))]), unit)
    corners = body.vertices.T
    faces = body.faces
    if len(faces):
        axes.plot_trisurf(
            *corners, triangles=faces, color=COLORS[0], alpha=0.35, edgecolor="0.4", lw=0.3
        )
    axes.plot(*corners[:, np.append(body.outline, body.outline[:1])], color=COLORS[0])
    axes.plot(*np.zeros((3, 1)), "k+")
    return figure


def path_picture(title: str, reference: Array, path: Array, marks: Mapping[str, Array]) -> Figure:
    """Returns a path (N, 3) beside its reference (N, 3), with marked places (3,) by their words
    [m]."""
    figure, axes = _space(title, np.concatenate([reference, path]), "m")
    axes.plot(*reference.T, color="0.6", linewidth=3.0, label="reference")
    axes.plot(*path.T, color=COLORS[0], label="robot")
    for words, at in marks.items():
        axes.plot(*at[:, None], "kx")
        axes.text(*at, words, fontsize="small")
    axes.legend(frameon=False)
    return figure


def ranges_picture(title: str, names: Sequence[str], low: Array, high: Array) -> Figure:
    """Returns bars from least to most of each axis, forces (3,) [N] and torques (3,) [N m]; none at
    NaN."""
    figure, axes = panels((6.0, 2.4), 1, 2)
    width = np.nan_to_num(high - low)
    low = np.nan_to_num(low)
    for side, unit, rows in zip(axes[0], ("N", "N m"), (slice(3), slice(3, 6)), strict=True):
        side.barh(names[rows], width[rows], left=low[rows], color=COLORS[0])
        side.axvline(0.0, color="k", linewidth=0.8)
        side.set(xlabel=unit)
        side.invert_yaxis()
    figure.suptitle(title)
    return figure


def panels(
    size: tuple[float, float], rows: int = 1, columns: int = 1, **how: Any
) -> tuple[Figure, Any]:
    """Returns a figure of this size [inches] and its panels (rows, columns), with grids; `how` goes
    to matplotlib's `subplots`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes: Any = figure.subplots(rows, columns, squeeze=False, **how)
    for each in axes.flat:
        each.grid(alpha=0.3)
        each.set_axisbelow(True)
    return figure, axes


def _space(title: str, points: Array, unit: str) -> tuple[Figure, Any]:
    """A figure with three axes of one scale around points (N, 3)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.6, 4.8), layout="constrained")
    axes: Any = figure.add_subplot(projection="3d")
    low = points.min(axis=0)
    high = points.max(axis=0)
    middle = (low + high) / 2
    span = np.maximum(high - low, max(THIN * float((high - low).max()), 1e-9))
    ends = zip(middle - 0.55 * span, middle + 0.55 * span, strict=True)
    axes.set(**dict(zip(("xlim", "ylim", "zlim"), ends, strict=True)))
    axes.set_box_aspect(span)
    axes.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]", zlabel=f"z [{unit}]")
    axes.set_title(title)
    axes.locator_params(nbins=4)
    return figure, axes
