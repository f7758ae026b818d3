"""Benches at several voltages: which rows are of one voltage, and what lies between two of them."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.columns import together

Rows = Mapping[str, Array]
"""Columns of a bench by name (n,), with `command`, `force` and `power`."""
NEAR = 0.05
"""Share by which voltages of one supply may differ."""
WITHIN = 0.3
"""Share of the commands at a voltage within those at a higher one, from which on the two are two tables."""


def by_voltage(rows: Rows, command: Array) -> list[Rows]:
    """Returns the rows of one table, apart where it was measured at several voltages, commands (n,).

    A supply that sags under load is one: there commands of a lower voltage lie beyond those of a higher one.
    """
    volts = np.abs(rows["voltage"])
    parts = _levels(volts)
    tables = [parts[-1]]
    for part in parts[-2::-1]:
        higher = command[tables[-1]]
        if np.mean((command[part] >= higher.min()) & (command[part] <= higher.max())) > WITHIN:
            tables.append(part)
        else:
            tables[-1] = np.concatenate([part, tables[-1]])
    return [{name: values[np.sort(table)] for name, values in rows.items()} for table in tables]


def at_voltage(tables: Sequence[Rows], voltage: float | None, source: str) -> tuple[Rows, tuple[str, ...]]:
    """Returns the rows of one voltage [V], None where there is only one, and notes on what was done.

    Each table is of one voltage, by its middle in column `voltage`; without that column of any. Raises
    DataError: there are several and none is named, or that one does not lie among them; `source` has the
    names of the files."""
    known = np.array([np.median(np.abs(rows["voltage"])) if "voltage" in rows else np.nan for rows in tables])
    groups = _levels(known)
    if np.isnan(known).any() and (voltage is not None or len(groups) > 1):
        raise DataError(f"{source}: does not tell at which voltage all rows were measured")
    levels = np.array([np.median(known[own]) for own in groups])
    named = f"measured at {', '.join(f'{level:.4g}' for level in levels)} V"
    if voltage is None and len(groups) > 1:
        raise DataError(f"{source}: {named}; say which counts, --voltage {levels[-1]:.4g}")
    within = [together([tables[k] for k in own]) for own in groups]
    if voltage is None:
        return within[0], ()
    near = int(np.argmin(np.abs(levels - voltage)))
    if abs(voltage - levels[near]) <= 0.5 * NEAR * levels[near]:
        return within[near], (f"{named}: the rows at {levels[near]:.4g} V are taken",) * (len(groups) > 1)
    if not levels[0] < voltage < levels[-1]:
        raise DataError(f"{source}: {named}, which tells nothing of {voltage:g} V")
    upper = int(np.searchsorted(levels, voltage))
    low, high = levels[upper - 1 : upper + 1].tolist()
    rows = _between(within[upper - 1], within[upper], (voltage - low) / (high - low))
    return rows, (f"interpolated between the rows at {low:.4g} V and at {high:.4g} V",)


def _levels(volts: Array) -> list[NDArray[np.intp]]:
    """Places of voltages (n,) that are one, the lowest first."""
    order = np.argsort(volts, kind="stable")
    steps = np.diff(volts[order]) > NEAR * volts[order][1:]
    return np.split(order, np.flatnonzero(steps) + 1)


def _between(low: Rows, high: Rows, share: float) -> Rows:
    """The table at a share of the way from one to the other, over commands that both reach."""
    ends = [(rows["command"].min(), rows["command"].max()) for rows in (low, high)]
    first, last = max(own[0] for own in ends), min(own[1] for own in ends)
    places = np.unique(np.concatenate([low["command"], high["command"]]))
    places = places[(places >= first) & (places <= last)]

    def means(rows: Rows, name: str) -> Array:
        at, where, count = np.unique(rows["command"], return_inverse=True, return_counts=True)
        return np.asarray(np.interp(places, at, np.bincount(where, rows[name]) / count))

    names = [name for name in low if name in high]
    return {name: (1.0 - share) * means(low, name) + share * means(high, name) for name in names}
