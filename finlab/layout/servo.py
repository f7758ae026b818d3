"""What drives one fin: how fast it comes to what is commanded."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from msgspec import Meta

from finlab.layout.checked import Checked

Rate = Annotated[float, Meta(ge=1e-3, le=1000.0)]
"""A pole, a speed or a rate [per second]; at most a hundred times what such servos reach."""


@dataclass(frozen=True)
class Servo(Checked):
    """The drive of one fin; what is left out is U-CAT's. Checked on construction.

    Amplitude, frequency and zero direction each follow their command through a critically damped filter with
    a double pole p, x'' = p (p (x* - x) - 2 x'): half of the way is done after 1.7 / p, nine tenths after
    3.9 / p. The defaults are U-CAT's, as far as something is known of them.
    """

    KEYS: ClassVar[Mapping[str, str]] = {
        "amplitude_pole": "amplitude_pole_rad_s",
        "frequency_pole": "frequency_pole_rad_s",
        "direction_pole": "direction_pole_rad_s",
        "speed_limit": "speed_limit_rad_s",
        "amplitude_rate": "amplitude_rate_rad_s",
        "frequency_rate": "frequency_rate_hz_s",
        "direction_rate": "direction_rate_rad_s",
    }

    amplitude_pole: Rate = 7.5
    """Double pole of the amplitude [rad/s]; the oscillators that drive the fins in U-CAT's open simulator
    (eeUVsim) have k_amp = 15, twice the pole."""
    frequency_pole: Rate = 7.5
    """Double pole of the frequency [rad/s]. Our choice: nothing is published, and eeUVsim's oscillators take
    a new frequency at once; but a drive that is to beat faster must gather speed as one that is to beat wider
    must, so it has the pole of the amplitude."""
    direction_pole: Rate = 3.5
    """Double pole of the zero direction [rad/s]; eeUVsim's k_zd = 7."""
    speed_limit: Rate = 4 * math.pi
    """Fastest that the fin turns [rad/s]; two turns a second in U-CAT's UWSim plug-in. It cuts the amplitude
    of fast flapping and slows the turning of a fin that flaps."""

    amplitude_rate: Rate = 1.0
    """How fast the commanded amplitude changes at most from tick to tick [rad/s]: what the filter above
    follows with a delay of two tenths of the amplitude."""
    frequency_rate: Rate = 3.0
    """The same of the commanded frequency [Hz/s]."""
    direction_rate: Rate = 5.0
    """The same of the commanded zero direction [rad/s]. A fin that is commanded to turn back at once pushes
    wherever it points meanwhile; one that is commanded step by step gives the others time to compensate."""
