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
