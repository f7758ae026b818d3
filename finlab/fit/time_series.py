"""A raw series of a load cell - time, angle of the fin, forces - cut into whole cycles and averaged."""

import math

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.conventions import Columns

MIN_AMPLITUDE = 0.02
"""Half amplitude [rad] below which the fin rests."""
PER_CYCLE = 12
"""Fewest samples in a cycle whose mean counts."""
START_UP = 2
"""Cycles after the fin began, or its command changed, in which the water is not yet the cycle's own."""
CHANGE = 0.12
"""Relative change of stroke or period from one cycle to the next that counts as something new."""
SMALL_TURN = 0.06
"""Change of the cycle's middle [rad] that counts as something new."""
GAP = 5.0
"""A step of time this many times the usual one is a gap."""
REST = 0.5
"""Time without motion [s] that counts as rest."""
FLAT = 0.2
"""Share of a cycle spent exactly at the largest or least force from which a sensor counts as saturated."""


def cycle_means(columns: Columns, lines: NDArray[np.intp]) -> tuple[Columns, NDArray[np.intp]]:
    """Returns columns A, f, phi and mean forces with one row per whole cycle, and the line where each begins.

    The angle is the fin's in the plane of its stroke, its middle the zero direction. Where the fin rests
    before, between or after its runs, the forces are the sensor's zero, whose drift is taken off linearly in
    between. The first cycles of each run are thrown away.

    Raises:
        DataError: time runs backwards, a force is flat at its extremes, or there is no settled cycle.
    """
    values, source = columns.values, columns.source
    time, angle = values["t"], values["angle"]
    steps = np.diff(time)
    if (steps <= 0.0).any():
        raise DataError(
            f"{source}: line {lines[1 + int(np.argmax(steps <= 0.0))]}, column t: time runs backwards or "
            "stands still, expected seconds that rise"
        )
    starts = _upward_crossings(time, angle)
    if len(starts) < START_UP + 2:
        raise DataError(
            f"{source}: holds {max(len(starts) - 1, 0)} whole cycles, expected runs of more than {START_UP}, "
            "in which the fin's angle swings through its middle"
        )
    first = np.searchsorted(time, starts)
    _check_flat(columns, lines, first)
    forces = _without_drift(columns, time, angle)
    period = np.diff(starts)
    phase = 2.0 * math.pi * np.interp(time, starts, np.arange(len(starts)))

    def mean(signal: Array) -> Array:
        """Of each cycle, between its very ends."""
        integral = np.concatenate([[0.0], np.cumsum(0.5 * (signal[1:] + signal[:-1]) * steps)])
        return np.asarray(np.diff(np.interp(starts, time, integral)) / period)

    middle = mean(angle)
    # The middle drops out of the products with whole sines.
    size = 2.0 * np.hypot(mean(angle * np.sin(phase)), mean(angle * np.cos(phase)))
    rows = {
        "A": size,
        "f": 1.0 / period,
        "phi": middle,
        **{name: mean(force) for name, force in forces.items()},
    }
    holed = np.maximum.reduceat(np.append(steps, 0.0), first)[:-1] > GAP * float(np.median(steps))
    kept = _settled(rows, holed | (np.diff(first) < PER_CYCLE) | (size < MIN_AMPLITUDE))
    columns.notes.append(
        f"{source}: {kept.sum()} of {len(kept)} cycles are used; the others are start-up, too short "
        "or have gaps"
    )
    if not kept.any():
        raise DataError(
            f"{source}: none of {len(kept)} cycles is settled, expected runs of more than {START_UP} cycles "
            f"with {PER_CYCLE} samples or more each, without gaps"
        )
    chosen = {name: value[kept] for name, value in rows.items()}
    return Columns(chosen, columns.told, source, columns.notes), lines[first[:-1][kept]]


def _settled(rows: dict[str, Array], broken: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which cycles (c,) are whole, and follow `START_UP` others in which the fin did the same."""
    alike = np.abs(np.diff(rows["phi"])) <= SMALL_TURN
    for name in ("A", "f"):
        alike &= np.abs(np.diff(rows[name])) <= CHANGE * rows[name][:-1]
    goes_on = np.concatenate([[False], alike & ~broken[:-1]])
    settled = ~broken
    for back in range(START_UP):
        settled &= np.concatenate([np.zeros(back, dtype=bool), goes_on[: len(goes_on) - back]])
    return np.asarray(settled)


def _upward_crossings(time: Array, angle: Array) -> Array:
    """Times at which the angle passes the middle of its stroke upwards.

    The middle is that between the last extremes: it follows a zero direction that is changed on the way.
    """
    smooth = np.convolve(np.pad(angle, 2, "edge"), np.ones(5) / 5.0, "valid")
    turns = np.flatnonzero(np.diff((np.diff(smooth) > 0.0).astype(int))) + 1
    extremes = [0]
    for turn in [*turns, len(angle) - 1]:
        step = smooth[turn] - smooth[extremes[-1]]
        if len(extremes) > 1 and step * (smooth[extremes[-1]] - smooth[extremes[-2]]) > 0.0:
            extremes[-1] = int(turn)  # still the same way
        elif abs(step) > 2.0 * MIN_AMPLITUDE:
            extremes.append(int(turn))
    crossings = []
    for low, high in zip(extremes[:-1], extremes[1:], strict=True):
        if smooth[high] > smooth[low]:
            middle = 0.5 * (smooth[low] + smooth[high])
            k = low + int(np.argmax(smooth[low : high + 1] >= middle))
            share = (middle - smooth[k - 1]) / (smooth[k] - smooth[k - 1])
            crossings.append(time[k - 1] + share * (time[k] - time[k - 1]))
    return np.array(crossings)


def _without_drift(columns: Columns, time: Array, angle: Array) -> dict[str, Array]:
    """The forces less the sensor's zero, which is what it shows while the fin rests; power as it is."""
    known = ("Fx", "Fy", "Fz", "P")
    forces: dict[str, Array] = {name: columns.values[name] for name in known if name in columns.values}
    window = max(3, round(REST / float(np.median(np.diff(time)))))
    if len(angle) <= window:
        return forces
    still = np.ptp(np.lib.stride_tricks.sliding_window_view(angle, window), axis=-1) < MIN_AMPLITUDE
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int))).reshape(-1, 2)
    if not len(edges):
        columns.notes.append(f"{columns.source}: the fin never rests, so the sensor's zero and drift stay in")
        return forces
    # The water comes to rest after the fin: the second half of each spell counts.
    spells = [slice((begin + end) // 2, end + window - 1) for begin, end in edges]
    places = [float(time[spell].mean()) for spell in spells]
    return {
        name: force
        if name == "P"
        else force - np.interp(time, places, [force[spell].mean() for spell in spells])
        for name, force in forces.items()
    }


def _check_flat(columns: Columns, lines: NDArray[np.intp], first: NDArray[np.intp]) -> None:
    """Refuse forces that stay exactly at their largest or least for a good part of a cycle."""
    samples = np.diff(first)
    for name in ("Fy", "Fz"):
        force = columns.values[name]
        for extreme in (force.max(), force.min()):
            flat = np.add.reduceat((force == extreme).astype(float), first)[:-1] / samples
            saturated = (flat > FLAT) & (samples >= PER_CYCLE)
            if np.ptp(force) > 0.0 and saturated.any():
                begin = first[int(np.argmax(saturated))]
                line = lines[begin + int(np.argmax(force[begin:] == extreme))]
                raise DataError(
                    f"{columns.source}: line {line}, column {name}: stays at exactly {extreme:.4g} N for "
                    f"more than {FLAT:.0%} of a cycle; the sensor is saturated, measure in a wider range"
                )
