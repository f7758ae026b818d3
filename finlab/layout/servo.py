"""What drives one fin: how fast it comes to what is commanded."""

import math
from dataclasses import dataclass, fields

from finlab.layout.rules import number

MAX_RATE = 1000.0
"""Largest pole, speed and rate [per second]; a hundred times what such servos reach."""


@dataclass(frozen=True)
class Servo:
    """The drive of one fin. Checked on construction.

    Amplitude, frequency and zero direction each follow their command through a critically damped filter with
    a double pole p, x'' = p (p (x* - x) - 2 x'): half of the way is done after 1.7 / p, nine tenths after
    3.9 / p. The defaults are U-CAT's, as far as something is known of them.
    """

    amplitude_pole: float = 7.5
    """Double pole of the amplitude [rad/s]; the oscillators that drive the fins in U-CAT's open simulator
    (eeUVsim) have k_amp = 15, twice the pole."""
    frequency_pole: float = 7.5
    """Double pole of the frequency [rad/s]. Our choice: nothing is published, and eeUVsim's oscillators take
    a new frequency at once; but a drive that is to beat faster must gather speed as one that is to beat wider
    must, so it has the pole of the amplitude."""
    direction_pole: float = 3.5
    """Double pole of the zero direction [rad/s]; eeUVsim's k_zd = 7."""
    speed_limit: float = 4 * math.pi
    """Fastest that the fin turns [rad/s]; two turns a second in U-CAT's UWSim plug-in. It cuts the amplitude
    of fast flapping and slows the turning of a fin that flaps."""

    amplitude_rate: float = 1.0
    """How fast the commanded amplitude changes at most from tick to tick [rad/s]: what the filter above
    follows with a delay of two tenths of the amplitude."""
    frequency_rate: float = 3.0
    """The same of the commanded frequency [Hz/s]."""
    direction_rate: float = 5.0
    """The same of the commanded zero direction [rad/s]. A fin that is told to turn back all at once pushes
    wherever it points meanwhile; one that is told step by step leaves the others time to make up for it."""

    def __post_init__(self) -> None:
        for key, name in SERVO_KEYS.items():
            value = number(getattr(self, name), key, high=MAX_RATE, positive=True)
            object.__setattr__(self, name, value)


SERVO_KEYS = {
    f"{field.name}_{'hz' if field.name == 'frequency_rate' else 'rad'}_s": field.name
    for field in fields(Servo)
}
"""Keys of `servo` in a layout file -> fields."""
