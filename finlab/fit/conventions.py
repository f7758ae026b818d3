"""Units of a load cell's file, as its header names them.

Inside finlab an amplitude is half the stroke in radians, a frequency is in Hz, and forces are in the fin
frame: x' along the shaft, y' the horizontal thrust axis, z' up.
"""

import math
import re

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout.angles import TURN
from finlab.layout.fin import MAX_AMPLITUDE, MAX_FREQUENCY

UNITS = {
    "rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0,
    "hz": 1.0, "rpm": 1.0 / 60.0, "bpm": 1.0 / 60.0, "rev/min": 1.0 / 60.0, "rad/s": 1.0 / TURN,
    "n": 1.0, "mn": 1e-3, "gf": 9.80665e-3, "w": 1.0, "mw": 1e-3,
}  # fmt: skip
"""Units that a header may name, in SI (frequencies in Hz)."""

NAMES = {
    "a": "A", "amplitude": "A", "stroke": "A", "f": "f", "frequency": "f",
    "phi": "phi", "zero_direction": "phi", "direction": "phi",
    "fx": "Fx", "fy": "Fy", "fz": "Fz", "p": "P", "power": "P",
    "sfx": "sFx", "sfy": "sFy", "sfz": "sFz", "fx_sd": "sFx", "fy_sd": "sFy", "fz_sd": "sFz",
    "fx_std": "sFx", "fy_std": "sFy", "fz_std": "sFz",
}  # fmt: skip


def named_column(header: str) -> tuple[str, float]:
    """Returns what a header cell stands for and its unit in SI, where it has one: `A [deg]`, `amplitude_deg`,
    `f (rpm)`, `Fx`; "" for what no fit reads. A `stroke` is the angle from end to end, twice the
    amplitude."""
    parts = re.fullmatch(r"\s*([A-Za-z_]+?)\s*(?:[\[(](.+)[\])]|_(deg|rad|hz|rpm|mN|N|W|mW))?\s*", header)
    if parts is None:
        return "", 1.0
    name = NAMES.get(parts[1].lower(), "")
    unit = (parts[2] or parts[3] or "").strip().lower()
    share = 0.5 if parts[1].lower() == "stroke" else 1.0
    return name, share * UNITS.get(unit, 1.0)


def check_units(values: dict[str, Array], source: str) -> None:
    """Refuses amplitudes [rad] and frequencies [Hz] that no fin has, as in a file in other units.

    Raises:
        DataError: there is such a value; the sentence says how to name the unit.
    """
    for name, most, unit, told in (("A", MAX_AMPLITUDE, "rad", "deg"), ("f", MAX_FREQUENCY, "Hz", "rpm")):
        low, high = float(values[name].min()), float(values[name].max())
        if high > most + 1e-9 or low < 0.0:
            what = "half amplitudes" if name == "A" else "frequencies"
            raise DataError(
                f"{source}: {what} from {low:.4g} to {high:.4g} {unit}, expected 0 to {most:.4g}; name "
                f"another unit in the header, `{name} [{told}]`"
                + ", and call whole strokes `stroke`"
                * (name == "A")
            )
