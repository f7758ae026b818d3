"""The time of a log that counts: while the robot was armed and in the water.

A robot on deck has demands, too: its controllers run, and its motors may be tested. Readers say
when it was armed, and what the log knows of landing or of depth.
"""

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array
from finlab.errors import DataError
from finlab.log.recorded import LogRecord, Series

UNDER_WATER_M = 0.3
"""Depth from which on a robot is in the water for sure [m]."""


def by_changes(time: AnyArray, state: AnyArray) -> Series | None:
    """Returns flags over time by messages of change, before the first of which the opposite held.

    Args:
        time: times of the changes (N,) [s].
        state: the state that each begins (N,), 0 or 1.

    Returns:
        Flags (N + 1, 1); None where nothing changes.
    """
    if not len(time):
        return None
    changes = Series.of(np.asarray(time), np.asarray(state)[:, None])
    before = 1.0 - changes.values[:1]
    return Series(np.append(-np.inf, changes.time), np.vstack([before, changes.values]))


def by_samples(time: AnyArray, state: AnyArray) -> Series | None:
    """Returns flags over time by samples of a state, of which the first holds before it, too.

    Args:
        time: times of the samples (N,) [s].
        state: the state (N,), 0 or 1.

    Returns:
        Flags (N + 1, 1); None without samples.
    """
    if not len(time):
        return None
    samples = Series.of(np.asarray(time), np.asarray(state)[:, None])
    return Series(np.append(-np.inf, samples.time), np.vstack([samples.values[:1], samples.values]))


def by_depth(time: AnyArray, depth: AnyArray) -> Series | None:
    """Returns flags over time: in the water from the first moment under it to the last.

    What lies before and after may be on deck; a robot that came up in between is in the water.

    Args:
        time: times of the samples (N,) [s].
        depth: depths (N,) [m], positive under water.

    Returns:
        Flags (3, 1); None where it never was under water.
    """
    is_under = np.flatnonzero(np.asarray(depth) > UNDER_WATER_M)
    if not len(is_under):
        return None
    edges = np.array([-np.inf, time[is_under[0]], time[is_under[-1]]])
    return Series.of(edges, np.array([[0.0], [1.0], [0.0]]))


def working_time(
    source: str, record: LogRecord, time: Array, notes: list[str]
) -> NDArray[np.bool_] | None:
    """Returns which samples count.

    Args:
        source: the name of the file, for the errors.
        record: the record of the log.
        time: times of the samples (N,) [s].
        notes: takes sentences on what does not count.

    Returns:
        Flags (N,); None where the log does not say when the robot was armed or in the water.

    Raises:
        DataError: it never was armed.
    """
    if record.armed is None and record.in_water is None:
        return None
    counts = np.ones(len(time), bool)
    step = np.diff(time, append=time[-1:])
    if record.armed is not None:
        counts &= record.armed.at(time)[:, 0] > 0.0
        if not counts.any():
            raise DataError(
                f"{source}: the robot was disarmed in all of it; --whole judges it nevertheless"
            )
        disarmed_s = step[~counts].sum()
        if disarmed_s > 0.0:
            notes.append(f"{disarmed_s:.1f} s at which it was disarmed are left out.")
    if record.in_water is None:
        return counts
    is_in_water = record.in_water.at(time)[:, 0] > 0.0
    if not (counts & is_in_water).any():
        notes.append("It says that the robot never left the ground: all of the time armed counts.")
        return counts
    landed_s = step[counts & ~is_in_water].sum()
    if landed_s > 0.0:
        notes.append(
            f"{landed_s:.1f} s before it was in the water, or after it had landed, are left out."
        )
    return counts & is_in_water
