"""Trajectories, shipped and from files."""

from pathlib import Path

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.swim.simulation import SHIPPED, make_trajectory


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_trajectories_start_gently_and_stay_slow(name: str) -> None:
    path = make_trajectory(name)
    speed = np.linalg.norm(np.diff(path.samples, axis=0), axis=1) / np.diff(path.time)
    assert speed[0] < 0.03
    assert speed.max() < 0.27
    start, heading = path.start()
    ahead = path.samples[np.argmax(np.linalg.norm(path.samples - start, axis=1) > 0.1)] - start
    assert abs(np.arctan2(ahead[1], ahead[0]) - heading) < 0.2
    np.testing.assert_allclose(path.position(path.duration_s + 9.0), path.samples[-1])


def test_a_path_says_where_it_goes_on_while_it_rests() -> None:
    path = make_trajectory("square")
    turns = [path.setpoint(time) for time in (5.0, 18.0, 41.0, 63.0, 89.0)]
    assert [bool(np.any(turn.velocity)) for turn in turns] == [True, False, False, False, False]
    onward = [turn.onward for turn in turns]
    np.testing.assert_allclose(onward, np.array([0.0, 0.5, 1.0, -0.5, -0.5]) * np.pi, atol=1e-6)
    assert np.isnan(make_trajectory("station").setpoint(12.0).onward)


@pytest.mark.parametrize("name", SHIPPED)
def test_many_setpoints_are_those_one_by_one(name: str) -> None:
    path = make_trajectory(name)
    times = np.append(np.linspace(0.0, path.duration_s, 37), path.duration_s + 2.0)
    together = path.setpoints(times)
    for time, found in zip(times.tolist(), together, strict=True):
        alone = path.setpoint(time)
        for value, wanted in zip(found, alone, strict=True):
            np.testing.assert_array_equal(value, wanted)
        by_axis = [np.interp(time, path.time, axis) for axis in path.samples.T]
        np.testing.assert_allclose(found.position, by_axis, rtol=1e-12, atol=1e-15)
    assert not np.any(together[-1].velocity) and together[-1].surge == 0.0


def test_coarse_samples_of_a_smooth_path_have_a_smooth_acceleration() -> None:
    """The square's legs, 41 samples each, are cubics over time."""
    path = make_trajectory("square")
    leg = 0.17 * path.duration_s
    for time in np.linspace(1.0, leg - 1.0, 50):
        setpoint = path.setpoint(time)
        done = time / leg
        assert setpoint.velocity[0] == pytest.approx(12.0 / leg * done * (1.0 - done), abs=2e-3)
        assert setpoint.acceleration[0] == pytest.approx(
            12.0 / leg**2 * (1.0 - 2.0 * done), abs=1e-3
        )


def test_a_file_of_positions(tmp_path: Path) -> None:
    file = tmp_path / "line.csv"
    file.write_text("z, t, x, y\n-1,0,0,0\n-1,10,1,2\n")
    path = make_trajectory(file)
    np.testing.assert_allclose(path.position(5.0), [0.5, 1.0, -1.0])
    assert path.setpoint(5.0).surge == pytest.approx(np.hypot(0.1, 0.2))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("t,x,y\n0,0,0\n", "column 'z' is missing"),
        ("t,x,y,z\n0,0,0,0\n", "at least two samples"),
        ("t,x,y,z\n0,0,0,0\n0,1,1,1\n", "times that rise"),
        ("t,x,y,z\n0,0,0,0\n1,one,1,1\n", "line 3, column x, holds 'one'"),
        ("t,x,y,z\n0,0,0,0\n1,nan,1,1\n", "line 3, column x, holds 'nan', which is not finite"),
        ("t,x,y,z\n0,0,0,0\n0.2,1,1,1\n", "at least 1 s"),
    ],
)
def test_bad_files_are_one_sentence(tmp_path: Path, content: str, message: str) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(content)
    with pytest.raises(DataError, match=message):
        make_trajectory(file)


def test_unknown_names_and_durations(tmp_path: Path) -> None:
    with pytest.raises(
        DataError, match="circle, lissajous, square, dive, straight, station or a CSV file"
    ):
        make_trajectory("spiral")
    with pytest.raises(DataError, match="12 to 3600"):
        make_trajectory("circle", 1.0)
