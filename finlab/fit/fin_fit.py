"""Fits a fin to measurements: smooth forces and power with their uncertainty, and the file of them.

Each component of the force is a Gaussian process over the command (`gaussian_process`); the file is
a force table that a layout names.
"""

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
from finlab.display import Column, percent
from finlab.errors import DataError
from finlab.fit.gaussian_process import Component
from finlab.fit.measurements import MIN_SAMPLES, Measurements
from finlab.whole_file import write_whole

MAX_SAMPLES = 1500
"""Samples beyond this number are thinned: the time grows with their cube."""
OUTLIER = 5.0
"""Error over its standard deviation beyond which a sample is an outlier."""
BAND = 1.96
"""Half width of a band that holds 95 % of a normal distribution [standard deviations]."""
GOOD_ERROR = 0.05
"""Largest mean uncertainty of a force, over the largest force, of a fit that is trusted."""
GOOD_COVERAGE = 0.85
"""Least share of samples within their 95 % band of a fit that is trusted."""
GRID_STEPS = (0.01, 0.05)
"""Steps of amplitude [rad] and frequency [Hz] to whose next multiple a table goes."""
FULL_CIRCLE = 0.75 * TURN
"""Range of zero directions from which on a table goes all round [rad]; less makes a table of their
arc."""
GRID = (13, 13, 18)
"""Amplitudes, frequencies and zero directions of the table, from rest to the largest that was
measured."""
SCALE_QUANTILE = 0.98
"""Quantile of the forces' sizes by which they are scaled while outliers are looked for: the largest
may be one."""


@dataclass(frozen=True)
class FinFit:
    """A fin's forces as Gaussian processes, one for each axis of the frame that turns with the
    fin."""

    measurements: Measurements
    outliers: tuple[str, ...]
    """File and line of the samples that were left out."""
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
        """Returns forces and their standard deviations.

        Args:
            command: commands (..., 3): half amplitude [rad], frequency [Hz], zero direction [rad].

        Returns:
            Forces (..., 3) and their standard deviations (..., 3) [N] in the fin's frame: along the
            shaft, the horizontal thrust axis, and up.
        """
        inputs = self.measurements.scaled(command)
        shape = command.shape[:-1]
        means = []
        deviations = []
        for component in self.components:
            mean, deviation = component.predict(inputs)
            means.append(self.largest * mean.reshape(shape))
            deviations.append(self.largest * deviation.reshape(shape))
        along, across, shaft = means
        sigma_along, sigma_across, sigma_shaft = deviations
        # The components turn with the zero direction: rotate them by it and by the deflection.
        angle = command[..., 2] + self.deflection
        cos = np.cos(angle)
        sin = np.sin(angle)
        y = along * cos - across * sin
        z = along * sin + across * cos
        sigma_y = np.hypot(sigma_along * cos, sigma_across * sin)
        sigma_z = np.hypot(sigma_along * sin, sigma_across * cos)
        force = np.stack([shaft, y, z], axis=-1)
        return force, np.stack([sigma_shaft, sigma_y, sigma_z], axis=-1)

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
        """Reasons not to trust the fit, a clause each; empty where it may be trusted."""
        uncertainty = float(np.sqrt(np.mean(self.uncertainty(self.grid()) ** 2)))
        n_outliers = len(self.outliers)
        n = len(self.measurements)
        n_all = n_outliers + n
        clauses = []
        if uncertainty > GOOD_ERROR:
            clauses.append(f"forces are uncertain by {uncertainty:.0%} of the largest one")
        if self.coverage() < GOOD_COVERAGE:
            clauses.append(f"only {self.coverage():.0%} of the samples lie in their 95 % band")
        if n_outliers > 0.1 * n_all:
            clauses.append(f"{n_outliers} of {n_all} samples contradict the others")
        if n < 3 * MIN_SAMPLES:
            clauses.append(f"{n} samples are few, 300 are a good number")
        return tuple(clauses)

    def grid(self, shape: tuple[int, int, int] = (7, 7, 12)) -> Array:
        """Returns commands on a grid (*shape, 3) over what was measured.

        Amplitudes and frequencies go from rest to the next multiple of `GRID_STEPS`; zero
        directions go all round, or over the arc where samples are.

        Args:
            shape: how many amplitudes, frequencies and zero directions.
        """
        n_amplitudes, n_frequencies, n_directions = shape
        limits = np.ceil(np.divide(self.measurements.reach, GRID_STEPS) - 1e-9) * GRID_STEPS
        amplitude_max, frequency_max = np.minimum(limits, (MAX_AMPLITUDE, MAX_FREQUENCY))
        amplitudes = np.linspace(0.0, amplitude_max, n_amplitudes)
        frequencies = np.linspace(0.0, frequency_max, n_frequencies)
        phi = self.measurements.command[:, 2]
        if not self.measurements.has_directions or np.ptp(phi) >= FULL_CIRCLE:
            directions = np.linspace(-0.5 * TURN, 0.5 * TURN, n_directions, endpoint=False)
        else:
            directions = np.linspace(phi.min(), phi.max(), n_directions)
        axes = (amplitudes, frequencies, directions)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def fit_fin(
    measurements: Measurements, seed: int = 0, progress: Callable[[str], None] = lambda words: None
) -> FinFit:
    """Returns the fin that explains the samples, without outliers.

    The linear algebra runs on one thread: on matrices of this size several wait for each other.

    Args:
        measurements: the samples.
        seed: draws the samples that are used where there are more than `MAX_SAMPLES`.
        progress: called with a clause before each step; an exception of its own ends the fit.

    Raises:
        DataError: fewer than `MIN_SAMPLES` are of a fin that beats.
    """
    notes = list(measurements.notes)
    at_rest = measurements.command[:, 0] * measurements.command[:, 1] == 0.0
    if at_rest.any():
        notes.append(f"{at_rest.sum()} samples at rest tell nothing and are left out")
        measurements = measurements.without(at_rest)
    n = len(measurements)
    if n < MIN_SAMPLES:
        raise DataError(
            f"{n} samples of a fin that beats, expected at least {MIN_SAMPLES}; 300 are a good "
            "number"
        )
    if n > MAX_SAMPLES:
        notes.append(f"{MAX_SAMPLES} of {n} samples, drawn at random, are used")
        order = np.random.default_rng(seed).permutation(n)
        measurements = measurements.without(order >= MAX_SAMPLES)
    with threadpool_limits(limits=1, user_api="blas"):
        is_outlier = _find_outliers(measurements, progress)
        if not measurements.force[~is_outlier].any():
            is_outlier[:] = False  # a fin that hardly ever pushes: its few forces are no outliers
        outliers = tuple(np.array(measurements.sources)[is_outlier].tolist())
        if outliers:
            shown = ", ".join(outliers[:5]) + (" ..." if len(outliers) > 5 else "")
            verbs = "contradict the others and are"
            if len(outliers) == 1:
                verbs = "contradicts the others and is"
            notes.append(f"{len(outliers)} of {len(is_outlier)} samples {verbs} left out: {shown}")
            measurements = measurements.without(is_outlier)
        return _fit_components(measurements, outliers, tuple(notes), progress)


def _find_outliers(
    measurements: Measurements, progress: Callable[[str], None]
) -> NDArray[np.bool_]:
    """Marks samples (n,) that lie far off a fit to the others, in which such samples count for
    little: a wrong unit, a bump of the rig, a cell that slipped."""
    thrust, _ = measurements.thrust()
    sizes = np.linalg.norm(measurements.force, axis=-1)
    scale = float(np.quantile(sizes, SCALE_QUANTILE)) or float(sizes.max())
    values = thrust / scale
    inputs = measurements.scaled(measurements.command)
    progress("looking for samples that contradict the others")
    along = Component(inputs, values[:, 0], is_heavy_tailed=True)
    progress("looking for such samples across the thrust")
    across = Component(inputs, values[:, 1], size=along.mean, is_heavy_tailed=True)
    return np.asarray((along.standardized_error > OUTLIER) | (across.standardized_error > OUTLIER))


def _fit_components(
    measurements: Measurements,
    outliers: tuple[str, ...],
    notes: tuple[str, ...],
    progress: Callable[[str], None],
) -> FinFit:
    """The fit to samples without outliers: a Gaussian process for each component, and for power."""
    thrust, deflection = measurements.thrust()
    largest = float(np.linalg.norm(measurements.force, axis=-1).max())
    inputs = measurements.scaled(measurements.command)
    progress("fitting the thrust")
    along = Component(inputs, thrust[:, 0] / largest)
    progress("fitting the force across the thrust")
    across = Component(inputs, thrust[:, 1] / largest, along.mean)
    progress("fitting the force along the shaft")
    shaft = Component(inputs, thrust[:, 2] / largest, along.mean)
    power = None
    largest_power = 1.0
    if measurements.power is not None:
        progress("fitting power")
        largest_power = float(measurements.power.max())
        power = Component(inputs, np.sqrt(np.maximum(measurements.power, 0.0) / largest_power))
    return FinFit(
        measurements=measurements,
        outliers=outliers,
        components=(along, across, shaft),
        power=power,
        deflection=deflection,
        largest=largest,
        largest_power=largest_power,
        notes=notes,
    )


def fin_csv(fit: FinFit) -> str:
    """Returns the text of a force table: comments on how good the fit is, a header, and a grid."""
    command = fit.grid(GRID).reshape(-1, 3)
    force, deviation = fit.predict(command)
    power = fit.predict_power(command)
    header = [*COLUMNS]
    columns = [command, force]
    if power is not None:
        header.append(POWER_COLUMN)
        columns.append(power[:, None])
    header += DEVIATIONS
    columns.append(deviation)
    return table_text(summary(fit), header, np.hstack(columns), 6)


def write_fin(fit: FinFit, path: str | os.PathLike[str]) -> None:
    """Writes a fitted fin to a CSV file that a layout names: `model: {type: table, path: FILE}`.

    Args:
        fit: the fin.
        path: the file.

    Raises:
        DataError: the file cannot be written, or its name does not end in .csv.
    """
    check_table_path(path)
    write_whole(path, fin_csv(fit), DataError)


def check_table_path(path: str | os.PathLike[str]) -> None:
    """Refuses a name that no layout takes for a table, before a fit, which takes seconds.

    Raises:
        DataError: the name does not end in .csv.
    """
    if Path(path).suffix.lower() != ".csv":
        raise DataError(f"{path}: a table is a CSV file, expected a name that ends in .csv")


def _share(value: float) -> str:
    """A share of the largest force, with one decimal: `3.1 %`."""
    return f"{100.0 * value:.1f} %"


FIGURES = (
    Column("cross-validated error, of the largest force", lambda fit: fit.error(), digits=_share),
    Column("noise of a sample, of the largest force", lambda fit: fit.noise(), digits=_share),
    Column("unseen samples within the 95 % band", lambda fit: fit.coverage(), digits=percent),
    Column("largest force", lambda fit: fit.largest, "N"),
)
"""Figures of a `FinFit`, which the command line and the app show."""


def verdict(fit: FinFit) -> str:
    """Returns whether the fit may be trusted, and if not, why."""
    if fit.doubts:
        return f"{DOUBT}: {'; '.join(fit.doubts)}"
    return "may be trusted within what was measured"


def reach_words(fit: FinFit) -> str:
    """Returns how many samples it is of, and how far they reach."""
    amplitude, frequency = fit.measurements.reach
    return (
        f"fitted to {len(fit.measurements)} samples, amplitudes up to {amplitude:.3g} rad, "
        f"frequencies up to {frequency:.3g} Hz"
    )


def summary(fit: FinFit) -> tuple[str, ...]:
    """Returns how good the fit is, a line each; the first says why it should not be trusted, if
    so."""
    lines = [verdict(fit), reach_words(fit)]
    for column in FIGURES:
        unit = f" {column.unit}" if column.unit else ""
        lines.append(f"{column.name}: {column.cell(fit)}{unit}")
    deflection_deg = float(np.degrees(fit.deflection))
    lines.append(f"thrust leans {deflection_deg:+.1f} deg off the zero direction")
    return (*lines, *fit.notes)
