"""Shares that stand for nothing, for nearly all, and for what tables leave; of the default method's numbers,
those that more than one file needs."""

ROUNDING = 1e-12
"""Share of a value that the rounding of sums may take."""
NOTHING = 1e-9
"""Share from which on a thing counts as there: far above rounding, far below what anybody can feel."""
NEARLY = 1e-6
"""Share of a thing that may be missing where it counts as whole."""
FINE = 1e-5
"""Share by which a compiled table may be off between its points."""
CLOSE = 1e-4
"""Share that is not worth another search."""
ROUNDS = 12
"""Most times that something is repeated that mostly settles after a few."""
