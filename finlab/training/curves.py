"""Loss curves as a picture, drawn from the log of a run."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from finlab.training.loop import LOG_FILE

CURVES_FILE = "curves.png"
"""Name of the picture beside the log."""
_FIXED = ("step", "samples", "seconds", "learning_rate")


def plot_log(folder: Path) -> Path | None:
    """Draw every loss term of `folder/log.csv` against samples seen; None without matplotlib."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return None
    with (folder / LOG_FILE).open(newline="") as file:
        rows = list(csv.DictReader(file))
    terms = [name for name in rows[0] if name not in _FIXED]
    samples = np.array([float(row["samples"]) for row in rows]) / 1e6
    figure = Figure(figsize=(3.4 * len(terms), 2.8), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    for axis, name in zip(np.atleast_1d(figure.subplots(1, len(terms))), terms, strict=True):
        values = np.array([float(row[name]) for row in rows])
        window = max(1, len(values) // 100)
        smooth = np.convolve(values, np.ones(window) / window, mode="valid")
        axis.plot(samples, values, color="#56B4E9", linewidth=0.5, alpha=0.5)
        axis.plot(samples[window - 1 :], smooth, color="#0072B2", linewidth=1.5)
        axis.set(title=name.replace("_", " "), xlabel="samples seen [million]")
        axis.grid(alpha=0.3)
        if (values > 0).all():
            axis.set_yscale("log")
    path = folder / CURVES_FILE
    figure.savefig(path)
    return path
