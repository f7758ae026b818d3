"""Fitted fins beside the laws that were measured: error, band, outliers, doubt, and their file."""

import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from finlab import load_layout
from finlab.actuators.fin.fin_model import DOUBT
from finlab.actuators.fin.table_law import read_table
from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.fin_fit import FinFit, fit_fin, summary, write_fin
from finlab.layout import Fin, FinModelSpec, Layout
from finlab.physics import TableLaw
from tests.fit.load_cell import commands, measured, samples, soft

LAW = soft(k=4.0, p=1.4, x0=0.9, q=4.0, e=0.15, phi_e=1.0, d=0.12)
"""The law of the fin that is measured, uneven in its directions."""
TEST_COMMANDS = commands(2000, seed=9)
"""Commands (2000, 3) that the fits have not seen."""
OUTLIERS = (17, 100)
"""Which measurements are spoiled."""


@pytest.fixture(scope="module")
def fit() -> FinFit:
    """300 samples with 5 % noise, two of them wrong, and their power."""
    command = commands(300)
    force = measured(LAW, command)
    largest = np.linalg.norm(force, axis=-1).max()
    force[OUTLIERS, 1] += 1.2 * largest
    result = samples(command, force)
    power = LAW.power(command) * (1.0 + 0.03 * np.random.default_rng(3).standard_normal(300))
    return fit_fin(type(result)(command, force, power, result.sources, ()))


def error_of(fit: FinFit, test: Array = TEST_COMMANDS) -> Array:
    """Errors of a fit at commands, as parts of the largest force."""
    truth = LAW.force(test)
    return np.asarray(
        np.linalg.norm(fit.predict(test)[0] - truth, axis=-1) / np.linalg.norm(truth, axis=-1).max()
    )


def test_forces_are_near_the_truth_and_the_band_holds_it(fit: FinFit) -> None:
    assert np.sqrt(np.mean(error_of(fit) ** 2)) < 0.03
    force, deviation = fit.predict(TEST_COMMANDS)
    inside = np.abs(force - LAW.force(TEST_COMMANDS))[:, 1:] <= 1.96 * deviation[:, 1:]
    assert 0.85 < inside.mean() <= 1.0
    assert deviation[:, 1:].mean() < 0.03 * fit.largest, (
        "a band as wide as the water is no knowledge"
    )


def test_power_and_lean(fit: FinFit) -> None:
    power = fit.predict_power(TEST_COMMANDS)
    assert power is not None
    assert np.abs(power - LAW.power(TEST_COMMANDS)).max() < 0.05 * LAW.power(TEST_COMMANDS).max()
    assert fit.deflection == pytest.approx(0.12, abs=0.03)
    assert fit.predict(np.array([[0.0, 1.0, 0.3], [0.4, 0.0, 1.0]]))[0] == pytest.approx(0.0), (
        "at rest"
    )


def test_outliers_are_named_and_no_good_sample_with_them(fit: FinFit) -> None:
    assert {f"line {k + 2}" for k in OUTLIERS} == set(fit.outliers)
    assert "contradict the others" in " ".join(summary(fit))


def test_neighbours_of_wild_samples_are_taken_back_under_mixed_noise() -> None:
    command = commands(150, seed=4)
    rng = np.random.default_rng(54)
    force = measured(LAW, command, seed=5)
    largest = np.linalg.norm(force, axis=-1).max()
    force += 0.02 * largest * rng.standard_normal(force.shape)
    wild = rng.choice(150, 4, replace=False)
    force[wild, 2] += 0.6 * largest
    result = fit_fin(samples(command, force))
    assert set(result.outliers) == {f"line {k + 2}" for k in wild}


def test_a_good_fit_is_trusted(fit: FinFit) -> None:
    assert fit.doubts == () and not summary(fit)[0].startswith(DOUBT)
    assert 0.9 < fit.coverage() < 1.0 and 0.01 < fit.error() < 0.06 and 0.01 < fit.noise() < 0.06


def test_few_samples_are_doubted_first_of_all(tmp_path: Path) -> None:
    command = commands(24, seed=5)
    sparse = fit_fin(samples(command, measured(LAW, command, 0.3)))
    assert "24 samples are few, 300 are a good number" in sparse.doubts
    assert summary(sparse)[0].startswith(DOUBT)
    write_fin(sparse, tmp_path / "few.csv")
    assert (tmp_path / "few.csv").read_text().startswith(f"# {DOUBT}: ")
    notes = Allocator(robot_with(tmp_path / "few.csv")).allocate([0.3, 0, 0, 0, 0, 0]).notes
    assert any(f"is {DOUBT}" in note for note in notes)


def test_the_file_of_a_fin_is_a_table_that_answers_as_the_fit(fit: FinFit, tmp_path: Path) -> None:
    write_fin(fit, tmp_path / "fin.csv")
    law = read_table(tmp_path / "fin.csv")
    assert isinstance(law, TableLaw) and law.has_power and law.notes == summary(fit)
    # The grid's own error is small beside that of the fit.
    assert (
        np.abs(law.force(TEST_COMMANDS) - fit.predict(TEST_COMMANDS)[0]).max() < 0.02 * fit.largest
    )
    with pytest.raises(DataError, match=r"ends in \.csv"):
        write_fin(fit, tmp_path / "fin.yaml")


def robot_with(path: Path) -> Layout:
    """Layout A with a table for every fin."""
    layout = load_layout("A")
    model = FinModelSpec("table", (("path", str(path)),))
    fins = (Fin(f.name, f.position, f.mounting_angle, f.limits, model) for f in layout.fins)
    return Layout(layout.name, tuple(fins))


def test_one_zero_direction_speaks_for_all() -> None:
    law = soft(d=0.1)
    command = commands(120)
    command[:, 2] = 0.3
    single = samples(command, measured(law, command, 0.02))
    result = fit_fin(
        type(single)(command, single.force, None, single.sources, (), has_directions=False)
    )
    truth = law.force(TEST_COMMANDS)
    error = (
        np.linalg.norm(result.predict(TEST_COMMANDS)[0] - truth, axis=-1)
        / np.linalg.norm(truth, axis=-1).max()
    )
    assert np.sqrt(np.mean(error**2)) < 0.02


def test_many_samples_are_thinned_and_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finlab.fit.fin_fit.MAX_SAMPLES", 100)
    command = commands(130)
    result = fit_fin(samples(command, measured(LAW, command)))
    assert len(result.measurements) + len(result.outliers) == 100
    assert "100 of 130 samples, drawn at random" in " ".join(result.notes)


def eight_directions(
    n: int = 300, along_shaft: float = 0.15, noise: float = 0.03
) -> tuple[Array, Array]:
    """Commands of a rig that turns in eighths, and forces with a part along the shaft."""
    rng = np.random.default_rng(1)
    command = commands(n)
    command[:, 2] = rng.choice(np.arange(-4, 4) * np.pi / 4, n)
    force = LAW.force(command)
    size = np.linalg.norm(force, axis=-1)
    force[:, 0] = along_shaft * size * np.cos(command[:, 2])
    spread = noise * size.max() * np.array([along_shaft > 0.0, 1.0, 1.0])
    return command, force + spread * rng.standard_normal(force.shape)


def test_a_fit_takes_seconds_on_one_thread_and_says_what_it_does() -> None:
    single: list[str] = []
    threads: set[int] = set()

    def progress(words: str) -> None:
        single.append(words)
        threads.update(
            pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"
        )

    began = time.thread_time()
    fit_fin(samples(*eight_directions()), progress=progress)
    assert time.thread_time() - began < 6.0
    assert threads == {1}
    assert "fitting the thrust" in single and len(single) >= 5


@pytest.mark.parametrize(("along_shaft", "noise"), [(0.0, 0.03), (0.15, 0.0), (0.0, 0.0)])
def test_axes_without_force_or_noise_raise_no_warning(along_shaft: float, noise: float) -> None:
    command, force = eight_directions(120, along_shaft, noise)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = fit_fin(samples(command, force))
        assert np.isfinite(result.predict(TEST_COMMANDS)).all()
    assert np.sqrt(np.mean(error_of(result)[TEST_COMMANDS[:, 0] > 0.1] ** 2)) < 0.2


def test_few_forces_among_many_zeros_are_no_outliers() -> None:
    command = commands(60)
    force = np.where((np.arange(60) < 3)[:, None], LAW.force(command), 0.0)
    result = fit_fin(samples(command, force))
    assert result.outliers == () and result.largest > 0.0


def test_a_fin_that_hardly_ever_beats_is_refused() -> None:
    command = commands(60)
    command[5:, 0] = 0.0
    with pytest.raises(DataError, match="5 samples of a fin that beats"):
        fit_fin(samples(command, LAW.force(command)))
