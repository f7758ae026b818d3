"""What swims come to, and their logs."""

import io
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.sim import make_trajectory
from tests.webapp.loops import page_of, until
from tests.webapp.test_swimming import now
from webapp.markup.swim_card import pace_words, swim_card
from webapp.markup.words import righting_sentences
from webapp.session.swim_plan import Plan
from webapp.tasks.background import Worker
from webapp.tasks.designs import Designs
from webapp.tasks.moment import POWER, Figures
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.swimming import Swimming

UCAT = load_layout("ucat")


class Shelf:
    """A page's tasks, and what was sent to its browser."""

    def __init__(self, worker: Worker) -> None:
        self.sent: dict[str, bytes] = {}
        client = SimpleNamespace(send_file_download=lambda name, data, **_: self.sent.update({name: data}))
        context = page_of(worker, client=client)
        self.swimming = Swimming(context)
        self.files = Designs(context)

    def begun(self) -> Swimmer:
        assert self.swimming.swimmer is not None
        return self.swimming.swimmer

    def swim(self, seconds: float, method: str) -> None:
        self.swimming.start(Plan(UCAT, (), make_trajectory("circle"), method))
        until(lambda: self.swimming.swimmer is not None)
        self.swimming.set_running(False)
        swimmer = self.begun()
        while swimmer.swim.time < seconds - 1e-6:
            swimmer.step()
        swimmer.shown = swimmer.moment()


@pytest.fixture
def shelf(worker: Worker) -> Iterator[Shelf]:
    shelf = Shelf(worker)
    yield shelf
    shelf.swimming.stop()


def test_what_a_swim_comes_to(shelf: Shelf) -> None:
    shelf.swim(10.0, "analytic")
    swimmer = shelf.begun()
    figures, log = swimmer.shown.figures, swimmer.log()
    assert isinstance(figures, Figures)
    power = log.driving_power.sum(axis=1)
    off = np.linalg.norm(log.position - log.reference, axis=1)
    assert figures.mean_w == pytest.approx(power.mean()) and figures.now_w == pytest.approx(
        power[-10:].mean()
    )
    assert figures.energy_wh == pytest.approx(power.sum() * 0.1 / 3600)
    assert figures.track_m == pytest.approx(np.sqrt((off**2).mean()))
    assert figures.depth_m == pytest.approx(np.sqrt(((log.position - log.reference)[:, 2] ** 2).mean()))
    swimmer.shown = swimmer.shown._replace(figures=figures._replace(mean_w=2.0, energy_wh=0.0042))
    card = swim_card(*now(shelf.swimming))
    assert "<td>2.00 W</td>" in card and "<td>4.2 mWh</td>" in card


def test_the_log_is_sent_whole(shelf: Shelf) -> None:
    with pytest.raises(FinlabError, match="nothing has been swum"):
        shelf.files.swim(shelf.swimming)
    shelf.swim(2.0, "analytic")
    shelf.files.swim(shelf.swimming)
    until(lambda: bool(shelf.sent))
    ((name, content),) = shelf.sent.items()
    assert name == "ucat_analytic_nominal.npz"
    with np.load(io.BytesIO(content), allow_pickle=False) as log:
        assert len(log["time"]) == 20


def test_power_is_a_column_of_the_record(shelf: Shelf) -> None:
    shelf.swim(1.0, "analytic")
    swimmer = shelf.begun()
    assert swimmer.moment().record[:, POWER] == pytest.approx(swimmer.log().driving_power.sum(axis=1))


def test_a_swim_that_capsizes_says_so(shelf: Shelf) -> None:
    assert UCAT.body is not None and righting_sentences(UCAT) == ()
    heavy = replace(UCAT, body=replace(UCAT.body, center_of_buoyancy_m=(0.0, 0.0, -0.05)))
    assert righting_sentences(heavy) == ("No righting moment: overturns in pitch at rest.",)
    shelf.swimming.start(Plan(heavy, (), make_trajectory("circle"), "dual"))
    until(lambda: shelf.swimming.swimmer is not None)
    shelf.swimming.set_running(False)
    swimmer = shelf.begun()
    while swimmer.moment().capsized is None:
        assert "capsized" not in pace_words(shelf.swimming)
        swimmer.step()
        swimmer.shown = swimmer.moment()
    assert swimmer.log().capsized_s == swimmer.shown.capsized
    assert f"capsized at {swimmer.shown.capsized:.1f} s" in pace_words(shelf.swimming)
