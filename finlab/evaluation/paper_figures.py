"""Figures that the paper prints, for side-by-side tables; `paper_figures.yaml` names the source of each."""

from functools import cache
from importlib.resources import files
from typing import Any

import yaml


@cache
def paper_figures() -> dict[str, Any]:
    """The whole file, by table."""
    text = files("finlab.evaluation").joinpath("paper_figures.yaml").read_text("utf-8")
    tables: dict[str, Any] = yaml.safe_load(text)
    return tables


def paper_wrench_rows(split: str) -> list[dict[str, Any]]:
    """The paper's wrench-tracking rows of a split as rows of our table; none for splits it does not have.

    `scored_by` is empty because the paper does not name the model that scored it.
    """
    rows = paper_figures()["wrench_tracking"].get(split, {})
    return [
        {"split": split, "method": f"{name} (printed in the paper)", "scored_by": "", **row}
        for name, row in rows.items()
    ]
