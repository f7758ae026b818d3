"""The table of forces: faithful to what it was made from, smooth, periodic, and strict about its
file."""

import math
import os
import zipfile
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from finlab.bundle_files import CHECKSUM_FILE, archive_of_table, checksums, table_name
from finlab.errors import DataError
from finlab.layout import Fin, FinModelSpec, Layout
from finlab.physics import Plant, make_law, plant_of, read_table, write_table

DRAG = make_law(FinModelSpec("drag"))
"""The law of drag with its default constants."""
LIGHTHILL = make_law(FinModelSpec("lighthill"))
"""Lighthill's law with its default constants."""
AMPLITUDE = np.linspace(0.0, 0.7, 9)
"""Amplitudes of the tables [rad]."""
FREQUENCY = np.linspace(0.0, 2.4, 9)
"""Frequencies of the tables [Hz]."""
CIRCLE = np.linspace(-math.pi, math.pi, 25)
"""Zero directions of the tables [rad], the whole circle."""


def random_commands(n, seed=0):
    """Commands (n, 3) within the tables."""
    unit = np.random.default_rng(seed).random((n, 3))
    return np.array([0.05, 0.1, -math.pi]) + unit * np.array([0.55, 2.0, 2 * math.pi])


@pytest.fixture
def table(tmp_path):
    """The law of drag as a table."""
    write_table(tmp_path / "drag.csv", DRAG, AMPLITUDE, FREQUENCY, CIRCLE)
    return read_table(tmp_path / "drag.csv")


def test_the_grid_points_come_back_exactly_and_the_rest_closely(table):
    points = np.array([[AMPLITUDE[3], FREQUENCY[5], CIRCLE[7]], [0.7, 2.4, math.pi]])
    np.testing.assert_allclose(table.force(points), DRAG.force(points), rtol=1e-8, atol=1e-8)
    u = random_commands(2000)
    largest = np.linalg.norm(DRAG.force(u), axis=-1).max()
    error = np.linalg.norm(table.force(u) - DRAG.force(u), axis=-1)
    assert error.mean() < 0.002 * largest
    assert error.max() < 0.02 * largest


def test_slopes_agree_with_differences_and_with_the_original(table):
    u = random_commands(200)
    force, jacobian = table.force_and_jacobian(u)
    np.testing.assert_allclose(force, table.force(u), rtol=1e-13, atol=1e-13)
    for k in range(3):
        offset = np.zeros(3)
        offset[k] = 1e-6
        difference = (table.force(u + offset) - table.force(u - offset)) / 2e-6
        np.testing.assert_allclose(jacobian[:, k], difference, rtol=1e-5, atol=1e-6)
    original = DRAG.force_and_jacobian(u)[1]
    assert np.abs(jacobian - original).max() < 0.15 * np.abs(original).max()


def test_force_and_slope_are_continuous_across_cells_and_around_the_circle(table):
    for axis, knot in [(0, AMPLITUDE[4]), (1, FREQUENCY[4]), (2, CIRCLE[4]), (2, math.pi)]:
        u = np.array([[0.31, 1.37, 0.4]] * 2)
        u[:, axis] = knot - 1e-7, knot + 1e-7
        force, jacobian = table.force_and_jacobian(u)
        np.testing.assert_allclose(force[0], force[1], rtol=0, atol=1e-5)
        np.testing.assert_allclose(jacobian[0], jacobian[1], rtol=0, atol=1e-4)


def test_full_circle_is_periodic_with_or_without_its_end_point(table, tmp_path):
    write_table(tmp_path / "open.csv", DRAG, AMPLITUDE, FREQUENCY, CIRCLE[:-1])
    without_end = read_table(tmp_path / "open.csv")
    assert table.periodic and without_end.periodic
    u = random_commands(50)
    np.testing.assert_allclose(table.force(u), table.force(u + [0.0, 0.0, 2 * math.pi]), atol=1e-12)
    np.testing.assert_allclose(table.force(u), without_end.force(u), atol=1e-12)


def test_beyond_the_table_is_its_edge(table):
    edge = np.array([0.7, 2.4, 0.3])
    beyond = np.array([1.5, 9.0, 0.3])
    np.testing.assert_array_equal(table.force(beyond), table.force(edge))


def test_a_table_that_was_written_anew_is_read_anew(tmp_path):
    path = tmp_path / "fin.csv"
    spec = FinModelSpec("table", (("path", str(path)),))
    layout = Layout("one", (Fin("a", (0.2, 0.1, 0.0), 0.7, model=spec),))
    wrench = []
    for law in (DRAG, LIGHTHILL):
        write_table(path, law, AMPLITUDE, FREQUENCY, CIRCLE)
        os.utime(path, ns=(len(wrench), len(wrench)))
        wrench.append(plant_of(layout).wrench([[0.4, 1.1, 0.9]]))
        assert plant_of(layout) is plant_of(layout)
    assert np.abs(wrench[0] - wrench[1]).max() > 0.01


def test_a_layout_may_use_a_table(tmp_path):
    write_table(tmp_path / "fin.csv", DRAG, AMPLITUDE, FREQUENCY, CIRCLE)
    fin = Fin(
        "a",
        (0.2, 0.1, 0.0),
        0.7,
        model=FinModelSpec("table", (("path", str(tmp_path / "fin.csv")),)),
    )
    command = [[0.4, 1.1, 0.9]]
    exact = Plant(Layout("drag", (Fin("a", (0.2, 0.1, 0.0), 0.7),))).wrench(command)
    np.testing.assert_allclose(Plant(Layout("table", (fin,))).wrench(command), exact, atol=0.01)


HEADER = "A,f,phi,Fx,Fy,Fz"
"""Columns of a file without power."""
GOOD_COMMANDS = list(product((0.1, 0.2), (1, 2), (0, 1)))
"""Amplitude [rad], frequency [Hz] and direction [rad] of a grid of 2 x 2 x 2 commands."""
GOOD_ROWS = [f"{a},{f},{d},0,1,2" for a, f, d in GOOD_COMMANDS]
"""Rows of a table on this grid."""


def scaled(*, amplitude=1.0, frequency=1.0, direction=1.0, force=1.0, power=None):
    """A good table whose columns were multiplied by something."""
    rows = [
        [
            amplitude * a,
            frequency * f,
            direction * d,
            0.5,
            force,
            2 * force,
            *([] if power is None else [f * f * power]),
        ]
        for a, f, d in GOOD_COMMANDS
    ]
    return [HEADER + ("" if power is None else ",P"), *(",".join(map(str, row)) for row in rows)]


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        ([], "column A is missing"),
        (["A,f,Fx,Fy,Fz", "1,2,3,4,5"], "column phi is missing"),
        (["A,f,phi,Fx,Fy,Fz,Fz", "1,2,3,4,5,6,7"], "appears twice"),
        ([HEADER], "no rows"),
        ([HEADER, "1,2,3,4"], "line 2 has 4 values"),
        ([HEADER, "1,2,x,4,5,6"], "line 2, column phi, holds 'x', which is not a number"),
        (
            [HEADER, *GOOD_ROWS[:-1], "0.2,2,1,nan,1,2"],
            "line 9, column Fx, holds 'nan', which is not finite",
        ),
        (
            [HEADER, *GOOD_ROWS[:-1]],
            "do not fill the grid of 2 amplitudes, 2 frequencies and 2 zero directions",
        ),
        ([HEADER, *GOOD_ROWS[:-1]], "the row A = 0.2, f = 2, phi = 1 is missing"),
        ([HEADER, *GOOD_ROWS[:-1], "0.2,2,1,,1,2"], "line 9, column Fx, is empty; leave no gaps"),
        ([HEADER, *GOOD_ROWS, GOOD_ROWS[0]], "appears in two rows, lines 2 and 10"),
        (
            scaled(amplitude=57.3),
            "column A has 11.46, expected half amplitudes in rad (not peak to peak), 0 to 1.571",
        ),
        (
            scaled(amplitude=10.0),
            "column A has 2, expected half amplitudes in rad (not peak to peak)",
        ),
        (
            scaled(frequency=60.0),
            "f has 120, expected frequencies in Hz (not beats per minute), 0 to 20",
        ),
        (scaled(direction=57.3), "span 57.3 rad, expected at most one turn (6.283)"),
        (scaled(amplitude=-1.0), "column A has -0.1, expected half amplitudes"),
        (scaled(frequency=-1.0), "column f has -1, expected frequencies"),
        (scaled(force=0.0), "thrust goes up to 0, "),
        (scaled(force=1e-300), "thrust goes up to 2e-300"),
        (scaled(force=1e300), "expected 1e-06 to 1e+06 N"),
        (scaled(direction=1e-9), "two values of column phi are 1e-09 apart"),
        (scaled(power=math.nan), "line 2, column P, holds 'nan', which is not finite"),
        (scaled(power=math.inf), "line 2, column P, holds 'inf', which is not finite"),
        (
            scaled(power=-1.0),
            "column P has -1, expected the mean power in W that drives it, 0 to 1e+06",
        ),
        (scaled(power=0.0), "column P is 0 everywhere; leave it out"),
        ([HEADER, *GOOD_ROWS[:4]], "column A has one value"),
        (
            [HEADER, *GOOD_ROWS, *(row.replace(",1,0,1,2", ",7,0,1,2") for row in GOOD_ROWS[1::2])],
            "span 7 rad",
        ),
    ],
)
def test_a_bad_table_is_refused_with_file_and_place(lines, why, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(DataError) as caught:
        read_table(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert why in str(caught.value)


def circle_with_power(path, force_at_end, extra):
    """A table around the circle, whose end has another force, and extra power, beside its
    beginning."""
    angles = np.linspace(-math.pi, math.pi, 9)
    rows = []
    for a, f, d in product((0.5, 1), (1, 2), angles):
        is_end = d == angles[-1]
        across = a * f * math.cos(d) + force_at_end * is_end
        along = a * f * math.sin(d)
        rows.append(f"{a},{f},{d},0,{across},{along},{5 + extra * is_end}")
    path.write_text("\n".join([HEADER + ",P", *rows]))
    return path


def test_a_circle_is_closed_by_its_forces_whatever_the_power(tmp_path):
    law = read_table(circle_with_power(tmp_path / "t.csv", 0.0, 40.0))
    assert law.periodic and law.has_power
    at = np.array([[1.0, 2.0, math.pi], [1.0, 2.0, -math.pi]])
    np.testing.assert_allclose(law.power(at), [5.0, 5.0])
    np.testing.assert_allclose(law.force(at), [[0.0, -2.0, 0.0]] * 2, atol=1e-12)
    assert read_table(circle_with_power(tmp_path / "t.csv", 0.09, 0.0)).periodic
    # Large powers do not excuse forces that differ by more than a twentieth of the largest force, 2
    # N.
    with pytest.raises(DataError, match="one turn later differ"):
        read_table(circle_with_power(tmp_path / "t.csv", 0.15, 0.0))


def test_power_never_falls_below_zero_between_points_near_zero(tmp_path):
    """A cubic through 0, 0, 1 dips; its slope is then told as that of zero."""
    power = [0.0, 0.0, 0.0, 1.0, 1.0]
    rows = [f"{a},{f},{d},0,1,2,{power[f]}" for a, f, d in product((0.1, 0.2), range(5), (0, 1))]
    (tmp_path / "t.csv").write_text("\n".join([HEADER + ",P", *rows]))
    law = read_table(tmp_path / "t.csv")
    at = np.zeros((401, 3))
    at[:, 0] = 0.15
    at[:, 1] = np.linspace(0.0, 4.0, 401)
    found = law.power(at)
    jacobian = law.power_gradient(at)
    assert found.min() == 0.0 and found.max() > 1.0
    dips = (at[:, 1] > 1.0) & (at[:, 1] < 2.0)
    assert not found[dips].any() and not jacobian[dips].any() and jacobian[:, 1].max() > 0.5


@pytest.mark.parametrize(("share", "good"), [(0.04, True), (0.07, False)])
def test_one_turn_apart_noise_may_be_a_twentieth_of_the_largest_force(share, good, tmp_path):
    angles = np.linspace(-math.pi, math.pi, 9)
    rows = [
        f"{a},{f},{d},0,{a * f * math.cos(d) * (1.0 + share * (d > 3.0))},{a * f * math.sin(d)}"
        for a, f, d in product((0.5, 1), (1, 2), angles)
    ]
    (tmp_path / "t.csv").write_text("\n".join([HEADER, *rows]))
    if good:
        assert read_table(tmp_path / "t.csv").force(np.array([[1.0, 2.0, 0.0]]))[
            0, 1
        ] == pytest.approx(2.0)
        return
    with pytest.raises(DataError, match="one turn later differ"):
        read_table(tmp_path / "t.csv")


def test_a_missing_or_binary_file_is_refused(tmp_path):
    with pytest.raises(DataError, match="no such file"):
        read_table(tmp_path / "missing.csv")
    (tmp_path / "b.csv").write_bytes(bytes(range(256)))
    with pytest.raises(DataError, match="is not UTF-8 text"):
        read_table(tmp_path / "b.csv")


GRID = np.linspace(0.0, 0.6, 5), np.linspace(0.0, 2.1, 6), np.linspace(-np.pi, np.pi, 9)
"""Amplitudes [rad], frequencies [Hz] and zero directions [rad] of a soft fin's table."""


@pytest.fixture
def soft_table(tmp_path: Path) -> Path:
    """File of a soft fin's table."""
    path = tmp_path / "fin.csv"
    write_table(path, make_law(FinModelSpec("soft", (("e", 0.2),))), *GRID)
    return path


def spec(path: Path) -> FinModelSpec:
    """The model of a fin whose law is a table."""
    return FinModelSpec("table", (("path", str(path)),))


def test_tables_are_read_out_of_an_archive(soft_table: Path, tmp_path: Path) -> None:
    content = soft_table.read_bytes()
    needed = {"robot.json": b"", "bundle.json": b'{"version": 9}'}
    files = {**needed, table_name(content): content}
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        for name, part in {**files, CHECKSUM_FILE: checksums(files)}.items():
            archive.writestr(name, part)
    inside = tmp_path / "x.zip" / table_name(content)
    assert (
        archive_of_table(inside) == str(tmp_path / "x.zip") and archive_of_table(soft_table) is None
    )
    assert archive_of_table(tmp_path / "y.zip" / table_name(content)) is None, (
        "there is no such archive"
    )
    assert archive_of_table(tmp_path / "x.zip" / "other" / "x.csv") is None
    command = np.array([[0.4, 1.1, 0.3]])
    np.testing.assert_array_equal(
        make_law(spec(inside)).force(command), make_law(spec(soft_table)).force(command)
    )
    with pytest.raises(DataError, match="no such file, expected a CSV table"):
        make_law(spec(inside.with_name("0" * 64 + ".csv")))
