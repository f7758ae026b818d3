"""A fin from measurements: smooth forces and power with their uncertainty, and the file of them."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from finlab.actuators.fin.fin_model import DOUBT, MAX_AMPLITUDE, MAX_FREQUENCY
from finlab.actuators.fin.force_table_file import COLUMNS, DEVIATIONS, POWER_COLUMN, table_text
from finlab.arrays import Array
from finlab.axes import TURN
from finlab.errors import DataError
from finlab.fit.gaussian_process import Component
from finlab.fit.measurements import MIN_SAMPLES, Measurements
from finlab.whole_file import write_whole

MOST_SAMPLES = 1500
"""Samples beyond this number are thinned: the time grows with their cube."""
OUTLIER = 5.0
"""Error, over the usual one, beyond which a sample is left out."""
BAND = 1.96
"""Standard deviations of a band that holds 95 % of a normal distribution."""
GOOD_ERROR, GOOD_BAND = 0.05, 0.85
"""Mean uncertainty of a force over the largest one up to which a fit is trusted, and least share of
samples left out that must lie within their band."""
ROUND = (0.01, 0.05)
"""Steps of amplitude [rad] and frequency [Hz] to whose next multiple a table goes."""
COVERED = 0.75 * TURN
"""Zero directions from which a table goes all round; fewer make a table of their arc."""
GRID = (13, 13, 18)
"""Amplitudes, frequencies and zero directions of the table, from rest to the largest that was
measured."""


@dataclass(frozen=True)
class FinFit:
    """A fin's forces as Gaussian processes, one for each axis of the frame that turns with the
    fin."""

    measurements: Measurements
    outliers: tuple[str, ...]
    """Where the samples stand that were left out."""
    components: tuple[Component, ...]
    """Force along the thrust's mean direction, across it, and along the shaft, over `largest`."""
    power: Component | None
    """Root of the power over its largest, where it was measured: power grows faster than force
    does."""
    deflection: float
    """Angle from the zero direction to the thrust's mean direction [rad]."""
    largest: float
    """Largest force that was measured, outliers apart [N]."""
    largest_power: float
    """Largest power that was measured [W]."""
    notes: tuple[str, ...]
    """What was filled in or left out, a sentence each."""

    def predict(self, command: Array) -> tuple[Array, Array]:
        """Returns forces [N] in the fin frame and their standard deviations (..., 3) at commands
        (..., 3)."""
        inputs = self.measurements.scaled(command)
        predicted = np.array([component.predict(inputs) for component in self.components])
        thrust, unsure = self.largest * predicted.transpose(1, 0, 2).reshape(
            2, 3, *command.shape[:-1]
        )
        angle = command[..., 2] + self.deflection
        cos = np.cos(angle)
        sin = np.sin(angle)
        along, across, sideways = thrust
        by_along, by_across, by_sideways = unsure
        force = [sideways, along * cos - across * sin, along * sin + across * cos]
        y = np.hypot(by_along * cos, by_across * sin)
        z = np.hypot(by_along * sin, by_across * cos)
        return np.stack(force, axis=-1), np.stack([by_sideways, y, z], axis=-1)

    def predict_power(self, command: Array) -> Array | None:
        """Returns the power [W], (...), at commands (..., 3); None where none was measured."""
        if self.power is None:
            return None
        root = np.maximum(self.power.expect(self.measurements.scaled(command)), 0.0)
        return np.asarray(self.largest_power * root.reshape(command.shape[:-1]) ** 2)

    def error(self) -> float:
        """Returns the cross-validated error: root mean square over the samples, each predicted from
        all others, of the force's error over the largest force, the noise of the samples
        included."""
        return float(np.sqrt(np.mean(sum(component.left_out**2 for component in self.components))))

    def noise(self) -> float:
        """Returns the noise of a sample over the largest force, root mean square over samples and
        axes."""
        return float(np.sqrt(np.mean(sum(component.variance for component in self.components))))

    def coverage(self) -> float:
        """Returns the share of samples that lie in the 95 % band of the fit to all others."""
        inside = [np.abs(c.left_out) <= BAND * c.left_out_deviation for c in self.components[:2]]
        return float(np.mean(inside))

    def uncertainty(self, command: Array) -> Array:
        """Returns the standard deviation (...) of the force at commands (..., 3) over the largest
        force."""
        return np.asarray(np.linalg.norm(self.predict(command)[1], axis=-1) / self.largest)

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Why the fit should not be trusted, a clause each; nothing where it may be."""
        usual = float(np.sqrt(np.mean(self.uncertainty(self.grid()) ** 2)))
        lost = len(self.outliers)
        n = len(self.measurements)
        clauses = {
            f"forces are uncertain by {usual:.0%} of the largest one": usual > GOOD_ERROR,
            f"only {self.coverage():.0%} of the samples lie in their 95 % band": self.coverage()
            < GOOD_BAND,
            f"{lost} of {lost + n} samples contradict the others": lost > 0.1 * (lost + n),
            f"{n} samples are few, 300 are a good number": n < 3 * MIN_SAMPLES,
        }
        return tuple(clause for clause, holds in clauses.items() if holds)

    def grid(self, shape: tuple[int, int, int] = (7, 7, 12)) -> Array:
        """Returns commands on a grid (*shape, 3) over what was measured, from rest on, to round
        numbers; zero directions go all round, or over the arc where samples are."""
        ends = np.ceil(np.divide(self.measurements.reach, ROUND) - 1e-9) * ROUND
        ends = np.minimum(ends, (MAX_AMPLITUDE, MAX_FREQUENCY))
        axes = [np.linspace(0.0, most, count) for most, count in zip(ends, shape, strict=False)]
        phi = self.measurements.command[:, 2]
        if not self.measurements.turned or np.ptp(phi) >= COVERED:
            axes.append(np.linspace(-0.5 * TURN, 0.5 * TURN, shape[2], endpoint=False))
        else:
            axes.append(np.linspace(phi.min(), phi.max(), shape[2]))
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def fit_fin(
    measurements: Measurements, seed: int = 0, progress: Callable[[str], None] = lambda words: None
) -> FinFit:
    """Returns the fin that explains samples, leaving out those that contradict all others.

    The linear algebra runs on one thread: on matrices of this size several wait for each other. The
    seed draws the samples that are kept where there are more than `MOST_SAMPLES`; `progress` is
    called before each step, and what it raises ends the fit. Raises DataError: fewer than
    `MIN_SAMPLES` are of a fin that beats."""
    notes = list(measurements.notes)
    rest = measurements.command[:, 0] * measurements.command[:, 1] == 0.0
    if rest.any():
        notes.append(f"{rest.sum()} samples at rest tell nothing and are left out")
        measurements = measurements.without(rest)
    n = len(measurements)
    if n < MIN_SAMPLES:
        raise DataError(
            f"{n} samples of a fin that beats, expected at least {MIN_SAMPLES}; 300 are a good "
            "number"
        )
    if n > MOST_SAMPLES:
        notes.append(f"{MOST_SAMPLES} of {n} samples, drawn at random, are used")
        measurements = measurements.without(
            np.random.default_rng(seed).permutation(n) >= MOST_SAMPLES
        )
    with threadpool_limits(limits=1, user_api="blas"):
        bad = _outliers(measurements, progress)
        if not measurements.force[
            ~bad
        ].any():  # a fin that hardly ever pushes: what it gives is no outlier
            bad[:] = False
        outliers = tuple(place for place, out in zip(measurements.places, bad, strict=True) if out)
        if outliers:
            shown = ", ".join(outliers[:5]) + (" ..." if len(outliers) > 5 else "")
            notes.append(
                f"{len(outliers)} of {len(bad)} samples contradict the others and are left out: "
                f"{shown}"
            )
            measurements = measurements.without(bad)
        return _fitted(measurements, outliers, tuple(notes), progress)


def _outliers(measurements: Measurements, tell: Callable[[str], None]) -> NDArray[np.bool_]:
    """Which samples (n,) lie far off a fit to the others, in which such samples count for little: a
    wrong unit, a bump of the rig, a cell that slipped."""
    turned, _ = measurements.thrust()
    sizes = np.linalg.norm(measurements.force, axis=-1)
    values = turned / (float(np.quantile(sizes, 0.98)) or float(sizes.max()))
    inputs = measurements.scaled(measurements.command)
    tell("looking for samples that contradict the others")
    along = Component(inputs, values[:, 0], wild=True)
    tell("looking for such samples across the thrust")
    across = Component(inputs, values[:, 1], size=along.mean, wild=True)
    return np.asarray((along.strange > OUTLIER) | (across.strange > OUTLIER))


def _fitted(
    measurements: Measurements,
    outliers: tuple[str, ...],
    notes: tuple[str, ...],
    tell: Callable[[str], None],
) -> FinFit:
    turned, deflection = measurements.thrust()
    largest = float(np.linalg.norm(measurements.force, axis=-1).max())
    inputs = measurements.scaled(measurements.command)
    parts: list[Component] = []
    for values, what in zip(
        turned.T, ("thrust", "force across the thrust", "force along the shaft"), strict=True
    ):
        tell(f"fitting the {what}")
        parts.append(Component(inputs, values / largest, parts[0].mean if parts else None))
    power = None
    largest_power = 1.0
    if measurements.power is not None:
        tell("fitting power")
        largest_power = float(measurements.power.max())
        power = Component(inputs, np.sqrt(np.maximum(measurements.power, 0.0) / largest_power))
    return FinFit(
        measurements, outliers, tuple(parts), power, deflection, largest, largest_power, notes
    )


def fin_csv(fit: FinFit) -> str:
    """Returns the file's text: lines that begin with # and say what the fit is worth, a header, a
    grid."""
    command = fit.grid(GRID).reshape(-1, 3)
    force, deviation = fit.predict(command)
    power = fit.predict_power(command)
    table = np.hstack([command, force, *([] if power is None else [power[:, None]]), deviation])
    header = [*COLUMNS, *([] if power is None else [POWER_COLUMN]), *DEVIATIONS]
    return table_text(summary(fit), header, table, 6)


def write_fin(fit: FinFit, path: str | os.PathLike[str]) -> None:
    """Writes a fitted fin to a CSV file that a layout names: `model: {type: table, path: FILE}`.
    Raises DataError: the file cannot be written, or is not called .csv."""
    check_table_path(path)
    write_whole(path, fin_csv(fit), DataError)


def check_table_path(path: str | os.PathLike[str]) -> None:
    """Raises DataError for a name that no layout takes for a table, before a fit, which takes
    seconds."""
    if Path(path).suffix.lower() != ".csv":
        raise DataError(f"{path}: a table is a CSV file, expected a name that ends in .csv")


def summary(fit: FinFit) -> tuple[str, ...]:
    """Returns what the fit is worth, a line each; the first says why it should not be trusted, if
    so."""
    amplitude, frequency = fit.measurements.reach
    return (
        *((f"{DOUBT}: {'; '.join(fit.doubts)}",) if fit.doubts else ()),
        f"fitted to {len(fit.measurements)} samples, amplitudes up to {amplitude:.3g} rad, "
        "frequencies up to "
        f"{frequency:.3g} Hz, forces up to {fit.largest:.3g} N",
        f"cross-validated error {fit.error():.1%} of the largest force, noise of a sample "
        f"{fit.noise():.1%}; "
        f"{fit.coverage():.0%} of the samples lie in the 95 % band of the fit to the others",
        f"thrust leans {float(np.degrees(fit.deflection)):+.1f} deg off the zero direction",
        *fit.notes,
    )
