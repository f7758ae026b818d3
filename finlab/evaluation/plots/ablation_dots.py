"""The ablation as dots: each row scored by surrogate and plant, beside the printed figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from finlab.evaluation.plots.style import BLACK, BLUE, ORANGE, Picture, clean, picture

COLOUR = {"adam": ORANGE, "levenberg-marquardt": BLUE}


def ablation_dots(
    rows: Sequence[dict[str, Any]], printed: Mapping[str, float], titles: Mapping[str, str]
) -> Picture:
    """Mean normalized error of each row; rows of `ablation_row`, `printed` by variant."""
    variants = list(titles)
    with picture(height=3.1) as view:
        (axis,) = view.axes
        for k, (refinement, colour) in enumerate(COLOUR.items()):
            for scored_by, filled in (("plant", True), ("surrogate", False)):
                mine = [r for r in rows if (r["refinement"], r["scored_by"]) == (refinement, scored_by)]
                axis.plot(
                    [row["err_norm_mean"] for row in mine],
                    [variants.index(row["variant"]) + 0.16 * (2 * k - 1) for row in mine],
                    "o",
                    color=colour,
                    markerfacecolor=colour if filled else "white",
                    markersize=7,
                    label=f"{refinement}, scored by the {scored_by}",
                )
        axis.plot(
            [printed[name] for name in variants],
            range(len(variants)),
            "D",
            color=BLACK,
            markerfacecolor="none",
            markersize=7,
            label="printed in the paper",
        )
        axis.set(xscale="log", xlabel="mean normalized error")
        axis.set_yticks(range(len(variants)), [titles[name] for name in variants])
        axis.invert_yaxis()
        clean(axis)
        view.legend(ncols=3)
        return view
