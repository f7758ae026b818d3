"""The pictures of an animated swim: what stays is drawn once, and for each picture only what moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.evaluation.plots.closed_loop_run import failures
from finlab.evaluation.plots.compared_runs import RUN_COLOURS, distance_cm, smooth_power
from finlab.evaluation.plots.shape_from_above import ShapeFromAbove
from finlab.evaluation.plots.style import GREY, INK, SKY, SOFT, VERMILION, clean
from finlab.layout import Layout
from finlab.sim import RunLog

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image

SIZE = (9.6, 5.4)
"""Width and height of a picture [in]."""
DPI = 80
"""Pixels per inch."""
MARGIN_M = 0.5
"""Room around the path [m]."""
FLOW_POINTS = 400.0
"""Length of the water's arrow per velocity [points per m/s]."""
LONGEST_POINTS = 64.0
"""Length of the longest such arrow [points]."""
FLOW_PLACE = np.array([40.0, 52.0])
"""Its middle, from the lower left corner of the view from above [points]."""


class Swum(NamedTuple):
    """One robot of an animation."""

    name: str
    """In the legend."""
    log: RunLog
    """What it swam."""
    layout: Layout
    """Its shape, with the fins of the log."""


class Film:
    """The pictures of one swim, or of several in one."""

    def __init__(self, robots: Sequence[Swum]) -> None:
        """Takes who swims; the first one's path, losses and water are drawn."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self._robots = robots
        self._figure: Figure = Figure(figsize=SIZE, dpi=DPI)
        self._canvas: Any = FigureCanvasAgg(self._figure)
        grid = self._figure.add_gridspec(
            3, 2, width_ratios=(1.5, 1), left=0.07, right=0.985, top=0.87, bottom=0.1, hspace=0.32, wspace=0.2
        )
        self._above = self._figure.add_subplot(grid[:, 0])
        self._over_time = [self._figure.add_subplot(grid[k, 1]) for k in range(3)]
        self._moving: list[Any] = []
        self._draw_above()
        self._draw_over_time()
        self._title = self._figure.text(0.985, 0.955, "", ha="right", va="center", color=INK, fontsize=12)
        self._title.set_animated(True)
        self._figure.legend(
            handles=self._above.get_legend_handles_labels()[0], loc="upper left", frameon=False, ncols=5
        )
        self._canvas.draw()  # type: ignore[no-untyped-call]
        self._still = self._canvas.copy_from_bbox(self._figure.bbox)  # type: ignore[no-untyped-call]

    def _draw_above(self) -> None:
        """Path and trails from above; what moves is made here, and placed by `frame`."""
        axis, first = self._above, self._robots[0].log
        axis.plot(*first.reference[:, :2].T, color=GREY, lw=2.4, label="path")
        self._trails, self._shapes = [], []
        for robot, colour in zip(self._robots, RUN_COLOURS, strict=False):
            (trail,) = axis.plot([], [], color=colour, lw=1.6, label=robot.name, animated=True)
            self._trails.append(trail)
            self._moving.append(trail)
            shape = ShapeFromAbove(axis, robot.layout, robot.log, colour)
            self._shapes.append(shape)
            self._moving += shape.artists
        (self._wanted,) = axis.plot([], [], "o", color=SOFT, ms=5, animated=True)
        self._moving.append(self._wanted)
        points = np.concatenate([r.log.position[:, :2] for r in self._robots] + [first.reference[:, :2]])
        low, high = np.nanmin(points, axis=0) - MARGIN_M, np.nanmax(points, axis=0) + MARGIN_M
        middle, box = 0.5 * (low + high), axis.get_window_extent()
        half = 0.5 * np.array([box.width, box.height]) * ((high - low) / [box.width, box.height]).max()
        (left, bottom), (right, top) = middle - half, middle + half
        axis.set(xlim=(left, right), ylim=(bottom, top), xlabel="x [m]", ylabel="y [m]")
        axis.set_title("From above")
        clean(axis, "both")
        self._water = axis.annotate(
            "", (0.0, 0.0), (0.0, 0.0), xycoords="axes points", textcoords="axes points",
            arrowprops={"arrowstyle": "-|>", "color": SKY, "lw": 2.5, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
        self._water.set_animated(True)
        self._water_words = axis.text(
            0.02, 0.02, "", transform=axis.transAxes, color=SOFT, va="bottom", animated=True
        )
        self._moving += [self._water, self._water_words]

    def _draw_over_time(self) -> None:
        """Lines of the whole swim in pale colours; up to now they are drawn strongly."""
        self._lines: list[tuple[Any, Array, Array]] = []
        self._cursors = []
        names = ("depth [m]", "off the path [cm]", "power, 1 s [W]")
        end = max(float(r.log.time[-1]) for r in self._robots)
        for k, (axis, name) in enumerate(zip(self._over_time, names, strict=True)):
            if k == 0:
                first = self._robots[0].log
                axis.plot(first.time, -first.reference[:, 2], color=GREY, lw=2.0)
            for robot, colour in zip(self._robots, RUN_COLOURS, strict=False):
                values = _values(robot.log, k)
                axis.plot(robot.log.time, values, color=colour, lw=1.0, alpha=0.3)
                (line,) = axis.plot([], [], color=colour, lw=1.6, animated=True)
                self._lines.append((line, robot.log.time, values))
                self._moving.append(line)
            for time, fin in failures(self._robots[0].log):
                if time > 0.0:
                    axis.axvline(time, color=VERMILION, lw=1.0, ls=(0, (4, 3)))
                    if k == 0:
                        axis.annotate(
                            f"{fin} lost", (time, 1.02), xycoords=("data", "axes fraction"), fontsize=8,
                            color=VERMILION, ha="center", annotation_clip=False,
                        )  # fmt: skip
            axis.set(xlim=(0.0, end), ylabel=name)
            if k == 0:
                axis.invert_yaxis()
            else:
                axis.set_ylim(0.0, max(axis.get_ylim()[1], 0.01))
            clean(axis, "both")
            if k < 2:
                axis.tick_params(labelbottom=False)
            cursor = axis.axvline(0.0, color=SOFT, lw=1.0, animated=True)
            self._cursors.append(cursor)
            self._moving.append(cursor)
        self._over_time[-1].set_xlabel("time [s]")

    def frame(self, time: float) -> Image:
        """The picture at a time [s]."""
        from PIL import Image as images

        first = self._robots[0].log
        for robot, trail, shape in zip(self._robots, self._trails, self._shapes, strict=True):
            k = _tick(robot.log, time)
            trail.set_data(*robot.log.position[: k + 1, :2].T)
            shape.place(k)
        k = _tick(first, time)
        self._wanted.set_data(first.reference[k : k + 1, 0], first.reference[k : k + 1, 1])
        self._flow(first.flow[k])
        for line, times, values in self._lines:
            n = int(np.searchsorted(times, time, side="right"))
            line.set_data(times[:n], values[:n])
        for cursor in self._cursors:
            cursor.set_xdata([time, time])
        off, watts = _values(first, 1)[k], _values(first, 2)[k]
        self._title.set_text(f"{time:5.1f} s    {off:.1f} cm off    {watts:.2f} W")
        self._canvas.restore_region(self._still)
        for artist in self._moving:
            self._figure.draw_artist(artist)
        self._figure.draw_artist(self._title)
        return images.fromarray(np.asarray(self._canvas.buffer_rgba())[..., :3].copy())

    def _flow(self, flow: Array) -> None:
        """The arrow of the water, in the lower left corner."""
        speed = float(np.linalg.norm(flow))
        half = 0.5 * FLOW_POINTS * flow[:2]
        half *= min(1.0, 0.5 * LONGEST_POINTS / max(float(np.linalg.norm(half)), 1e-9))
        self._water.set_visible(speed > 1e-6)
        self._water.set_position(tuple(FLOW_PLACE - half))
        self._water.xy = tuple(FLOW_PLACE + half)
        self._water_words.set_text(f"water {100 * speed:.0f} cm/s" if speed > 1e-6 else "still water")


def _values(log: RunLog, k: int) -> Array:
    """Depth [m], distance from the path [cm] or power [W] over time (N,)."""
    return (lambda log: -log.position[:, 2], distance_cm, smooth_power)[k](log)


def _tick(log: RunLog, time: float) -> int:
    """The row of a time [s], the last one after the end."""
    return max(0, int(np.searchsorted(log.time, time + 1e-9, side="right")) - 1)
