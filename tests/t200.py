"""The maker's table of the T200 thruster (Blue Robotics, September 2019), every tenth row, in
newtons."""

COMMAND = tuple(range(1100, 1901, 40))
"""Width of the pulse [us]."""
POWER = {
    12: (
        "204.4 165.8 126.0 88.8 62.0 39.6 21.6 9.6 3.5 0.6 0 0.6 3.6 9.6 21.6 39.6 62.4 90.0 "
        "125.4 164.4 202.9"
    ),
    16: (
        "388.8 309.1 224.6 164.3 110.2 70.4 38.4 19.2 6.4 0.8 0 0.8 6.4 19.2 41.6 73.3 112.0 "
        "166.4 223.8 306.1 381.3"
    ),
    20: (
        "643.5 489.0 355.0 247.2 172.0 103.2 54.2 25.8 10.0 1.0 0 1.0 10.0 24.0 52.6 101.6 170.6 "
        "244.6 350.2 476.0 624.2"
    ),
}
"""Voltage [V] -> electrical power [W]."""
FORCE = {
    12: (
        "-28.48 -25.13 -21.00 -16.99 -13.43 -10.01 -7.07 -4.31 -2.00 -0.36 0 0.40 2.49 5.38 8.76 "
        "12.54 16.77 21.35 26.60 31.98 36.42"
    ),
    16: (
        "-39.91 -35.85 -29.36 -24.06 -19.04 -14.10 -10.01 -6.36 -3.16 -0.67 0 0.76 3.91 8.01 "
        "12.54 17.88 23.84 30.47 37.45 45.59 51.44"
    ),
    20: (
        "-49.38 -42.66 -34.87 -26.82 -21.00 -15.52 -10.45 -6.76 -3.78 -0.89 0 1.11 4.58 8.01 "
        "12.54 18.82 26.11 33.76 44.66 56.00 65.92"
    ),
}
"""Voltage [V] -> force [N]."""


def t200_rows(volts: int) -> tuple[tuple[float, float, float], ...]:
    """Rows of command [us], force [N] and power [W] at a voltage."""
    columns = COMMAND, FORCE[volts].split(), POWER[volts].split()
    return tuple((float(c), float(f), float(p)) for c, f, p in zip(*columns, strict=True))
