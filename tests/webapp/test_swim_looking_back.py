"""Swims that are looked at again and downloaded."""

import io
import zipfile
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.sim import make_trajectory
from tests.webapp.loops import page_of
from tests.webapp.test_swimming import until
from webapp.markup.corner import swim_corner
from webapp.markup.swim_card import swim_card
from webapp.panels.line_plot import with_cursor
from webapp.session.swim_plan import Plan, SwimSettings
from webapp.tasks.background import Worker
from webapp.tasks.exports import Exports
from webapp.tasks.moment import POWER, TIME, Figures
from webapp.tasks.swimming import Swimming

UCAT = load_layout("ucat")


class Shelf:
    """A page's tasks, and what was sent to its browser."""

    def __init__(self) -> None:
        self.worker, self.sent, self.notes = Worker(), {}, []  # type: ignore[var-annotated]
        client = SimpleNamespace(send_file_download=lambda name, data, **_: self.sent.update({name: data}))
        context = page_of(self.worker, client=client, notify=lambda _, text: self.notes.append(text))
        self.swimming = Swimming(context, lambda: None)
        self.files = Exports(context)

    def swim(self, seconds: float, *methods: str) -> None:
        plan = Plan(UCAT, (), make_trajectory("circle"), methods)
        self.swimming.start(plan)
        until(lambda: bool(self.swimming.swimmers))
        self.swimming.set_running(False)
        for swimmer in self.swimming.swimmers:
            while swimmer.swim.time < seconds - 1e-6:
                swimmer.step()
            swimmer.shown = swimmer.moment()


@pytest.fixture
def shelf() -> Iterator[Shelf]:
    shelf = Shelf()
    yield shelf
    shelf.swimming.stop()
    shelf.worker.stop()


def test_any_moment_can_be_looked_at_again(shelf: Shelf) -> None:
    swimming = shelf.swimming
    with pytest.raises(FinlabError, match="nothing has been swum"):
        swimming.look_at(1.0)
    shelf.swim(6.0, "analytic")
    swimming.toggle("front_left")
    until(lambda: swimming.swimmers[0].shown.lost != ())
    swimmer = swimming.swimmers[0]
    while swimmer.swim.time < 8.0:
        swimmer.step()
    swimmer.shown = swimmer.moment()
    swimming.look_at(3.0)
    log, (seen,) = swimmer.recorded().log, swimming.seen
    k = 30
    assert seen.time == pytest.approx(3.0) and log.time[k] == pytest.approx(3.0)
    assert seen.pose == pytest.approx([*log.position[k], *log.quaternion[k]])
    assert seen.angle == pytest.approx(log.fin_angle[k]) and seen.force == pytest.approx(log.fin_force[k])
    assert seen.lost == seen.failed == () and seen.controllable
    assert seen.record[-1, TIME] == pytest.approx(3.0)
    assert "looking back" in swim_card(swimming, SwimSettings()) and "4 of 4" in swim_corner(swimming, 1.0)
    swimming.look_at(7.5)
    assert swimming.seen[0].lost == swimming.seen[0].failed == ("front_left",)
    assert "3 of 4 fins" in swim_corner(swimming, 1.0)
    swimming.look_at(7.98)
    assert swimming.at is None and swimming.seen[0] is swimmer.shown, "that is the newest moment"
    swimming.look_at(2.0)
    swimming.toggle("front_left")
    assert swimming.at is None, "what happens happens now"
    until(lambda: swimming.seen[0].lost == ())
    swimming.look_at(2.0)
    swimming.set_running(True)
    assert swimming.at is None, "who goes on, goes on from where it was"


def test_watts_and_what_a_pack_lasts(shelf: Shelf) -> None:
    shelf.swim(10.0, "analytic")
    swimmer = shelf.swimming.swimmers[0]
    figures, log = swimmer.shown.figures, swimmer.recorded().log
    assert isinstance(figures, Figures)
    power = log.driving_power.sum(axis=1)
    off = np.linalg.norm(log.position - log.reference, axis=1)
    assert figures.mean_w == pytest.approx(power.mean()) and figures.now_w == pytest.approx(
        power[-10:].mean()
    )
    assert figures.energy_wh == pytest.approx(power.sum() * 0.1 / 3600)
    assert figures.track_m == pytest.approx(np.sqrt((off**2).mean()))
    assert figures.depth_m == pytest.approx(np.sqrt(((log.position - log.reference)[:, 2] ** 2).mean()))
    gone, wanted = (
        np.linalg.norm(np.diff(places, axis=0), axis=1).sum() for places in (log.position, log.reference)
    )
    assert figures.speed_m_s == pytest.approx(min(gone, wanted) / 10.0) and abs(gone - wanted) > 1e-3
    exact = figures._replace(mean_w=2.0, now_w=3.25, energy_wh=0.0042, speed_m_s=0.1)
    swimmer.shown = swimmer.shown._replace(figures=exact)
    card = swim_card(shelf.swimming, SwimSettings(pack_wh=50.0))
    assert "<td>2.00 W</td><td>3.25 W</td>" in card and "50 Wh, the fins alone" in card
    assert "<td>4.2 mWh</td><td>25.0 h</td><td>9.00 km</td>" in card
    card = swim_card(shelf.swimming, SwimSettings(pack_wh=50.0, electronics_w=8.0))
    assert "<td>5.00 h</td><td>1.80 km</td>" in card and "fins and 8 W" in card
    swimmer.shown = swimmer.shown._replace(figures=exact._replace(speed_m_s=0.001))
    assert "<td>25.0 h</td><td>–</td>" in swim_card(shelf.swimming, SwimSettings(pack_wh=50.0))


def test_the_cursor_of_a_plot_stands_upright() -> None:
    x, line = np.array([0.0, 1.0, 2.0]), np.array([0.0, 10.0, 20.0])
    shown, (upright, drawn) = with_cursor(x, [line], 1.5, (-1.0, 9.0))
    assert shown.tolist() == [0.0, 1.0, 1.5, 1.5, 2.0] and drawn.tolist() == [0.0, 10.0, 15.0, 15.0, 20.0]
    assert upright[2:4].tolist() == [-1.0, 9.0] and np.isnan(upright[[0, 1, 4]]).all()


def test_the_log_is_sent_as_a_table(shelf: Shelf) -> None:
    with pytest.raises(FinlabError, match="nothing has been swum"):
        shelf.files.swim(shelf.swimming.records())
    shelf.swim(2.0, "analytic")
    shelf.files.swim(shelf.swimming.records())
    until(lambda: bool(shelf.sent))
    ((name, content),) = shelf.sent.items()
    assert name == "ucat_analytic_nominal_tracking.csv"
    header, *rows = content.decode().splitlines()
    assert header.startswith("t [s],x [m],") and len(rows) == 20


def test_several_robots_are_sent_as_an_archive(shelf: Shelf) -> None:
    shelf.swim(1.0, "analytic", "qp")
    shelf.files.swim(shelf.swimming.records())
    until(lambda: bool(shelf.sent))
    names = zipfile.ZipFile(io.BytesIO(shelf.sent["ucat_analytic_nominal_tracking_csv.zip"])).namelist()
    assert names == ["ucat_analytic_nominal_tracking.csv", "ucat_qp_nominal_tracking.csv"]


def test_power_is_a_column_of_the_record(shelf: Shelf) -> None:
    shelf.swim(1.0, "analytic")
    recorded = shelf.swimming.swimmers[0].recorded()
    assert recorded.rows[:, POWER] == pytest.approx(recorded.log.driving_power.sum(axis=1))
