"""Raw series: cycles cut where the fin swings through its middle, the sensor's zero taken off."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.measurements import Measurements, read_measurements
from finlab.physics import FinLaw
from tests.fit.cell import soft, write

Series = dict[str, Array]
STEP = 0.01
"""Between two samples [s]."""


def zero_of(time: Array) -> Array:
    """What the sensor shows without a load: it drifts."""
    return np.stack([0.02 + 0.0 * time, 0.05 + 0.001 * time, -0.03 - 0.002 * time], axis=-1)


def series(law: FinLaw, runs: list[tuple[float, float, float]], rest: float = 2.0) -> Series:
    """A rig that runs commands for eight cycles each, at rest in between; forces beat about their mean at
    twice the frequency, and need two cycles to grow."""
    parts, start = [], 0.0
    for amplitude, frequency, phi in runs:
        time = start + STEP * np.arange(round(rest / STEP))
        parts.append((time, phi + 0.0 * time, zero_of(time)))
        time = time[-1] + STEP * (1 + np.arange(round(8.0 / frequency / STEP)))
        stroke = 2.0 * np.pi * frequency * (time - time[0])
        mean = law.force(np.array([amplitude, frequency, phi]))
        beat = 1.0 + 0.8 * np.sin(2.0 * stroke) + 0.5 * np.cos(stroke)
        grown = 1.0 - np.exp(-4.0 * frequency * (time - time[0]))
        parts.append((time, phi + amplitude * np.sin(stroke), np.outer(beat * grown, mean) + zero_of(time)))
        start = time[-1] + STEP
    time = start + STEP * np.arange(round(rest / STEP))
    parts.append((time, runs[-1][2] + 0.0 * time, zero_of(time)))
    whole = [np.concatenate(part) for part in zip(*parts, strict=True)]
    return {"t": whole[0], "angle": whole[1], **dict(zip(("Fx", "Fy", "Fz"), whole[2].T, strict=True))}


RUNS = [(0.2, 0.7, 0.0), (0.4, 0.9, 0.5), (0.55, 1.4, -1.0), (0.3, 2.0, 2.0), (0.15, 1.1, 3.0)]


def read(tmp_path: Path, columns: Series) -> Measurements:
    return read_measurements([write(tmp_path / "raw.csv", columns)])


def test_means_over_whole_cycles(tmp_path: Path) -> None:
    law = soft(e=0.1, d=0.1)
    found = read(tmp_path, series(law, RUNS))
    assert len(found) >= 4 * len(RUNS)
    for run in RUNS:
        own = np.linalg.norm(found.command - run, axis=-1) < 0.02
        assert own.sum() >= 4, run
        truth = law.force(np.array(run))
        assert np.abs(found.force[own] - truth).max() < 0.02 * np.linalg.norm(truth), run
    assert "cycles are used" in " ".join(found.notes) and found.places[0].startswith("raw.csv from line ")


def test_without_rest_the_zero_stays_in_and_is_said(tmp_path: Path) -> None:
    columns = series(soft(), RUNS)
    swings = np.abs(np.gradient(columns["angle"])) > 0.0
    first = np.flatnonzero(swings)[0]
    last = first + round(8.0 / RUNS[0][1] / STEP)
    found = read_measurements(
        [write(tmp_path / f"{k}.csv", {n: v[first:last] for n, v in columns.items()}) for k in range(5)]
        + [write(tmp_path / "whole.csv", columns)]
    )
    assert "never rests" in " ".join(found.notes)
    drifted = found.force[np.array([place.startswith("0.csv") for place in found.places])]
    truth = soft().force(np.array(RUNS[0]))
    assert np.abs(drifted - truth)[:, 1].min() > 0.03, "the drift of the sensor is in"


def backwards(c: Series) -> Series:
    time = c["t"].copy()
    time[300] = time[298]
    return c | {"t": time}


def clipped(c: Series) -> Series:
    return c | {"Fy": np.minimum(c["Fy"], 0.4 * c["Fy"].max())}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (backwards, "line 302, column t: time runs backwards or stands still"),
        (clipped, "the sensor is saturated"),
        (lambda c: c | {"angle": 0.0 * c["angle"]}, "holds 0 whole cycles"),
        (lambda c: {k: v[::16] for k, v in c.items()}, "none of .* cycles is settled"),
    ],
)
def test_bad_series_get_a_sentence(tmp_path: Path, change: Callable[[Series], Series], sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        read(tmp_path, change(series(soft(), RUNS)))


def test_cycles_with_a_gap_do_not_count(tmp_path: Path) -> None:
    columns = series(soft(), RUNS)
    whole = read(tmp_path, columns)
    place = int(whole.places[2].rsplit(" ", 1)[1])  # the line where a settled cycle begins
    keep = np.ones(len(columns["t"]), dtype=bool)
    keep[place + 10 : place + 40] = False
    holed = read(tmp_path, {k: v[keep] for k, v in columns.items()})
    # It, and the two after it, which count as a new start.
    assert len(whole) - 4 <= len(holed) < len(whole)
