"""Loads of wind, current and waves on a ship by DNV-ST-0111 (December 2021), level 1.

Frame of the standard ([2.8.2]): x forward, y to port, z up from the middle of the length between
perpendiculars. Headings are where the weather comes from, clockwise: 0 from ahead, 90 degrees from
starboard. Wind, current and waves come from the same heading ([3.3.1]).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from finlab.analysis.ship_file import Ship
from finlab.arrays import Array

AIR_DENSITY = 1.226
"""[3.5] [kg/m3]."""
WATER_DENSITY = 1026.0
"""[3.6] [kg/m3]."""
GRAVITY = 9.81
"""Of [3.7], which gives no value [m/s2]."""
DYNAMIC_FACTOR = 1.25
"""What all loads are multiplied by at level 1 ([3.2.2])."""
PEAK_OVER_ZERO_CROSSING = 1.4049
"""Peak period over zero-up-crossing period of the waves ([3.3.3])."""


class Weather(NamedTuple):
    """Conditions of one DP capability number."""

    wind: float
    """Mean wind speed 10 m above the sea [m/s]."""
    wave_height: float
    """Significant height of the waves [m]."""
    peak_period: float
    """Of the waves [s]; any without waves."""
    current: float
    """Speed of the current [m/s]."""

    @property
    def zero_crossing_period(self) -> float:
        """Zero-up-crossing period of the waves [s]."""
        return self.peak_period / PEAK_OVER_ZERO_CROSSING


WEATHER = (
    Weather(0.0, 0.0, 1.0, 0.0),
    Weather(1.5, 0.1, 3.5, 0.25),
    Weather(3.4, 0.4, 4.5, 0.5),
    Weather(5.4, 0.8, 5.5, 0.75),
    Weather(7.9, 1.3, 6.5, 0.75),
    Weather(10.7, 2.1, 7.5, 0.75),
    Weather(13.8, 3.1, 8.5, 0.75),
    Weather(17.1, 4.2, 9.0, 0.75),
    Weather(20.7, 5.7, 10.0, 0.75),
    Weather(24.4, 7.4, 10.5, 0.75),
    Weather(28.4, 9.5, 11.5, 0.75),
    Weather(32.6, 12.1, 12.0, 0.75),
)
"""Of the DP capability numbers 0 to 11, which are Beaufort's (Table 2-1)."""


def folded(heading: Array) -> Array:
    """Returns headings [rad] from port as those from starboard, which the levers depend on."""
    turned = heading % (2.0 * np.pi)
    return np.where(turned <= np.pi, turned, 2.0 * np.pi - turned)


def wind_load(ship: Ship, speed: float, heading: Array) -> Array:
    """Returns the loads (H, 3) of the wind: Fx, Fy [N] and Mz [N m] ([3.5])."""
    q = 0.5 * AIR_DENSITY * speed**2
    force_x = -0.7 * q * ship.wind.frontal_area_m2 * np.cos(heading)
    force_y = 0.9 * q * ship.wind.lateral_area_m2 * np.sin(heading)
    shift = 0.3 * (1.0 - 2.0 * folded(heading) / np.pi)
    lever = ship.wind.lateral_center_m + shift * ship.length_pp_m
    return np.stack([force_x, force_y, force_y * lever], axis=-1)


def current_load(ship: Ship, speed: float, heading: Array) -> Array:
    """Returns the loads (H, 3) of the current: Fx, Fy [N] and Mz [N m] ([3.6])."""
    q = 0.5 * WATER_DENSITY * speed**2
    force_x = -0.07 * q * ship.breadth_m * ship.draft_m * np.cos(heading)
    force_y = 0.6 * q * ship.current.lateral_area_m2 * np.sin(heading)
    shift = np.clip(0.4 * (1.0 - 2.0 * folded(heading) / np.pi), -0.2, 0.25)
    lever = ship.current.lateral_center_m + shift * ship.length_pp_m
    return np.stack([force_x, force_y, force_y * lever], axis=-1)


def wave_load(ship: Ship, height: float, zero_crossing_period: float, heading: Array) -> Array:
    """Returns the drift loads (H, 3) of the waves: Fx, Fy [N] and Mz [N m] ([3.7])."""
    q = 0.5 * WATER_DENSITY * GRAVITY * height**2
    share_of_half_turn = folded(heading) / np.pi
    half_plane = 0.5 * ship.length_pp_m * ship.breadth_m
    fullness = np.clip(ship.waterline.aft_area_m2 / half_plane, 0.85, 1.15)
    h1_bow = 0.8 * np.deg2rad(ship.waterline.bow_angle_deg) ** 0.45
    h1_stern = 0.7 * fullness**2
    h1 = h1_bow + share_of_half_turn * (h1_stern - h1_bow)
    h2 = 0.05 + 0.95 * np.arctan(1.45 * (folded(heading) - 1.75))
    surge_period = zero_crossing_period / (0.9 * ship.length_pp_m**0.33)
    sway_period = zero_crossing_period / (0.75 * ship.breadth_m**0.5)
    length = ship.waterline.length_m
    force_x = 0.09 * q * ship.breadth_m * h1 * h2 * _reflected(surge_period)
    force_y = 0.09 * q * length * np.sin(heading) * _reflected(sway_period)
    lever = ship.waterline.center_m + (0.05 - 0.14 * share_of_half_turn) * length
    return np.stack([force_x, force_y, force_y * lever], axis=-1)


def _reflected(period: float) -> float:
    """The factor f(T') of a period over that of the hull: long waves lift it and pass."""
    if period < 1.0:
        return 1.0
    inverse_cube = period**-3
    return float(inverse_cube * np.exp(1.0 - inverse_cube))


def total_load(ship: Ship, weather: Weather, heading: Array) -> Array:
    """Returns the loads (H, 3) of wind, current and waves with the dynamic factor: Fx, Fy [N] and
    Mz [N m] about the middle of the ship.

    Args:
        ship: its particulars.
        weather: conditions of a DP capability number.
        heading: where the weather comes from (H,) [rad], clockwise.
    """
    wind = wind_load(ship, weather.wind, heading)
    current = current_load(ship, weather.current, heading)
    waves = wave_load(ship, weather.wave_height, weather.zero_crossing_period, heading)
    return DYNAMIC_FACTOR * (wind + current + waves)
