"""What the columns of a fin's load cell are called, and which values no fin has.

Inside finlab an amplitude is half the stroke in radians, a frequency is in Hz, and forces are in the fin
frame: x' along the shaft, y' the horizontal thrust axis, z' up.
"""

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout.fin import MAX_AMPLITUDE, MAX_FREQUENCY

NEEDED = ("A", "f", "Fy", "Fz")
"""Columns without which no fin can be fitted."""
NAMES = {
    "a": "A", "amplitude": "A", "stroke": "A", "f": "f", "frequency": "f",
    "phi": "phi", "zero_direction": "phi", "direction": "phi",
    "fx": "Fx", "fy": "Fy", "fz": "Fz", "p": "P", "power": "P",
    "sfx": "sFx", "sfy": "sFy", "sfz": "sFz", "fx_sd": "sFx", "fy_sd": "sFy", "fz_sd": "sFz",
    "fx_std": "sFx", "fy_std": "sFy", "fz_std": "sFz",
}  # fmt: skip


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
