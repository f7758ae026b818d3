"""The log as a table: every number under a header with its unit, and a file that a fit can read."""

import csv
from pathlib import Path

import numpy as np
import pytest

from finlab.fit.robot.swim_file import read_swim
from finlab.layout import Layout
from finlab.sim import ClosedLoop, RunLog, SteadyCurrent, make_trajectory
from finlab.sim.log_csv import csv_of, save_csv
from tests.any_robot import AnyRobot


@pytest.fixture(scope="module")
def log(layout_a: Layout, analytic: AnyRobot) -> RunLog:
    """A third of a circle in a current; the front left fin is lost on the way."""
    swim = ClosedLoop(
        layout_a,
        analytic.on(layout_a),
        make_trajectory("circle", 32.0),
        water=SteadyCurrent((0.03, -0.02, 0.0)),
        failures=[("front_left", 20.0)],
    )
    return swim.run()


def test_each_number_stands_under_its_name(log: RunLog) -> None:
    header, *rows = csv.reader(csv_of(log).splitlines())
    assert len(set(header)) == len(header) and len(rows) == log.n_ticks

    def column(name: str) -> np.ndarray:
        k = header.index(name)
        return np.array([float(row[k] or "nan") for row in rows])

    assert column("t [s]") == pytest.approx(log.time)
    assert column("true y [m]") == pytest.approx(log.position[:, 1], rel=1e-5, abs=1e-9)
    assert column("yaw [rad]") == pytest.approx(log.measured[:, 5], rel=1e-5)
    assert column("water vx [m/s]") == pytest.approx(np.full(log.n_ticks, 0.03))
    assert column("delivered Tz [N m]") == pytest.approx(log.delivered[:, 5], rel=1e-5, abs=1e-9)
    lost, other = log.fins.index("front_left"), log.fins.index("back_left")
    assert column("back_left.phi [rad]") == pytest.approx(log.command[:, other, 2], rel=1e-5, abs=1e-9)
    power = column("back_left power with motor losses [W]")
    assert power == pytest.approx(log.driving_power[:, other], rel=1e-5, abs=1e-9)
    after = log.time >= 20.0
    assert (column("front_left works [0 or 1]") == ~after).all()
    told = column("front_left.A [rad]")
    assert np.isnan(told[after]).all() and told[~after] == pytest.approx(
        log.command[~after, lost, 0], rel=1e-5
    )


def test_a_fit_reads_it(log: RunLog, layout_a: Layout, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    save_csv(log, path)
    swim = read_swim(path, layout_a)
    kept = np.isfinite(log.command[: len(swim.command)])
    assert (np.isfinite(swim.command) == kept).all()
    assert swim.command[kept] == pytest.approx(log.command[: len(swim.command)][kept], rel=1e-5, abs=1e-9)
