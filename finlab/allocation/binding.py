"""What keeps a robot from delivering a wrench: limits, rates and dead bands of its actuators, in
words."""

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.axes import axes_in, is_full_turn, wrapped
from finlab.layout.layout import Layout

WITHIN = 1e-3
"""Share of a range, or of what a rate allows in a tick, within which a command is at its end."""
ROUNDING = 1e-9
"""By how much a command may miss the end of a range that has no width."""


def limits_reached(layout: Layout, command: Array) -> tuple[str, ...]:
    """Returns sentences about the actuators of a robot that a command (n, 3) has at their limits.

    Args:
        layout: the robot.
        command: (n, 3), NaN for a lost one.
    """
    full, ended = at_limits(layout, command)
    return limit_words(layout, full, ended)


def at_limits(layout: Layout, command: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Returns which actuators are at full thrust (..., n), and which at the end of their arc (...,
    n).

    Args:
        layout: the robot.
        command: (..., n, 3), NaN for a lost one, which is at neither.
    """
    full, ended = (np.zeros(command.shape[:-1], bool) for _ in range(2))
    for i, part in enumerate(layout.actuators):
        row = command[..., i, :]
        low = np.array(part.lower)
        high = np.array(part.upper)
        pushes = not part.KIND.driven_by_flow
        angle = -1 if part.KIND.aiming_number is None else part.KIND.aiming_number
        angle = angle if pushes else 0  # all that a foil is told
        slack = WITHIN * (high - low) + ROUNDING
        at_low = row <= low + slack
        at_high = row >= high - slack
        sizes = np.arange(3) != angle
        if pushes:
            full[..., i] = (at_high | (at_low & (low < 0.0)))[..., sizes].all(-1)
        if angle >= 0 and not is_full_turn(high[angle] - low[angle]):
            rests = at_low[..., sizes].all(-1) if pushes else False
            ended[..., i] = ~np.asarray(rests) & (at_low | at_high)[..., angle]
    return full, ended


def limit_words(
    layout: Layout, full: NDArray[np.bool_], ended: NDArray[np.bool_]
) -> tuple[str, ...]:
    """Returns the same flags (n,) as sentences."""
    words: list[str] = []
    for name, is_full, is_ended in zip(layout.names, full, ended, strict=True):
        if is_full:
            words.append(f"{name} at full thrust")
        if is_ended:
            words.append(f"{name} at the end of its arc")
    return tuple(words)


def rate_words(layout: Layout, previous: Array, command: Array, period_s: float) -> tuple[str, ...]:
    """Returns sentences about the actuators that changed as fast in a tick as their drives allow.

    Args:
        layout: the robot.
        previous: command (n, 3) of the tick before; NaN for an unknown one.
        command: (n, 3), NaN for a lost one.
        period_s: time between ticks [s].
    """
    words: list[str] = []
    for part, before, now in zip(layout.actuators, previous, command, strict=True):
        step = np.array(part.rates) * period_s
        change = np.abs(now - before)
        if part.KIND.aiming_number is not None:
            change[part.KIND.aiming_number] = abs(
                float(wrapped(now[part.KIND.aiming_number] - before[part.KIND.aiming_number]))
            )
        if (np.isfinite(step) & (change >= (1.0 - WITHIN) * step)).any():
            words.append(f"rate of {part.name}")
    return tuple(words)


def band_words(layout: Layout, command: Array) -> tuple[str, ...]:
    """Returns sentences about the actuators that rest, or are at the edge, of their dead bands, by
    a command (n, 3)."""
    words: list[str] = []
    for part, row in zip(layout.actuators, command, strict=True):
        band = getattr(part, "dead_band", 0.0)
        if (
            band > 0.0
            and part.KIND.force_number is not None
            and abs(row[part.KIND.force_number]) <= (1.0 + WITHIN) * band
        ):
            words.append(f"dead band of {part.name}")
    return tuple(words)


def what_binds(
    layout: Layout, command: Array, missing: Array, previous: Array | None, period_s: float
) -> tuple[str, ...]:
    """Returns sentences about what keeps a robot from delivering what is missing.

    Args:
        layout: the robot.
        command: (n, 3), NaN for a lost one.
        missing: share (6,) of the yardstick that is missing along each axis.
        previous: command (n, 3) of the tick before; None outside of ticks.
        period_s: time between ticks [s].

    Returns:
        Limits, then rates; where there are none of either, dead bands, and then the axes that these
        actuators do not give apart from the others.
    """
    words = limits_reached(layout, command)
    if previous is not None:
        words += rate_words(layout, previous, command, period_s)
    if words:
        return words
    words = band_words(layout, command)
    if words:
        return words
    most = np.abs(missing).max()
    axes = axes_in(np.abs(missing) >= 0.1 * most)
    return (f"{', '.join(axes)} not given apart by these actuators",)
