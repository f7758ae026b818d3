"""Benches as others write them: workbooks, thrust stands, several voltages, missing units and
signs."""

import csv
import sys
import time
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from finlab.arrays import Array
from finlab.cli import main
from finlab.errors import DataError
from finlab.fit.thruster_bench import read_bench
from finlab.fit.thruster_fit import ThrusterFit, fit_thruster

PWM = np.arange(1100.0, 1901.0, 50.0)
"""Widths of pulse at which a thruster was measured [us]."""
N_PER_KGF = 9.80665
"""Newtons in a kilogram-force."""
N_PER_LB = 4.44822
"""Newtons in a pound-force."""
ENDS = (-41.0, 52.0)
"""Forces [N] at the ends of the commands, at 16 V."""


def true_force(volts: float = 16.0) -> Array:
    """Force (17,) [N] of the thruster at a voltage [V]."""
    x = (PWM - 1500.0) / 400.0
    return np.asarray(
        np.where(x > 0.0, ENDS[1], -ENDS[0]) * np.sign(x) * np.abs(x) ** 1.6 * volts / 16.0
    )


def true_power(volts: float = 16.0) -> Array:
    """Power (17,) [W] of the thruster at a voltage [V]."""
    return np.asarray(390.0 * (np.abs(PWM - 1500.0) / 400.0) ** 2.5 * (volts / 16.0) ** 2 + 1.0)


def write_csv(path: Path, columns: dict[str, Array]) -> Path:
    """Write columns by their names into a file of CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return path


def workbook(path: Path, volts: tuple[float, ...], column: bool) -> Path:
    """Sheets of a maker: a page of words, then one table for each voltage, below a title."""
    header = [
        "PWM (\u00b5s)",
        "RPM",
        "Power\n(W)",
        "Force (Kg f)",
        "Efficiency (g/W)",
        "Voltage (V)",
    ]
    book = openpyxl.Workbook()
    book.active.append(["How this was measured", "in a tank"])
    for v in volts:
        sheet = book.create_sheet(f"T300 at {v:g} V")
        sheet.append(["Performance"])
        sheet.append(header[: 5 + column])
        for p, n, w in zip(PWM, true_force(v), true_power(v), strict=True):
            row = [p, 8.0 * abs(p - 1500.0), w, n / N_PER_KGF, None if n == 0.0 else abs(n) / w, v]
            sheet.append(row[: 5 + column])
    book.save(path)
    return path


def fitted(*paths: Path, volts: float | None = None) -> ThrusterFit:
    """A thruster that is fitted to files, at a voltage [V]."""
    return fit_thruster(read_bench(paths, volts))


@pytest.mark.parametrize("column", [True, False])
def test_a_workbook_is_read_at_the_voltage_that_is_asked_for(tmp_path: Path, column: bool) -> None:
    path = workbook(tmp_path / "maker.xlsx", (10.0, 12.0, 16.0), column)
    with pytest.raises(DataError, match="measured at 10, 12, 16 V; say which counts, --voltage 16"):
        fitted(path)
    for volts in (
        10.0,
        12.0,
        16.0,
        11.0,
        14.0,
    ):  # forces of this maker grow with the voltage itself
        fit = fitted(path, volts=volts)
        np.testing.assert_allclose(fit.force, np.array(ENDS) * volts / 16.0, rtol=1e-3)
        notes = " ".join(fit.notes)
        assert "no table in sheet Sheet" in notes and ("interpolated" in notes) == (
            volts in (11.0, 14.0)
        )
    with pytest.raises(DataError, match="tells nothing of 20 V"):
        fitted(path, volts=20.0)


def test_one_sheet_needs_no_voltage_and_what_is_no_workbook_gets_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = workbook(tmp_path / "one.xlsx", (16.0,), True)
    np.testing.assert_allclose(fitted(path).force, ENDS, rtol=1e-3)
    (tmp_path / "no.xlsx").write_text("PWM,force")
    with pytest.raises(DataError, match="cannot be read as a zip archive"):
        fitted(tmp_path / "no.xlsx")
    with pytest.raises(DataError, match="no sheet holds a table"):
        fitted(workbook(tmp_path / "words.xlsx", (), True))
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(DataError, match="openpyxl, which is not installed"):
        fitted(path)


@pytest.mark.parametrize("shift", [0.0, 10.0])
def test_voltages_of_one_table_are_apart_but_a_supply_may_sag(tmp_path: Path, shift: float) -> None:
    both = {
        "PWM (us)": np.append(PWM, PWM + shift), "Force (N)": np.append(true_force(12.0), true_force()),
        "Power (W)": np.append(true_power(12.0), true_power()), "Voltage (V)": np.repeat([12.0, 16.0], len(PWM)),
    }  # fmt: skip
    path = write_csv(tmp_path / "both.csv", both)
    with pytest.raises(DataError, match="measured at 12, 16 V"):
        fitted(path)
    np.testing.assert_allclose(fitted(path, volts=12.0).force, np.array(ENDS) * 0.75, rtol=1e-3)
    sagging = {"PWM (us)": PWM, "Force (N)": true_force()}
    sagging |= {"Voltage (V)": 16.0 - true_power() / 130.0, "Current (A)": true_power() / 15.0}
    np.testing.assert_allclose(
        fitted(write_csv(tmp_path / "sag.csv", sagging)).force, ENDS, rtol=1e-3
    )


@pytest.mark.parametrize(
    ("columns", "note"),
    [
        ({"ESC signal (\u00b5s)": PWM, "Thrust (kgf)": true_force() / N_PER_KGF, "Speed (Hz)": PWM}, "rpm"),
        ({"Throttle (\u00b5s)": PWM, "Thrust (lbf)": true_force() / N_PER_LB, "Thrust (N)": true_force()}, ""),
        ({"PWM": PWM, "Thrust (lbs)": true_force() / N_PER_LB}, "no unit stands at PWM: taken for us"),
        ({"PWM (us)": PWM, "Force": true_force()}, "no unit stands at Force: taken for N"),
        ({"PWM (us)": PWM, "Force (N)": np.abs(true_force())}, "they are sizes alone: those below the neutral"),
        ({"ESC (us)": PWM, "Force (N)": -np.abs(true_force())}, "no sign, they are negative alone"),
        ({"Throttle (%)": (PWM - 1500.0) / 4.0, "Thrust [gf]": 1e3 * true_force() / N_PER_KGF}, ""),
    ],
)  # fmt: skip
def test_headers_units_and_signs_of_others(
    tmp_path: Path, columns: dict[str, Array], note: str
) -> None:
    fit = fitted(
        write_csv(tmp_path / "bench.csv", columns | {"Electrical Power (W)": true_power()})
    )
    np.testing.assert_allclose(fit.force, ENDS, rtol=1e-3)
    assert note in " ".join(fit.notes) if note else not fit.notes


def test_forces_that_contradict_each_other_are_named_and_one_way_is_no_missing_sign(
    tmp_path: Path,
) -> None:
    two = {
        "PWM (us)": PWM,
        "Thrust (N)": true_force(),
        "Thrust (kgf)": true_force(),
        "Power (W)": true_power(),
    }
    with pytest.raises(DataError, match=r"Thrust \(N\) and Thrust \(kgf\), and differ"):
        fitted(write_csv(tmp_path / "two.csv", two))
    ahead = PWM >= 1500.0
    one = {
        "PWM (us)": PWM[ahead],
        "Force (N)": true_force()[ahead],
        "Power (W)": true_power()[ahead],
    }
    assert fitted(write_csv(tmp_path / "one.csv", one)).force == pytest.approx(
        (0.0, ENDS[1]), rel=1e-3
    )


def test_the_command_line_takes_a_voltage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = workbook(tmp_path / "maker.xlsx", (12.0, 16.0), True)
    command = ["fit", "thruster", str(path), "-o", str(tmp_path / "table.csv")]
    assert main(command) == 2 and "--voltage 16" in capsys.readouterr().err
    assert main([*command, "--voltage", "14"]) == 0
    assert "interpolated between the rows at 12 V and at 16 V" in capsys.readouterr().out


def test_blanks_take_no_time(tmp_path: Path) -> None:
    path = tmp_path / "blanks.csv"
    rows = "\n".join(
        f"{p},{n},{w}" for p, n, w in zip(PWM, true_force(), true_power(), strict=True)
    )
    path.write_text(
        f"PWM (us),Force{' ' * 9000}(N),Power{'(' * 9000} (W)\n" + f"{' ' * 9000},,\n" * 300 + rows
    )
    before = time.thread_time()
    with pytest.raises(DataError, match="power or voltage is missing"):
        read_bench([path])
    assert time.thread_time() - before < 1.0


def test_voltages_may_stand_in_the_header(tmp_path: Path) -> None:
    columns = {}
    for volts in (12.0, 16.0):
        columns |= {
            f"pwm {volts:g}V": PWM,
            f"thrust (kgf) {volts:g}V": true_force(volts) / N_PER_KGF,
            f"power at {volts:g} V": true_power(volts),
        }
    path = write_csv(tmp_path / "both.csv", columns)
    for volts in (12.0, 16.0):
        np.testing.assert_allclose(
            fitted(path, volts=volts).force, np.array(ENDS) * volts / 16.0, rtol=1e-3
        )
    with pytest.raises(DataError, match="measured at 12, 16 V; say which counts"):
        fitted(path)
    shared = {"PWM": PWM} | {key: value for key, value in columns.items() if "pwm" not in key}
    path = write_csv(tmp_path / "shared.csv", shared)
    np.testing.assert_allclose(fitted(path, volts=16.0).force, ENDS, rtol=1e-3)
    sagging = {key: value for key, value in columns.items() if "power" not in key}
    for volts in (12.0, 16.0):
        supply = volts - true_power(volts) / 400.0
        sagging[f"voltage {volts:g}V"] = supply
        sagging[f"current {volts:g}V"] = true_power(volts) / supply
    fit = fitted(write_csv(tmp_path / "sagging.csv", sagging), volts=16.0)
    np.testing.assert_allclose(fit.force, ENDS, rtol=1e-3)
    assert fit.table.rows[-1][2] == pytest.approx(391.0, rel=0.01)
    text = (tmp_path / "both.csv").read_text().splitlines()
    ragged = [text[0], *(row + "," for row in text[1:])]
    ragged[0] += ",remarks"
    ragged[3] = ",".join(["", "", "", *ragged[3].split(",")[3:]])
    (tmp_path / "ragged.csv").write_text("\n".join(ragged))
    np.testing.assert_allclose(fitted(tmp_path / "ragged.csv", volts=16.0).force, ENDS, rtol=1e-3)
    np.testing.assert_allclose(
        fitted(tmp_path / "ragged.csv", volts=12.0).force, np.array(ENDS) * 0.75, rtol=1e-3
    )


def test_of_two_columns_of_one_force_the_one_with_a_unit_counts(tmp_path: Path) -> None:
    pounds = {"thrust": true_force() / N_PER_LB, "thrust (kgf)": true_force() / N_PER_KGF}
    rest = {"PWM": PWM, "power": true_power()}
    for columns in (pounds | rest, dict(reversed([*pounds.items()])) | rest):
        fit = fitted(write_csv(tmp_path / "two.csv", columns))
        np.testing.assert_allclose(fit.force, ENDS, rtol=1e-3)
        assert any("thrust is left aside: it names no unit" in note for note in fit.notes)
    other = pounds | rest | {"thrust": np.abs(true_force())}
    with pytest.raises(DataError, match="two columns stand for force, thrust and thrust .kgf."):
        fitted(write_csv(tmp_path / "two.csv", other))


def test_noise_at_rest_is_no_reverse_thrust(tmp_path: Path) -> None:
    command = np.array([1000.0, 1050, 1100, 1200, 1300, 1400, 1500, 1600, 1700, 1800, 1900, 2000])
    grams = np.array([-1.1, -0.6, 0.4, 3, 6, 9, 12, 15, 18, 20, 22, 24])
    watts = np.array([0.57, 1.0, 1.3, 2.6, 3.7, 4.9, 6.1, 7.1, 8.1, 9.1, 10.0, 11.2])
    columns = {"ESC signal (us)": command, "Thrust (gf)": grams, "Power (W)": watts}
    fit = fitted(write_csv(tmp_path / "stand.csv", columns))
    assert fit.force == pytest.approx((0.0, 24 * 0.00980665), rel=1e-5)
    assert fit.idle_commands == (1000.0, 1100.0) and fit.dead_band == 0.0
    notes = " ".join(fit.notes)
    assert "1000 to 1100 us are 4.6 % of the largest: they count as noise" in notes
    assert "as at 1100 us 0.57 W for 1.3 W" in notes and "pushes one way" in notes


def test_a_coarse_step_is_no_dead_band(tmp_path: Path) -> None:
    force = true_force()
    force[np.abs(PWM - 1500.0) < 60.0] = 0.0
    columns = {"PWM": PWM, "force": force, "power": true_power()}
    fit = fitted(write_csv(tmp_path / "coarse.csv", columns))
    assert fit.dead_band == 0.0 and fit.idle_commands == (1450.0, 1550.0)
    assert "-4.462 N at 1400 us, a coarse step" in " ".join(fit.notes)
