"""The plotter: figures of panels by matplotlib, and their files.

Every picture of the library is drawn with it: of robots and forces (`pictures.py`), of swims, of
experiments, of logs and of trainings. matplotlib (extra `plot`) is imported when one is drawn. The
app draws its own plots as SVG, which follow its theme and sliders.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from finlab.arrays import Array
from finlab.assets import install_command
from finlab.errors import DataError
from finlab.whole_file import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's, which most people can tell apart."""
FORMATS = (".png", ".svg", ".pdf")
"""Endings of the files that are written."""
SCREEN_DPI = 80
"""Pixels per inch of a picture in a notebook."""
FILE_DPI = 150
"""Pixels per inch of a picture in a file."""
SIDE_MIN = 0.15
"""Least side of a drawn space, as a share of its longest."""
MARGIN = 0.05
"""What is left free on both sides of a drawn space, as a share of its side."""


def figure_bytes(make: Callable[[], Figure], form: str, dpi: int = SCREEN_DPI) -> bytes:
    """Draws a figure. Text in it is no formula: it may be a stranger's.

    Args:
        make: makes the figure.
        form: png, svg or pdf.
        dpi: pixels per inch.

    Returns:
        The content of the file.

    Raises:
        ImportError: matplotlib is not installed.
    """
    import matplotlib

    content = io.BytesIO()
    with matplotlib.rc_context({"text.parse_math": False}):
        figure = make()
        _plain_logarithms(figure)
        figure.savefig(content, format=form, dpi=dpi, bbox_inches="tight")
    return content.getvalue()


def _plain_logarithms(figure: Figure) -> None:
    """Lets logarithmic axes have plain numbers: those that matplotlib gives them are formulas."""
    from matplotlib.ticker import LogFormatter

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == "log":
                axis.set_major_formatter(LogFormatter())
                axis.set_minor_formatter(LogFormatter())


def check_figure_file(path: Path | None) -> None:
    """Refuses, before the work, a picture that could not be written after it.

    Args:
        path: the file, or None where no picture is asked for.

    Raises:
        DataError: matplotlib is not installed, the folder is missing, or the name has another
            ending than those of `FORMATS`.
    """
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
        raise DataError(
            f"plot: matplotlib is not installed; run: {install_command('plot')}"
        ) from error


def write_figure(make: Callable[[], Figure], path: Path) -> None:
    """Draws a figure into a file, in the format of its ending.

    Args:
        make: makes the figure.
        path: the file; see `check_figure_file`.
    """
    write_whole(path, figure_bytes(make, path.suffix[1:].lower(), FILE_DPI), DataError)


def panels(
    size: tuple[float, float], rows: int = 1, columns: int = 1, **how: Any
) -> tuple[Figure, Any]:
    """Returns a figure and its panels (rows, columns), with grids.

    Args:
        size: width and height [inches].
        rows: of panels.
        columns: of panels.
        how: further arguments of matplotlib's `subplots`.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes: Any = figure.subplots(rows, columns, squeeze=False, **how)
    for each in axes.flat:
        each.grid(alpha=0.3)
        each.set_axisbelow(True)
    return figure, axes


def space(title: str, points: Array, unit: str) -> tuple[Figure, Any]:
    """Returns a figure with three axes of one scale.

    Args:
        title: of the figure.
        points: what must be within (N, 3).
        unit: of the axes.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.6, 4.8), layout="constrained")
    axes: Any = figure.add_subplot(projection="3d")
    low = points.min(axis=0)
    high = points.max(axis=0)
    center = (low + high) / 2
    span = np.maximum(high - low, max(SIDE_MIN * float((high - low).max()), 1e-9))
    half = (0.5 + MARGIN) * span
    ends = zip(center - half, center + half, strict=True)
    axes.set(**dict(zip(("xlim", "ylim", "zlim"), ends, strict=True)))
    axes.set_box_aspect(span)
    axes.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]", zlabel=f"z [{unit}]")
    axes.set_title(title)
    axes.locator_params(nbins=4)
    return figure, axes
