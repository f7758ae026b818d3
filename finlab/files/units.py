"""Units of strangers' files, by their spellings in lower case, in SI."""

from math import pi

LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 1e-3}
TURNS = {"rad": 1.0, "deg": pi / 180.0, "degrees": pi / 180.0, "°": pi / 180.0}
FORCES = {"n": 1.0, "kn": 1e3, "kgf": 9.80665, "lbf": 4.4482216}
_BENCH = {
    "newton newtons": 1.0, "gf g grams gram-force": 9.80665e-3, "kg kgs kg-f kilograms": FORCES["kgf"],
    "lb lbs lbsf lb-f pounds": FORCES["lbf"], "ozf oz": 0.278014, "watts volts amps": 1.0,
    "us µs μs usec microseconds": 1.0, "ms msec milliseconds": 1e3, "nm n-m": 1.0, "ncm": 0.01,
    "kgfm kgm": 9.80665, "kgcm kgfcm": 0.0980665, "gcm gfcm": 9.80665e-5, "ozin ozfin": 7.06155e-3,
    "inlb inlbf lbin lbfin": 0.112985, "ftlb ftlbf lbft lbfft": 1.35582,
}  # fmt: skip
UNITS = {
    "rad": 1.0, "deg": TURNS["deg"], "°": TURNS["deg"],
    "hz": 1.0, "rpm": 1.0 / 60.0, "bpm": 1.0 / 60.0, "rev/min": 1.0 / 60.0, "rad/s": 0.5 / pi,
    **FORCES, "mn": 1e-3, "w": 1.0, "mw": 1e-3, "kw": 1e3, "v": 1.0, "mv": 1e-3,
    "a": 1.0, "ma": 1e-3, "mnm": 1e-3, "%": 0.01, "-": 1.0,
    **{unit: scale for units, scale in _BENCH.items() for unit in units.split()},
}  # fmt: skip
"""Units that the header of a bench may name (frequencies in Hz, pulses in us)."""
