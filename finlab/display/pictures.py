"""Pictures of robots, forces, attainable sets, ranges and paths, as notebooks show them.

Drawn by `figures.py`, the plotter; the pictures of experiments, swims, logs and trainings stand
with what they show.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.display.figures import COLORS, panels, space

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ARROW_SHARE = 0.35
"""Longest arrow, as a share of the robot."""
HULL_EXPONENT = {"box": 0.2}
"""Exponent of the superellipsoid that stands for a hull; 1 is an ellipsoid."""

MAX_LABELED = 16
"""Most single losses of a polar figure that have names and colors of their own."""


def robot_picture(layout: Any, forces: Array | None = None) -> Figure:
    """Returns a figure of a robot in the body frame, with an arrow at each actuator.

    Args:
        layout: a `finlab.Layout`.
        forces: the forces (n, 3) [N] that the arrows show; the actuators' directions when None.
    """
    position = layout.position
    arrow = (
        np.array([actuator.direction for actuator in layout.actuators])
        if forces is None
        else forces
    )
    longest = float(np.linalg.norm(arrow, axis=-1).max())
    hull = None if layout.body is None else layout.body.hull
    points = [position]
    if hull is not None and hull.size_m is not None:
        sides = np.array(hull.size_m)
        center = np.array(hull.center_m)
        around, up = np.meshgrid(
            np.linspace(-np.pi, np.pi, 33), np.linspace(-np.pi / 2, np.pi / 2, 17)
        )
        ball = np.stack(
            [np.cos(around) * np.cos(up), np.sin(around) * np.cos(up), np.sin(up)], axis=-1
        )
        skin = center + sides / 2 * np.sign(ball) * np.abs(ball) ** HULL_EXPONENT.get(
            hull.shape, 1.0
        )
        points.append(skin.reshape(-1, 3))
    size = max(float(np.ptp(np.concatenate(points), axis=0).max()), 1e-2)
    arrow = arrow * ARROW_SHARE * size / max(longest, 1e-12)
    words = layout.name if forces is None else f"{layout.name}\nlongest arrow {longest:.3g} N"
    figure, axes = space(words, np.concatenate([*points, position + arrow]), "m")
    if len(points) > 1:
        axes.plot_surface(*np.moveaxis(skin, -1, 0), color=COLORS[0], alpha=0.12)
    for k, (name, point, vector) in enumerate(zip(layout.names, position, arrow, strict=True)):
        axes.quiver(*point, *vector, color=COLORS[k % len(COLORS)], linewidth=2.0)
        axes.text(*point, name, fontsize="small")
    return figure


def body_picture(title: str, unit: str, body: Any) -> Figure:
    """Returns an attainable set (a `finlab.analysis.AttainableSet`) about the origin."""
    figure, axes = space(title, np.concatenate([body.vertices, np.zeros((1, 3))]), unit)
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
    """Returns a figure of a path and its reference.

    Args:
        title: the figure's title.
        reference: points (N, 3) [m].
        path: points (N, 3) [m].
        marks: points (3,) [m] that are marked, by their labels.
    """
    figure, axes = space(title, np.concatenate([reference, path]), "m")
    axes.plot(*reference.T, color="0.6", linewidth=3.0, label="reference")
    axes.plot(*path.T, color=COLORS[0], label="robot")
    for words, point in marks.items():
        axes.plot(*point[:, None], "kx")
        axes.text(*point, words, fontsize="small")
    axes.legend(frameon=False)
    return figure


def ranges_picture(title: str, names: Sequence[str], low: Array, high: Array) -> Figure:
    """Returns a figure of the range of each axis as a bar, none at NaN.

    Args:
        title: the figure's title.
        names: names of the six axes.
        low: least wrench (6,) [N, N m].
        high: largest wrench (6,) [N, N m].
    """
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


def polar_picture(
    title: str,
    words: str,
    headings: Sequence[float],
    curves: Mapping[str, Array],
    worst: Array | None,
    marks: tuple[NDArray[np.bool_], NDArray[np.bool_]] | None = None,
) -> Figure:
    """Returns a polar figure by heading, ahead at the top, clockwise.

    Args:
        title: the figure's title.
        words: what the values are.
        headings: directions (H,) [deg].
        curves: values (H,) of each case; the first is the main one, the others are single losses.
        worst: the least of these (H,), which is filled; None where there are none.
        marks: headings (H,) of the main curve, and of the worst, at which power is the limit; None
            where power has none.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, 5.6), layout="constrained")
    axes: Any = figure.add_subplot(projection="polar")
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    order = np.argsort(np.asarray(headings) % 360.0)
    closed = np.append(order, order[:1])
    angle = np.deg2rad(np.asarray(headings)[closed])
    names = list(curves)
    if worst is not None:
        axes.fill(angle, worst[closed], color=COLORS[1], alpha=0.18)
    for k, name in enumerate(names[1:]):
        if len(names) - 1 > MAX_LABELED:
            axes.plot(angle, curves[name][closed], color="0.6", lw=0.7)
            continue
        # Further losses than colors have other dashes.
        color = COLORS[2 + k % (len(COLORS) - 2)]
        style = ("-", "--", ":", "-.")[k // (len(COLORS) - 2) % 4]
        axes.plot(angle, curves[name][closed], style, color=color, lw=1.0, label=f"without {name}")
    if worst is not None:
        axes.plot(angle, worst[closed], color=COLORS[1], lw=2.2, label="worst single loss")
    axes.plot(angle, curves[names[0]][closed], color=COLORS[0], lw=2.2, label=names[0])
    if marks is not None:
        label = "limited by power"
        turn = np.deg2rad(np.asarray(headings))
        marked = [(curves[names[0]], marks[0], COLORS[0])]
        if worst is not None:
            marked.append((worst, marks[1], COLORS[1]))
        for values, is_limited, color in marked:
            axes.plot(turn[is_limited], values[is_limited], "o", color=color, ms=4.0, label=label)
            label = "_"  # one row of the legend is enough
    highest = max(float(np.max(values)) for values in curves.values())
    axes.set_ylim(0.0, highest * 1.05 if highest > 0.0 else 1.0)
    axes.set_thetagrids(np.arange(0, 360, 30))
    axes.set_rlabel_position(15)
    axes.grid(alpha=0.35)
    axes.set_title(f"{title}\n{words}, by where the load comes from", fontsize="medium")
    figure.legend(loc="outside right upper", frameon=False, fontsize="small")
    return figure
