"""The file of a fitted thruster: a table of thrust with what a layout says beside it."""

import json
from pathlib import Path

from finlab.fit.thruster_fit import ThrusterFit
from finlab.layout.force_table_file import table_text
from finlab.layout.thrust_model import COLUMNS


def layout_lines(fit: ThrusterFit, path: Path) -> tuple[str, ...]:
    """Returns the keys of a thruster in a layout beside a table at a path."""
    least, most = fit.force
    torque = fit.torque_per_newton
    unit = f", unit: {fit.table.unit}" if fit.table.unit else ""
    name = json.dumps(path.name, ensure_ascii=False)  # text to YAML, whatever it is made of
    lines = (
        f"force_n: [{least:g}, {most:g}]",
        f"dead_band_n: {fit.dead_band:g}" * (fit.dead_band > 0.0),
        f"torque_per_newton_m: {torque:.4g}" * (torque != 0.0),
        f"model: {{type: table, path: {name}{unit}}}",
    )
    return tuple(line for line in lines if line)


def thruster_csv(fit: ThrusterFit, path: Path) -> str:
    """Returns the file's text: lines that begin with # and say what the fit found, a header, the rows."""
    return table_text((*summary(fit), *layout_lines(fit, path)), COLUMNS, fit.table.rows, 12)


def summary(fit: ThrusterFit) -> tuple[str, ...]:
    """Returns what was found, a line each."""
    unit = f" {fit.table.unit}" if fit.table.unit else ""
    least, most = fit.force
    still = f"; none from {fit.still[0]:g} to {fit.still[1]:g}{unit}" if fit.still else ""
    return (f"force {least:.4g} to {most:.4g} N{still}", *fit.notes)
