"""The animated swim: who is where at which time, read from the drawn artists and from the files."""

import io
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.sim import NO_NOISE, ClosedLoop, RunLog, SteadyCurrent, Trajectory

pytest.importorskip("matplotlib")

from matplotlib.figure import Figure  # noqa: E402
from PIL import Image  # noqa: E402

from finlab.evaluation.plots.animation import animation, save_animation  # noqa: E402
from finlab.evaluation.plots.film import Film, Swum  # noqa: E402
from finlab.evaluation.plots.shape_from_above import BLADE_M, ShapeFromAbove, outline  # noqa: E402


@pytest.fixture(scope="module")
def log(layout_a: Layout, analytic: Allocator) -> RunLog:
    """Six seconds to the left in a current; the front left fin is lost at the third."""
    line = Trajectory("line", np.array([0.0, 6.0]), np.array([[0.0, 0.0, -1.0], [0.0, 0.6, -1.2]]))
    current = SteadyCurrent((0.04, 0.03, 0.0))
    return ClosedLoop(
        layout_a, analytic, line, sensors=NO_NOISE, water=current, failures=[("front_left", 3.0)]
    ).run()


def test_the_robot_stands_where_it_was_and_a_lost_fin_is_grey(log: RunLog, layout_a: Layout) -> None:
    axis = Figure().add_subplot()
    shape = ShapeFromAbove(axis, layout_a, log, "#0072B2")
    k = 50
    shape.place(k)
    hull, bow = (patch.get_xy()[:-1] for patch in axis.patches)
    assert hull.mean(axis=0) == pytest.approx(
        log.position[k, :2] + _turned(log, k, outline(layout_a).mean(0))
    )
    ahead = bow.mean(axis=0) - hull.mean(axis=0)
    assert ahead @ _turned(log, k, np.array([1.0, 0.0])) > 0.9 * np.linalg.norm(ahead), "the bow is ahead"
    i = layout_a.index("front_right")
    blade, force = shape._blades[i].get_xydata(), shape._forces[i].get_xydata()
    root = log.position[k, :2] + _turned(log, k, np.array(layout_a.fins[i].position[:2]))
    assert blade[0] == pytest.approx(root) and force[0] == pytest.approx(root)
    assert np.linalg.norm(blade[1] - root) == pytest.approx(BLADE_M * abs(np.cos(log.fin_angle[k, i])))
    assert force[1] - root == pytest.approx(0.1 * _turned(log, k, log.fin_force[k, i, :2]))
    colours = [shape._blades[layout_a.index(name)].get_color() for name in ("front_left", "front_right")]
    assert colours[0] == "#8A949E" != colours[1]
    shape.place(10)
    assert shape._blades[layout_a.index("front_left")].get_color() != "#8A949E"


def _turned(log: RunLog, k: int, point: np.ndarray) -> np.ndarray:
    w, x, y, z = log.quaternion[k]
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])


def test_lines_end_at_the_time_of_the_picture(log: RunLog, layout_a: Layout) -> None:
    film = Film([Swum("search", log, layout_a), Swum("analytic", log, layout_a)])
    film.frame(2.0)
    assert all(line.get_xdata()[-1] == pytest.approx(2.0) for line, *_ in film._lines)
    assert film._trails[0].get_xydata()[-1] == pytest.approx(log.position[20, :2])
    assert film._title.get_text().split()[:2] == ["2.0", "s"]
    assert film._water_words.get_text() == "water 5 cm/s"
    away = np.array(film._water.xy) - film._water.get_position()
    assert away == pytest.approx(400.0 * np.array([0.04, 0.03]))
    film._flow(np.array([3.0, 4.0, 0.0]))
    assert np.array(film._water.xy) - film._water.get_position() == pytest.approx([38.4, 51.2])
    film._flow(np.zeros(3))
    assert not film._water.get_visible() and film._water_words.get_text() == "still water"
    left, right = film._above.get_xlim()
    bottom, top = film._above.get_ylim()
    box = film._above.get_window_extent()
    assert (right - left) / box.width == pytest.approx((top - bottom) / box.height), "a metre is a metre"


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_a_file_plays_as_long_as_it_should(
    log: RunLog, layout_a: Layout, tmp_path: Path, suffix: str
) -> None:
    told: list[float] = []
    path = save_animation(
        [Swum("search", log, layout_a)],
        tmp_path / f"swim{suffix}",
        seconds=1.2,
        rate=5.0,
        progress=told.append,
    )
    picture = Image.open(io.BytesIO(path.read_bytes()))
    assert picture.n_frames == 6 and picture.size == (768, 432)  # type: ignore[attr-defined]
    assert told == pytest.approx(np.arange(1, 7) / 6)
    frames = []
    for k in (0, 5):
        picture.seek(k)
        frames.append(np.asarray(picture.convert("RGB"), dtype=float))
    assert np.abs(frames[1] - frames[0]).max() > 100, "something moves"


def test_what_cannot_be_animated_is_told(log: RunLog, layout_a: Layout) -> None:
    robot = Swum("search", log, layout_a)
    with pytest.raises(DataError, match=r"\.gif or \.webp, got '\.mov'"):
        animation([robot], ".mov")
    with pytest.raises(DataError, match="got 4"):
        animation([robot] * 4)
    first = RunLog(**{**vars(log), "columns": {name: values[:1] for name, values in log.columns.items()}})
    with pytest.raises(DataError, match="has not swum yet"):
        animation([Swum("search", first, layout_a)])
