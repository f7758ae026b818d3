"""Wrench tracking: how errors are distributed, and the error by number of fins (the paper's figure B)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from finlab.evaluation.plots.style import COLOURS, Picture, mark_printed, picture
from finlab.evaluation.statistics.records import Records

QUANTILES = np.concatenate([np.linspace(0, 0.9, 91), 1 - np.logspace(-1, -5, 60)])
"""At which the distribution is drawn: finer towards the largest errors."""
FLOOR = 1e-8
"""Errors below are drawn here: they are rounding."""


def error_distribution(records: Mapping[str, Mapping[str, Records]], printed: Mapping[str, float]) -> Picture:
    """For each split, the share of targets above each error.

    Args:
        records: split -> method -> records.
        printed: split -> the paper's mean error.
    """
    most = max(len(part) for methods in records.values() for part in methods.values())
    with picture(1, len(records), height=3.4, sharey=True) as view:
        for axis, (split, methods) in zip(view.axes, records.items(), strict=True):
            for method, part in methods.items():
                n = len(part)
                level = QUANTILES[1 - 1 / n >= QUANTILES]
                error = np.maximum(np.quantile(part.err_norm, level), FLOOR)
                # The default lies below those that answer like it, and is seen on both sides of them.
                look: dict[str, Any] = {"linewidth": 1.4}
                if method == "search":
                    look = {"linewidth": 5.0, "alpha": 0.5}
                axis.plot(error, 1 - level, color=COLOURS[method], label=method, **look)
            if split in printed:
                mark_printed(axis, printed[split], "paper's printed mean")
            axis.set(xscale="log", yscale="log", xlabel="normalized error", ylim=(0.5 / most, 1.0))
            axis.set_title(f"split {split}", pad=14)
        view.axes[0].set_ylabel("share of targets above")
        return view


def error_by_fins(records: Mapping[str, Records], order: Sequence[str]) -> Picture:
    """Mean, and the span from median to 95th percentile, for each number of fins."""
    fins = sorted({int(n) for part in records.values() for n in np.unique(part.n_fins)})
    with picture(height=3.3, grid="y") as view:
        (axis,) = view.axes
        shown = [method for method in order if method in records]
        for k, method in enumerate(shown):
            part, offset = records[method], (k - (len(shown) - 1) / 2) * 0.8 / len(shown)
            for n in fins:
                error = np.maximum(part.err_norm[part.n_fins == n], FLOOR)
                if len(error) == 0:
                    continue
                low, high = np.quantile(error, (0.5, 0.95))
                colour = COLOURS[method]
                axis.plot([n + offset] * 2, [low, high], color=colour, linewidth=4, alpha=0.45)
                label = method if n == fins[0] else None
                axis.plot(n + offset, error.mean(), "o", color=colour, markersize=5.5, label=label)
        axis.set(yscale="log", xlabel="working fins", ylabel="normalized error", xticks=fins)
        return view
