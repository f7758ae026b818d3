"""Pictures of experiments and swims, drawn by matplotlib (extra `plot`), imported when one is asked
for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from finlab.arrays import Array
from finlab.assets import install
from finlab.display.pictures import COLORS, panels, render
from finlab.errors import DataError
from finlab.research.evaluation.document import Row
from finlab.swim.simulation.log import RunLog
from finlab.whole_file import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = (".png", ".svg", ".pdf")  # kinds of files that are written
DPI = 150
MARKERS = "osD^v<>"
LEAST_ERROR = 1e-12  # errors below this one are drawn there: a logarithmic axis has no 0
STYLES = ("-", "--", ":", "-.")
"""Of the lines of one color, which the first word of a name has."""


def check_picture(path: Path | None) -> None:
    """Refuse, before the work, a picture that could not be written after it. Raises DataError:
    matplotlib is not installed, the folder is missing, or the name has another ending."""
    if path is None:
        return
    if path.suffix.lower() not in FORMATS or path.is_dir() or not path.absolute().parent.is_dir():
        endings = ", ".join(FORMATS)
        raise DataError(
            f"plot: expected a file in an existing folder that ends in {endings}, got {path}"
        )
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise DataError(f"plot: matplotlib is not installed; run: {install('plot')}") from error


def write_picture(
    picture: Callable[[Sequence[Row]], Figure], rows: Sequence[Row], path: Path
) -> None:
    """Draw rows into a file, in the format of its ending; see `check_picture`."""
    write_whole(path, render(lambda: picture(rows), path.suffix[1:].lower(), DPI), DataError)


def temperature_picture(rows: Sequence[Row]) -> Figure:
    """Diversity of the candidates and the best J over the temperature (the paper's figure A,
    left)."""
    rows = sorted(rows, key=lambda row: row["temperature"])
    figure, left = _axes("Candidates of the mixture over the temperature of the draw")
    right = left.twinx()
    temperature = [row["temperature"] for row in rows]
    ends = np.array([row["best_j_mean_interval"] for row in rows])
    lines = [
        *left.plot(
            temperature,
            [row["diversity"] for row in rows],
            "o-",
            color=COLORS[0],
            label="diversity",
        ),
        *right.plot(
            temperature,
            [row["best_j_mean"] for row in rows],
            "s--",
            color=COLORS[1],
            label="best J, mean",
        ),
        right.fill_between(
            temperature, *ends.T, color=COLORS[1], alpha=0.1, lw=0, label="its interval"
        ),
    ]
    left.set(xscale="log", xlabel="temperature T", ylabel="diversity [share of the command ranges]")
    left.set_ylim(bottom=0.0)
    right.set(yscale="log", ylabel="best J before refinement")
    for axes, color in ((left, COLORS[0]), (right, COLORS[1])):
        axes.yaxis.label.set_color(color)
    left.legend(
        handles=lines, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False
    )
    return figure


def candidates_picture(rows: Sequence[Row]) -> Figure:
    """Effort over error of raw and refined candidates (the paper's figure A, right). Raises
    DataError: no row has any."""
    figure, axes = _axes("Candidates before and after their refinement")
    marks = {"raw": (COLORS[0], 7, 0.35), "refined": (COLORS[1], 22, 0.9)}
    points = [each for row in rows for each in row.get("points", ())]
    if not points:
        raise DataError("plot: no candidates to draw; take variant ours")
    for name, (color, size, alpha) in marks.items():
        error, effort = np.concatenate([each[name] for each in points]).T
        about: dict[str, Any] = {"s": size, "color": color, "alpha": alpha, "linewidths": 0}
        axes.scatter(
            np.maximum(error, LEAST_ERROR), effort, label=f"{name} ({len(error):,})", **about
        )
    for k, each in enumerate(points):
        error, effort = np.transpose([each["raw"][0], each["refined"][0]])
        label = None if k else "from the best raw one to the best refined one"
        axes.plot(
            np.maximum(error, LEAST_ERROR),
            effort,
            color="0.5",
            linewidth=0.7,
            label=label,
            zorder=1,
        )
    axes.set(xscale="log", xlabel="normalized wrench error, by the surrogate", ylabel="effort J_en")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False)
    return figure


def fins_picture(rows: Sequence[Row]) -> Figure:
    """Error by number of fins, of each split and method (the paper's figure B): median, and the
    range from the 5th to the 95th percentile."""
    rows = [row for row in rows if row.get("fins") is not None]
    figure, axes = _axes("Wrench error by number of fins")
    series = sorted({(row["split"], row["method"]) for row in rows}, key=lambda pair: pair[::-1])
    splits, methods = (list(dict.fromkeys(row[key] for row in rows)) for key in ("split", "method"))
    counts = sorted({row["fins"] for row in rows})
    for k, pair in enumerate(series):
        some = [row for row in rows if (row["split"], row["method"]) == pair]
        place = [counts.index(row["fins"]) + 0.7 * ((k + 0.5) / len(series) - 0.5) for row in some]
        keys = "err_norm_p05", "err_norm_median", "err_norm_p95"
        low, middle, high = np.maximum([[row[key] for key in keys] for row in some], LEAST_ERROR).T
        color = COLORS[methods.index(pair[1]) % len(COLORS)]
        bars: dict[str, Any] = {"yerr": [middle - low, high - middle], "color": color, "capsize": 3}
        bars["fmt"] = MARKERS[splits.index(pair[0]) % len(MARKERS)]
        axes.errorbar(place, middle, label=f"{pair[1]}, {pair[0]}", markersize=5, **bars)
    axes.set_xticks(range(len(counts)), [str(count) for count in counts])
    axes.set(yscale="log", xlabel="number of fins", ylabel="err_norm: median, 5 to 95 %")
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def _axes(title: str) -> tuple[Figure, Axes]:
    """A figure of one panel."""
    figure, axes = panels((7.0, 4.4))
    axes[0, 0].set_title(title)
    return figure, axes[0, 0]


def swim_picture(log: RunLog) -> Figure:
    """The path of one swim from above and its depth over time, with the reference and each loss."""
    figure = paths_picture(
        {log.layout: (log.time, log.reference, {log.method: (log.time, log.position)})}
    )
    above = figure.axes[0]
    for name, works in zip(log.names, log.alive.T, strict=True):
        if not works.all():
            x, y = log.position[int((~works).argmax()), :2]
            above.plot(x, y, "kx", markersize=8)
            above.annotate(f"{name} lost", (x, y), textcoords="offset points", xytext=(6, 6))
    figure.suptitle(f"{log.layout} along {log.task}, controller {log.controller}")
    return figure


def paths_picture(
    swims: Mapping[str, tuple[Array, Array, Mapping[str, tuple[Array, Array]]]],
) -> Figure:
    """Paths from above, and heights over time below them, in one column for each robot.

    Args:
        swims: robot to times (N,) [s] and positions (N, 3) [m] of its reference, and the same of
            each swim by its name; names that begin with one word have one color.
    """
    figure, axes = panels((max(4.2 * len(swims), 6.0), 7.0), 2, len(swims), height_ratios=(3, 1))
    names = [name for _, _, paths in swims.values() for name in paths]
    firsts = list(dict.fromkeys(name.partition(",")[0] for name in names))
    for (above, below), (robot, (time, reference, paths)) in zip(
        axes.T, swims.items(), strict=True
    ):
        above.plot(*reference[:, :2].T, color="0.6", linewidth=3.0, label="reference")
        below.plot(time, reference[:, 2], color="0.6", linewidth=3.0)
        shown: Sequence[str] = list(paths)
        for name in shown:
            color = firsts.index(name.partition(",")[0])
            kin = [other for other in shown if other.partition(",")[0] == firsts[color]]
            look = {
                "color": COLORS[color % len(COLORS)],
                "ls": STYLES[kin.index(name) % len(STYLES)],
            }
            times, swum = paths[name]
            above.plot(*swum[:, :2].T, linewidth=1.2, label=name, **look)
            below.plot(times, swum[:, 2], linewidth=1.2, **look)
        above.set(title=robot, xlabel="x [m]", ylabel="y [m]")
        above.axis("equal")
        above.legend(
            fontsize="small",
            loc="upper center",
            bbox_to_anchor=(0.5, -0.12),
            ncols=2,
            frameon=False,
        )
        below.set(xlabel="time [s]", ylabel="z [m]")
    return figure
