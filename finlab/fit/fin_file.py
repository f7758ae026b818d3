"""The file of a fitted fin: a force table with the uncertainty beside it, and what to know of it."""

import os
from pathlib import Path

import numpy as np

from finlab.errors import DataError
from finlab.fit.fin_fit import FinFit
from finlab.layout.force_table_file import COLUMNS, DEVIATIONS, DOUBT, POWER_COLUMN, table_text
from finlab.whole_file import write_whole

GRID = (13, 13, 18)
"""Amplitudes, frequencies and zero directions of the table, from rest to the largest that was measured."""


def fin_csv(fit: FinFit) -> str:
    """Returns the file's text: lines that begin with # and say what the fit is worth, a header, a grid."""
    command = fit.grid(GRID).reshape(-1, 3)
    force, deviation = fit.predict(command)
    power = fit.predict_power(command)
    table = np.hstack([command, force, *([power[:, None]] if power is not None else []), deviation])
    header = [*COLUMNS, *([POWER_COLUMN] if power is not None else []), *DEVIATIONS]
    return table_text(summary(fit), header, table, 6)


def write_fin(fit: FinFit, path: str | os.PathLike[str]) -> None:
    """Writes a fitted fin to a CSV file that a layout names: `model: {type: table, path: FILE}`.

    Raises:
        DataError: the file cannot be written, or is not called .csv.
    """
    check_table_path(path)
    write_whole(path, fin_csv(fit), DataError)


def check_table_path(path: str | os.PathLike[str]) -> None:
    """Refuse a name that no layout would take for a table; before a fit, which takes seconds.

    Raises:
        DataError: it does not end in .csv.
    """
    if Path(path).suffix.lower() != ".csv":
        raise DataError(f"{path}: a table is a CSV file, expected a name that ends in .csv")


def summary(fit: FinFit) -> tuple[str, ...]:
    """Returns what the fit is worth, a line each; the first says why it should not be trusted, if so."""
    doubts = fit.doubts
    head = (f"{DOUBT}: {'; '.join(doubts)}",) if doubts else ()
    amplitude, frequency = fit.measurements.reach
    deflection = float(np.degrees(fit.deflection))
    return (
        *head,
        f"fitted to {len(fit.measurements)} samples, amplitudes up to {amplitude:.3g} rad, frequencies up to "
        f"{frequency:.3g} Hz, forces up to {fit.largest:.3g} N",
        f"cross-validated error {fit.error():.1%} of the largest force, noise of a sample {fit.noise():.1%}; "
        f"{fit.coverage():.0%} of the samples lie in the 95 % band of the fit to the others",
        f"thrust leans {deflection:+.1f} deg off the zero direction",
        *fit.notes,
    )
