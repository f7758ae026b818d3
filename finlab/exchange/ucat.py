"""Commands as the messages of U-CAT's simulator and on-board software hold them.

Their `amplitude` is the angle from one end of the stroke to the other, twice the half amplitude of a finlab
command.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from finlab.errors import CommandError

UCAT_MOTORS = ("front_right", "back_right", "back_left", "front_left")
"""U-CAT's motors 1 to 4, by the names of the shipped layout `ucat`."""


class Flipper(NamedTuple):
    """The fields of one message."""

    motor_number: int
    """Motor, counted from 1."""
    frequency: float
    """[Hz]"""
    zero_direction: float
    """[rad]"""
    amplitude: float
    """From one end of the stroke to the other [rad]: 2A."""
    phase_offset: float = 0.0
    """Phase of the flapping [rad]; a mean force does not depend on it."""


def flippers(
    fins: Sequence[str], command: ArrayLike, motors: Sequence[str] | None = None
) -> tuple[Flipper, ...]:
    """One message for each motor that works, in the order of motor numbers.

    Args:
        fins: names of the fins, in the order of `command`.
        command: (n, 3) half amplitude [rad], frequency [Hz], zero direction [rad]; NaN for failed fins.
        motors: names of the fins by motor number; U-CAT's where the fins bear those names, else the fins' own
            order.

    Raises:
        CommandError: the shapes or names do not fit.
    """
    array = np.asarray(command, dtype=np.float64)
    if array.shape != (len(fins), 3):
        raise CommandError(f"command: expected shape ({len(fins)}, 3), got {array.shape}")
    if motors is None:
        motors = UCAT_MOTORS if sorted(fins) == sorted(UCAT_MOTORS) else fins
    if sorted(motors) != sorted(fins):
        raise CommandError(f"motors: expected each of {', '.join(fins)} once, got {', '.join(motors)}")
    rows = dict(zip(fins, array.tolist(), strict=True))
    return tuple(
        Flipper(number, rows[name][1], rows[name][2], 2.0 * rows[name][0])
        for number, name in enumerate(motors, start=1)
        if np.isfinite(rows[name]).all()
    )
