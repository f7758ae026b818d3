"""Paths over time that a robot follows, shipped or from a file, and places that it keeps."""

import math
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.axes import TURN
from finlab.errors import DataError
from finlab.files.csv_table import read_table
from finlab.swim.control import Setpoint

RAMP_S = 6.0
"""Time in which a shipped trajectory picks up its speed from rest [s]."""
STEP_S = 0.05
"""Spacing of the samples of a shipped trajectory [s]."""
SLOPE_S = (0.2, 1.0)
"""Least and most time on both sides from which a trajectory's velocity and acceleration are taken
[s]."""
RESTING_SPEED = 0.005
"""Horizontal speed [m/s] below which a trajectory counts as resting."""
SHORTEST_S = 1.0
"""Least duration [s]; ten control periods."""
MAX_BYTES = 20_000_000
"""Largest trajectory file."""
MAX_SCALE = 1000.0
"""Largest factor of a path."""
PathPoints = tuple[Array | float, Array | float, Array | float]
"""x, y and z of points of a path [m], each (N,) or one number for all."""
COLUMNS = ("t", "x", "y", "z")
"""Columns of a trajectory file: time [s], position in the world [m]."""


class Trajectory:
    """Positions at times, with straight lines between them."""

    def __init__(self, name: str, time: Array, position: Array) -> None:
        """Takes the samples of a path.

        Args:
            name: of the trajectory.
            time: rising times (N,) from 0 [s].
            position: at these, in the world (N, 3) [m].

        Raises:
            DataError: fewer than two samples, less than a second, times that do not rise from 0, or
                values that are not finite.
        """
        time = np.asarray(time, np.float64)
        position = np.asarray(position, np.float64)
        if len(time) < 2 or position.shape != (len(time), 3):
            raise DataError(
                f"trajectory {name}: expected at least two samples of t, x, y, z, got {len(time)} "
                f"times and positions of shape {position.shape}"
            )
        if not (np.isfinite(time).all() and np.isfinite(position).all()):
            raise DataError(f"trajectory {name}: expected finite numbers, got NaN or infinity")
        if time[0] != 0.0:
            raise DataError(
                f"trajectory {name}: expected times that rise from 0, got {time[0]:g} first"
            )
        is_rising = np.diff(time) > 0.0
        if not is_rising.all():
            k = int(np.argmin(is_rising))
            raise DataError(
                f"trajectory {name}: expected times that rise from 0, got {time[k]:g} before "
                f"{time[k + 1]:g}"
            )
        if time[-1] < SHORTEST_S:
            raise DataError(
                f"trajectory {name}: expected at least {SHORTEST_S:g} s, got {time[-1]:g}"
            )
        self.name = name
        self.time = time
        self.samples = position
        self.duration_s = float(time[-1])
        # Over less than the samples' spacing the acceleration would be a row of spikes.
        self._slope_s = float(np.clip(np.median(np.diff(time)), *SLOPE_S))
        change = np.diff(position, axis=0)
        spacing = np.diff(time)
        # Of the piece from each sample on; the last one stands still.
        self._slopes = np.zeros_like(position)
        self._slopes[:-1] = change / spacing[:, None]
        # Pieces of the path that do not rest, and their headings.
        self._moves = np.flatnonzero(np.hypot(*change[:, :2].T) > RESTING_SPEED * spacing)
        self._headings = np.arctan2(change[self._moves, 1], change[self._moves, 0])

    def position(self, time: float | Array) -> Array:
        """Position (..., 3) [m] at times (...,) [s]; beyond the ends as at the ends."""
        time_within = np.clip(time, 0.0, self.duration_s)
        piece = np.searchsorted(self.time, time_within, side="right") - 1
        into_piece = time_within - self.time[piece]
        return np.asarray(self.samples[piece] + self._slopes[piece] * into_piece[..., None])

    def setpoint(self, time: float) -> Setpoint:
        """Position, velocity and acceleration at `time` [s]; after the end at rest."""
        return self.setpoints(np.array([time]))[0]

    def setpoints(self, times: Array) -> list[Setpoint]:
        """Position, velocity and acceleration at each of K times (K,) [s]; after the end at
        rest."""
        # A path may end under way: what would stop it there within a moment is no part of it.
        dt = self._slope_s
        middle = np.minimum(times, self.duration_s - dt)
        position, behind, between, ahead = self.position(
            np.stack([times, middle - dt, middle, middle + dt])
        )
        is_over = times > self.duration_s
        # Central differences.
        velocity = (ahead - behind) / (2 * dt)
        acceleration = (ahead - 2 * between + behind) / dt**2
        velocity[is_over] = 0.0
        acceleration[is_over] = 0.0
        speed = np.sqrt((velocity * velocity).sum(axis=-1)).tolist()
        onward = self._onward(times)
        setpoints = []
        for k in range(len(times)):
            setpoints.append(
                Setpoint(position[k], speed[k], velocity[k], acceleration[k], onward[k])
            )
        return setpoints

    def _onward(self, times: Array) -> list[float]:
        """Headings [rad] of the first pieces from times (K,) [s] on that do not rest; else that of
        the last."""
        if not len(self._moves):
            return [math.nan] * len(times)
        piece = np.searchsorted(self.time, times, side="right") - 1
        following = np.searchsorted(self._moves, piece)
        headings: list[float] = self._headings[
            np.minimum(following, len(self._headings) - 1)
        ].tolist()
        return headings

    def start(self) -> tuple[Array, float]:
        """The first position, and the heading of the first horizontal metre or of what there is."""
        distance = np.hypot(*(self.samples[:, :2] - self.samples[0, :2]).T)
        first = int(np.argmax(distance > min(0.05, 0.5 * float(distance.max()))))
        dx, dy = self.samples[first, :2] - self.samples[0, :2]
        return self.samples[0].copy(), math.atan2(dy, dx)


def _eased(name: str, duration_s: float, path: Callable[[Array], PathPoints]) -> Trajectory:
    """A trajectory along a path, from rest to a steady speed within `RAMP_S`.

    Args:
        name: of the trajectory.
        duration_s: how long it takes [s].
        path: from shares of the path, 0 to 1, to its points.
    """
    time = np.arange(0.0, duration_s + STEP_S / 2, STEP_S)
    ramp = np.clip(time / RAMP_S, 0.0, 1.0)
    # Integral of a smoothstep from 0 to 1, then straight on.
    arc = np.where(time < RAMP_S, RAMP_S * (ramp**3 - 0.5 * ramp**4), time - 0.5 * RAMP_S)
    points = np.broadcast_arrays(*path(arc / arc[-1]))
    return Trajectory(name, time, np.stack(points, axis=-1))


def circle(duration_s: float = 60.0) -> Trajectory:
    """One round of 1.2 m radius at 1 m depth, 0.13 m/s."""
    return _eased(
        "circle",
        duration_s,
        lambda share: (1.2 * np.sin(TURN * share), 1.2 * (1.0 - np.cos(TURN * share)), -1.0),
    )


def lissajous(duration_s: float = 90.0) -> Trajectory:
    """An eight of 3 m by 1.5 m whose depth swings by 0.25 m about 1 m twice in a round."""

    def eight(share: Array) -> PathPoints:
        twice = 2.0 * TURN * share
        return (
            1.5 * np.sin(TURN * share),
            0.75 * np.sin(twice),
            -1.0 + 0.125 * (np.cos(twice) - 1.0),
        )

    return _eased("lissajous", duration_s, eight)


def square(duration_s: float = 90.0) -> Trajectory:
    """A square of 2 m a side; the reference rests at each corner while the robot turns."""
    rest = 0.08 * duration_s
    leg = (duration_s - 4 * rest) / 4
    corners = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]], dtype=np.float64)
    time = [0.0]
    points = [corners[0]]
    for corner, following in zip(corners[:-1], corners[1:], strict=True):
        for share in np.linspace(0.0, 1.0, 41)[1:]:
            time.append(time[-1] + leg / 40)
            points.append(corner + share * share * (3.0 - 2.0 * share) * (following - corner))
        time.append(time[-1] + rest)
        points.append(following)
    path = np.column_stack([np.array(points), np.full(len(points), -1.0)])
    return Trajectory("square", np.array(time), path)


def dive(duration_s: float = 60.0) -> Trajectory:
    """Straight ahead for 6 m, down from 1 m to 2 m and up again, at slopes of up to 28 degrees."""
    return _eased(
        "dive",
        duration_s,
        lambda share: (6.0 * share, 0.0, -1.0 - 0.5 * (1.0 - np.cos(TURN * share))),
    )


def straight(duration_s: float = 60.0, speed: float = 0.15) -> Trajectory:
    """Straight ahead at 1 m depth, from rest to a speed [m/s]."""
    length = speed * (duration_s - 0.5 * RAMP_S)
    return _eased(
        f"straight at {speed:g} m/s", duration_s, lambda share: (length * share, 0.0, -1.0)
    )


def station(duration_s: float = 60.0, depth_m: float = 1.0, name: str = "station") -> Trajectory:
    """Stay where it began, at that depth."""
    return Trajectory(name, np.array([0.0, duration_s]), np.tile([0.0, 0.0, -depth_m], (2, 1)))


SHIPPED: dict[str, Callable[..., Trajectory]] = {
    make.__name__: make for make in (circle, lissajous, square, dive, straight, station)
}
"""Trajectories by name; each takes its duration [s]."""


def make_trajectory(
    source: str | Path, duration_s: float | None = None, scale: float = 1.0
) -> Trajectory:
    """A shipped trajectory by name, or one from a file. Raises DataError: unknown name, a duration
    that does not fit, or a file that cannot be read, lacks a column, or holds something that is no
    number.

    Args:
        source: circle, lissajous, square, dive, straight, station, or a CSV file with the columns t
            [s] and x, y, z [m], in any order.
        duration_s: time for a shipped one [s]; a file brings its own.
        scale: how many times larger the path is to be, about its start, in the same time.
    """
    if scale != 1.0:
        if not 0.0 < scale <= MAX_SCALE:
            raise DataError(
                f"scale: expected a number above 0 and up to {MAX_SCALE:g}, got {scale}"
            )
        path = make_trajectory(source, duration_s)
        larger = path.samples[0] + scale * (path.samples - path.samples[0])
        return Trajectory(path.name, path.time, larger)
    name = str(source)
    if name in SHIPPED:
        if duration_s is None:
            return SHIPPED[name]()
        if not 2 * RAMP_S <= duration_s <= 3600.0:
            raise DataError(f"duration: expected {2 * RAMP_S:g} to 3600 s, got {duration_s:g}")
        return SHIPPED[name](duration_s)
    if not os.path.lexists(source):
        raise DataError(f"trajectory: expected {', '.join(SHIPPED)} or a CSV file, got {name!r}")
    if duration_s is not None:
        raise DataError(f"duration: {name} brings its own times; leave it out")
    table = read_table(Path(source), MAX_BYTES, "a CSV file of a path")
    if missing := [column for column in COLUMNS if column not in table.header]:
        raise DataError(
            f"{source}: column {missing[0]!r} is missing; expected {', '.join(COLUMNS)}"
        )
    rows, _ = table.numbers([table.header.index(column) for column in COLUMNS])
    return Trajectory(Path(source).stem, rows[:, 0], rows[:, 1:])
