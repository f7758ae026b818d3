"""Who leads: the default method against every other one, measure by measure, from the tables' rows.

A method leads another only where their intervals do not overlap: the interval of each says where a rerun with
another seed lands. In every measure less is better.
"""

from collections.abc import Callable, Mapping, Sequence

from finlab.evaluation.statistics.bootstrap import Interval, spread_interval
from finlab.evaluation.statistics.tables import Row

FAMILY = ("search", "search-effort")
"""The default method in its forms, which are not set against each other."""
LEADS, TRAILS, LEVEL, UNKNOWN = "leads", "trails", "neither", "one run"
"""Verdicts: intervals apart, apart the other way, overlapping, and not known from a single run."""


def compare(
    measure: str,
    rows: Sequence[Row],
    value: str,
    case: Callable[[Row], str] | str,
    methods: Sequence[str] = ("search",),
    name: str = "method",
) -> list[Row]:
    """Every method of a table set against the default one.

    Args:
        measure: what the value is, in words.
        rows: of a table; rows without the value are left out.
        value: its key; the interval stands under `<value>_interval` or follows from `<value>_std` and `runs`.
        case: what a row is about, apart from its method, or all of them; only rows of one case are compared.
        methods: forms of the default method that the others are set against.
        name: key of the method's name.

    Returns:
        Rows of `measure`, `case`, `method` and the one it is set `against`, their values `ours` and `theirs`,
        `our_interval` and `their_interval`, which are None where one run does not tell, and the `verdict`.
    """
    known = [row for row in rows if row.get(value) is not None]
    found = {(row[name], case if isinstance(case, str) else case(row)): row for row in known}
    pairs = [
        (where, method, other)
        for method in methods
        for other, where in found
        if (method, where) in found and other not in {*FAMILY, *methods}
    ]
    comparisons: list[Row] = []
    for where, method, other in pairs:
        mine, theirs = found[method, where], found[other, where]
        ends = _interval(mine, value), _interval(theirs, value)
        about = {"measure": measure, "case": where, "method": method, "against": other}
        values = {"ours": mine[value], "theirs": theirs[value], "verdict": _verdict(*ends)}
        comparisons.append({**about, **values, "our_interval": ends[0], "their_interval": ends[1]})
    return comparisons


def with_printed(rows: Sequence[Row], value: str, printed: Mapping[str, float]) -> list[Row]:
    """Rows, and the figures that the paper prints, by method, taken as exact."""
    exact = [{"method": method, value: x, f"{value}_interval": (x, x)} for method, x in printed.items()]
    return [*rows, *exact]


def standings(comparisons: Sequence[Row]) -> list[Row]:
    """One row per measure and pair of methods: the cases in which it `leads`, `trails` or `neither` does."""
    keys = ("measure", "method", "against")
    pairs = dict.fromkeys(tuple(one[key] for key in keys) for one in comparisons if one["verdict"] != UNKNOWN)
    rows = []
    for pair in pairs:
        found = [one for one in comparisons if tuple(one[key] for key in keys) == pair]
        cases = {verdict: _cases(verdict, found) for verdict in (LEADS, TRAILS, LEVEL)}
        rows.append(dict(zip(keys, pair, strict=True)) | cases)
    return rows


def _cases(verdict: str, found: Sequence[Row]) -> str:
    """The cases with a verdict; `all` of several where it is the only one."""
    cases = [one["case"] for one in found if one["verdict"] == verdict]
    return f"all {len(cases)}" if len(cases) == len(found) > 2 else ", ".join(cases)


def _verdict(mine: Interval | None, other: Interval | None) -> str:
    if mine is None or other is None:
        return UNKNOWN
    if mine.high < other.low:
        return LEADS
    return TRAILS if other.high < mine.low else LEVEL


def _interval(row: Row, value: str) -> Interval | None:
    ends = row.get(f"{value}_interval")
    if ends is not None:
        return Interval(*ends)
    return spread_interval(row[value], row[f"{value}_std"], row["runs"]) if row.get("runs", 1) > 1 else None
