"""Thrusters from bench tables: the T200 by its maker, noisy benches of known thrusters, wrong
files."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from finlab.arrays import Array
from finlab.cli import main
from finlab.errors import DataError
from finlab.fit.thruster_bench import BenchData, read_bench
from finlab.fit.thruster_fit import ThrusterFit, fit_thruster, layout_lines
from finlab.physics.table_error import thrust_table_error
from tests.fit.load_cell import write

T200 = Path(__file__).parent / "data" / "t200_16v.csv"
"""Force in kgf, voltage and current in place of power, rpm beside PWM."""


def true_force(command: Array) -> Array:
    """A thruster with a dead band, and 0.7 of its forward force in reverse [N]."""
    beyond = np.maximum(np.abs(command) - 0.06, 0.0) / 0.94
    return np.asarray(np.where(command > 0.0, 50.0, -35.0) * beyond**1.8)


def bench(n: int, noise: float, seed: int = 0, repeats: int = 1) -> BenchData:
    """Rows of that thruster at random commands, forces and powers with noise that is a share of
    each."""
    rng = np.random.default_rng(seed)
    command = np.repeat(
        np.sort(np.append(rng.uniform(-1.0, 1.0, n - 3), [-1.0, 0.0, 1.0])), repeats
    )
    force = true_force(command)
    power = np.where(force > 0.0, 1.0, 1.4) * np.abs(force) ** 1.55
    seen = [values * (1.0 + noise * rng.standard_normal(len(command))) for values in (force, power)]
    return BenchData(command, seen[0], np.abs(seen[1]), None, "", "bench", ())


def test_the_t200_is_as_published() -> None:
    fit = fit_thruster(read_bench([T200]))
    assert fit.force == pytest.approx((-39.9, 51.4), abs=0.05)
    assert fit.idle_commands == (1472.0, 1528.0)
    assert 0.3 < fit.dead_band < 0.41
    assert len(fit.table.rows) == 201 and fit.table.unit == "us"
    assert 0.002 < thrust_table_error(fit.table)[0] < 0.02
    assert "rpm is left aside" in fit.notes[0]


@pytest.mark.parametrize(("n", "noise", "repeats"), [(300, 0.05, 1), (41, 0.03, 4), (60, 0.02, 1)])
def test_noise_is_averaged_and_the_uncertainty_is_that_of_the_table(
    n: int, noise: float, repeats: int
) -> None:
    ratios = []
    for seed in range(8):
        fit = fit_thruster(bench(n, noise, seed, repeats))
        command, force, _ = fit.table.columns
        at = np.linspace(-1.0, 1.0, 500)
        missed = np.interp(at, command, force) - true_force(at)
        assert np.sqrt(np.mean(missed**2)) < 0.5 * noise * 50.0
        share, floor = thrust_table_error(fit.table)
        expected = np.hypot(share * true_force(at), floor)
        ratios.append(np.sqrt(np.mean(missed**2) / np.mean(expected**2)))
    assert 0.5 < np.median(ratios) < 2.0


def test_torque_and_one_side_and_rpm_without_sign(tmp_path: Path) -> None:
    rpm = np.linspace(-3000.0, 3000.0, 25)
    columns = {
        "RPM": np.abs(rpm), "thrust_n": 5e-6 * rpm * np.abs(rpm),
        "power [kW]": 1e-3 * np.abs(1e-3 * rpm) ** 3,
        "torque [mN m]": -0.02e3 * 5e-6 * rpm * np.abs(rpm),
    }  # fmt: skip
    fit = fit_thruster(read_bench([write(tmp_path / "both.csv", columns)]))
    assert fit.torque_per_newton == pytest.approx(-0.02, rel=1e-6) and "no sign" in fit.notes[0]
    assert fit.force == pytest.approx((-45.0, 45.0))
    ahead = {name: values[rpm >= 0.0] for name, values in columns.items()}
    fit = fit_thruster(read_bench([write(tmp_path / "one.csv", ahead)]))
    assert fit.force == pytest.approx((0.0, 45.0)) and "one way" in fit.notes[0]


def test_power_at_rest_is_in_the_table() -> None:
    plain = bench(60, 0.0)
    idling = fit_thruster(replace(plain, power=plain.power + 12.0))
    assert idling.table.columns[2].min() == pytest.approx(12.0)


Columns = dict[str, Array]
"""Columns of a file by their names."""
PWM = np.linspace(1100.0, 1900.0, 17)
"""Widths of pulse at which a thruster was measured [us]."""
GOOD_COLUMNS = {
    "PWM": PWM,
    "force": true_force((PWM - 1500.0) / 400.0),
    "power": np.abs(PWM - 1500.0),
}
"""Columns that a fit takes."""


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda c: c | {"force": -c["force"]}, "the force falls with the command, from 35 N at 1100 us"),
        (lambda c: c | {"force": np.where(PWM > 1800, 20.0, c["force"])}, "falls with the command about 1"),
        (lambda c: c | {"power": c["power"] - 50.0}, "line 10: the power is -50 W, expected what"),
        (lambda c: {k: v[11:] for k, v in c.items()}, "no force is near 0, the least is 6.98"),
        (lambda c: {"Schub": c["force"], **c, "force": 0.0 * PWM}, "force is 0 throughout"),
        (lambda c: {"u": PWM, "Schub": c["force"], "power": PWM}, "PWM or input or rpm is missing, found u"),
        (lambda c: {"PWM": PWM, "Schub [N]": c["force"], "power": PWM}, "force is missing, found PWM, Schub"),
        (lambda c: {"PWM": PWM, "force": PWM, "voltage": PWM}, "column power or current is missing"),
        (lambda c: {"PWM": PWM, "force [kp]": PWM, "power": PWM}, "unit 'kp' is not known, expected rad"),
        (lambda c: {k: v[::5] for k, v in c.items()}, "4 different commands, expected at least 5"),
        (lambda c: c | {"power": 500.0 - c["power"]}, "does not grow ever faster with the force"),
    ],
)  # fmt: skip
def test_wrong_benches_get_a_sentence(
    tmp_path: Path, change: Callable[[Columns], Columns], sentence: str
) -> None:
    with pytest.raises(DataError, match=sentence) as raised:
        fit_thruster(read_bench([write(tmp_path / "bench.csv", change(GOOD_COLUMNS))]))
    assert "bench.csv" in str(raised.value)


def robot_with(fit: ThrusterFit, table: Path) -> Path:
    """A layout of two such thrusters, by what the fit says to write."""
    keys = yaml.safe_load("\n".join(layout_lines(fit, table)))
    one = {"type": "thruster", "axis": [1, 0, 0], **keys}
    actuators = [
        {"name": name, **one, "position_m": [0, y, 0]}
        for name, y in (("left", 0.2), ("right", -0.2))
    ]
    path = table.with_name("robot.yaml")
    robot = {"format": "finlab-layout", "version": 2, "name": "two", "actuators": actuators}
    path.write_text(json.dumps(robot))
    return path


def test_the_verb_makes_a_table_that_answers_with_inputs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "7, at: 16 V.csv"
    target = ["10", "0", "0", "0", "0", "4"]
    assert main(["fit", "thruster", str(T200), "-o", str(table)]) == 0
    assert "none from 1472 to 1528" in capsys.readouterr().out
    robot = robot_with(fit_thruster(read_bench([T200])), table)
    assert main(["allocate", str(robot), "--wrench", *target, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    command, force = np.loadtxt(T200, delimiter=",", skiprows=3, usecols=(0, 4)).T
    for actuator, newtons in zip(told["actuators"], (-5.0, 15.0), strict=True):
        assert actuator["command"]["force_n"] == pytest.approx(newtons, abs=1e-6)
        there = np.interp(actuator["command"]["input"], command, 9.80665 * force)
        assert there == pytest.approx(newtons, abs=0.01)
