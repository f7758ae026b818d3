"""Who leads: the learned allocator against every other method, measure by measure, from the tables' rows.

A method leads another only where their intervals do not overlap: the interval of each says where a rerun with
another seed lands. In every measure less is better.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from finlab.evaluation.statistics.bootstrap import Interval, spread_interval

Row = dict[str, Any]

FAMILY = ("learned", "learned-power", "fast")
"""The learned allocator in its forms, which are not set against each other."""
LEADS, TRAILS, LEVEL, UNKNOWN = "leads", "trails", "neither", "one run"
"""Verdicts: intervals apart, apart the other way, overlapping, and not known from a single run."""


@dataclass(frozen=True)
class Comparison:
    """Two methods in one measure on one case."""

    measure: str
    """What is compared; less is better."""
    case: str
    """Where: a split, a number of fins, a layout, a fault, a speed."""
    method: str
    """A form of the learned allocator."""
    against: str
    """The other method."""
    ours: float
    """The method's value."""
    theirs: float
    """The other's value."""
    our_interval: Interval | None
    """Where a rerun of the method lands; None where one run does not tell."""
    their_interval: Interval | None
    """Where a rerun of the other lands."""

    @property
    def verdict(self) -> str:
        """`leads`, `trails`, `neither`, or `one run`."""
        mine, other = self.our_interval, self.their_interval
        if mine is None or other is None:
            return UNKNOWN
        if mine.high < other.low:
            return LEADS
        return TRAILS if other.high < mine.low else LEVEL


def compare(
    measure: str,
    rows: Sequence[Row],
    value: str,
    case: Callable[[Row], str] | str,
    methods: Sequence[str] = ("learned",),
    name: str = "method",
) -> list[Comparison]:
    """Every method of a table set against the learned allocator.

    Args:
        measure: what the value is, in words.
        rows: of a table; rows without the value are left out.
        value: its key; the interval stands under `<value>_interval` or follows from `<value>_std` and `runs`.
        case: what a row is about, apart from its method, or all of them; only rows of one case are compared.
        methods: forms of the learned allocator that the others are set against.
        name: key of the method's name.
    """
    known = [row for row in rows if row.get(value) is not None]
    found = {(row[name], case if isinstance(case, str) else case(row)): row for row in known}
    return [
        Comparison(
            measure,
            where,
            method,
            other,
            found[method, where][value],
            row[value],
            _interval(found[method, where], value),
            _interval(row, value),
        )
        for method in methods
        for (other, where), row in found.items()
        if (method, where) in found and other not in {*FAMILY, *methods}
    ]


def with_printed(rows: Sequence[Row], value: str, printed: Mapping[str, float]) -> list[Row]:
    """Rows, and the figures that the paper prints, by method, taken as exact."""
    exact = [{"method": method, value: x, f"{value}_interval": (x, x)} for method, x in printed.items()]
    return [*rows, *exact]


def standings(comparisons: Sequence[Comparison]) -> list[Row]:
    """One row per measure and pair of methods: the cases in which it `leads`, `trails` or `neither` does."""
    grouped: dict[tuple[str, str, str], list[Comparison]] = {}
    for one in comparisons:
        grouped.setdefault((one.measure, one.method, one.against), []).append(one)
    return [
        {"measure": measure, "method": f"`{method}`", "against": f"`{against}`"}
        | {verdict: _cases(verdict, found) for verdict in (LEADS, TRAILS, LEVEL)}
        for (measure, method, against), found in grouped.items()
        if any(one.verdict != UNKNOWN for one in found)
    ]


def comparison_rows(comparisons: Sequence[Comparison]) -> list[Row]:
    """Every comparison as a row of a table."""
    return [
        {**vars(one), "verdict": one.verdict, "method": f"`{one.method}`", "against": f"`{one.against}`"}
        for one in comparisons
    ]


def _cases(verdict: str, found: Sequence[Comparison]) -> str:
    """The cases with a verdict; `all` of several where it is the only one."""
    cases = [one.case for one in found if one.verdict == verdict]
    return f"all {len(cases)}" if len(cases) == len(found) > 2 else ", ".join(cases)


def _interval(row: Row, value: str) -> Interval | None:
    ends = row.get(f"{value}_interval")
    if ends is not None:
        return Interval(*ends)
    return spread_interval(row[value], row[f"{value}_std"], row["runs"]) if row.get("runs", 1) > 1 else None
