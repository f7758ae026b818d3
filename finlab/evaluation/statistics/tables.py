"""Rows (one dict each) as an aligned text table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Row = dict[str, Any]


def columns_of(rows: Sequence[Row]) -> list[str]:
    """Every key that occurs, in order of first appearance."""
    return list(dict.fromkeys(key for row in rows for key in row))


def format_cell(value: object) -> str:
    """A cell as text: small and large numbers with three significant digits, nothing for a missing one, an
    interval in brackets."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(format_cell, value))}]"
    if value is None or isinstance(value, str):
        return value or ""
    if isinstance(value, bool) or not isinstance(value, float):
        return str(value)
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.4f}"
    return f"{value:.2e}"


def text_table(rows: Sequence[Row], columns: Sequence[str] | None = None) -> str:
    """Columns padded with spaces, numbers to the right, a rule under the heading."""
    columns = list(columns or columns_of(rows))
    cells = [[format_cell(row.get(column)) for column in columns] for row in rows]
    widths = [max([len(column), *(len(line[i]) for line in cells)]) for i, column in enumerate(columns)]
    is_text = [any(isinstance(row.get(column), str) for row in rows) for column in columns]

    def line(values: Sequence[str]) -> str:
        padded = (
            value.ljust(width) if text else value.rjust(width)
            for value, width, text in zip(values, widths, is_text, strict=True)
        )
        return "  ".join(padded).rstrip()

    return "\n".join([line(columns), "  ".join("-" * width for width in widths), *map(line, cells)])
