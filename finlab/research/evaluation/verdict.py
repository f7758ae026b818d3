"""Whether a figure that the paper prints is reproduced: one function decides, for every table."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from finlab.research.evaluation.document import Column, Row, format_digits, format_error

Word = Literal["reproduced", "not", "cannot be decided"]
NEAR = 1.25
"""Figures whose ratio is at most this count as the same: the paper draws other layouts and targets,
and prints no interval."""
TOO_WIDE = 4.0
"""An interval whose ends differ by more than this factor decides nothing."""


@dataclass(frozen=True)
class Verdict:
    """A word, and why."""

    word: Word
    reason: str
    """A sentence."""


@dataclass(frozen=True)
class Comparison:
    """A figure that the paper prints, and ours."""

    what: str
    """What is measured: split, method and statistic."""
    printed: float
    """The figure of the paper."""
    figure: float | None
    """Ours; None where no run of the table measures it."""
    interval: Sequence[float | None] | None = None
    """Where another seed lands [low, high]; None where there is none."""
    obstacle: str = ""
    """A sentence on what else differs between the paper's run and ours, so that the two figures
    cannot be compared; empty where they can."""
    at_least: bool = False
    """Whether the paper says no more than that the figure is at least the printed one."""

    @property
    def verdict(self) -> Verdict:
        """Whether the figure is reproduced."""
        return decide(self.printed, self.figure, self.interval, self.obstacle, self.at_least)

    @property
    def row(self) -> Row:
        """The comparison as a row of a table with the columns `COLUMNS`."""
        verdict = self.verdict
        interval = self.interval
        return {
            "what": self.what,
            "printed": self.printed,
            "figure": self.figure,
            "figure_interval": None if interval is None else list(interval),
            "verdict": verdict.word,
            "reason": verdict.reason,
        }


COLUMNS = (
    Column("what", "printed figure"),
    Column("printed", "in the paper", "error"),
    Column("figure", "here", "error", "figure_interval"),
    Column("verdict", "verdict"),
    Column("reason", "why"),
)
"""Columns of a table of comparisons."""


def decide(
    printed: float,
    figure: float | None,
    interval: Sequence[float | None] | None = None,
    obstacle: str = "",
    at_least: bool = False,
) -> Verdict:
    """Decides whether a printed figure is reproduced.

    Args:
        printed: the figure of the paper.
        figure: ours; None where no run measures it.
        interval: where a run with another seed lands [low, high]; None where it is not known, then
            nearness alone decides.
        obstacle: a sentence on what else differs, so that the figures cannot be compared.
        at_least: whether `printed` is a lower bound.
    """
    if figure is None or not math.isfinite(figure):
        return Verdict("cannot be decided", "No run of this report measures it.")
    if obstacle:
        return Verdict("cannot be decided", obstacle)
    ratio = _ratio(figure, printed)
    ends = _ends(interval)
    if at_least:
        return _decide_bound(printed, figure, ends)
    if ends is not None:
        low, high = ends
        if _ratio(high, low) > TOO_WIDE and low <= printed <= high:
            words = f"{format_error(low)} to {format_error(high)}"
            return Verdict("cannot be decided", f"The interval, {words}, is too wide.")
        if low <= printed <= high:
            return Verdict("reproduced", "The printed figure lies in the interval.")
    if 1.0 / NEAR <= ratio <= NEAR:
        return Verdict("reproduced", "The two differ by less than a quarter.")
    return Verdict("not", f"Ours is {_times(ratio)}.")


def _ends(interval: Sequence[float | None] | None) -> tuple[float, float] | None:
    """The ends of an interval; None where one of them is not known."""
    if interval is None:
        return None
    low, high = interval
    return None if low is None or high is None else (low, high)


def _decide_bound(bound: float, figure: float, ends: tuple[float, float] | None) -> Verdict:
    """Decides whether a figure is at least a printed one."""
    low, high = (figure, figure) if ends is None else ends
    if low >= bound:
        return Verdict("reproduced", "All of the interval lies above.")
    if high < bound:
        return Verdict("not", "All of the interval lies below.")
    return Verdict("cannot be decided", "The bound lies in the interval.")


def _ratio(figure: float, printed: float) -> float:
    """Our figure over the printed one; infinite over zero, and 1 where both are zero."""
    if printed == 0.0:
        return 1.0 if figure == 0.0 else math.inf
    return figure / printed


def _times(ratio: float) -> str:
    """A ratio in words."""
    if ratio <= 0.0 or not math.isfinite(ratio):
        return "of another sign" if ratio < 0.0 else "of another order"
    if ratio > 1.0:
        return f"{_factor(ratio)} times as large"
    return f"{_factor(1.0 / ratio)} times smaller"


def _factor(ratio: float) -> str:
    """A factor above 1 with two digits, or as a power of ten."""
    return format_digits(ratio, 2) if ratio < 1000.0 else f"10^{math.log10(ratio):.0f}"
