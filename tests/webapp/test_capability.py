"""The capability plot on the page: as the library has it, drawn to scale, and cancelled at will.

What judges: `finlab.analysis.capability` called without a page, and the distances of what is
drawn."""

import math
import re
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.analysis.capability import Capability, capability
from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.stand_in import LoneBell, until
from webapp.markup.polar import CENTER, RADIUS, curves_of, polar_file, polar_plot
from webapp.panels.capability_tab import _remarks
from webapp.session import Session
from webapp.session.given_loads import GivenLoads
from webapp.session.state import State
from webapp.tasks.capability import (
    Cancelled,
    CapabilityQuestion,
    capability_json,
    find_capability,
    read_given_loads,
)
from webapp.tasks.slot import Pool, Slot, Work

LOADS = b"heading_deg,Fx,Fy,Tz\n0,-40000,0,0\n90,-5000,90000,300000\n180,42000,0,0\n"
SHIP = b"""ship:
  length_pp_m: 60
  breadth_m: 14
  draft_m: 5
  waterline: {length_m: 64, center_m: 0, aft_area_m2: 370, bow_angle_deg: 27}
  wind: {frontal_area_m2: 190, lateral_area_m2: 480, lateral_center_m: 6}
  current: {lateral_area_m2: 290, lateral_center_m: -1}
"""


def found(question: CapabilityQuestion) -> tuple[Capability, list[float]]:
    """The answer to a question, and the shares that were reported on the way."""
    shares: list[float] = []
    work = Work(question, lambda: shares.append(work.progress))
    return find_capability(question, work), shares


@pytest.mark.parametrize("robot", ["supply", "bluerov2_heavy", "ucat"])
def test_the_page_has_the_librarys_plot(robot: str) -> None:
    layout = load_layout(robot)
    lost = layout.names[:1]
    state = State(layout).with_loss_toggled(lost[0])
    plot, shares = found(CapabilityQuestion.of_state(state, None))
    known = capability(layout, lost=lost)
    assert plot.values == pytest.approx(known.values, rel=1e-9)
    assert plot.to_csv() == known.to_csv()
    assert len(shares) == len(plot.cases) == layout.n
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] < 1.0


def test_loads_of_a_file_are_what_is_held() -> None:
    layout = load_layout("supply")
    given = read_given_loads("loads.csv", LOADS)
    plot, _ = found(CapabilityQuestion.of_state(State(layout), given))
    known = capability(layout, given.wrenches, (0.0, 90.0, 180.0))
    assert plot.unit == "1" and plot.values == pytest.approx(known.values, rel=1e-9)


def test_the_particulars_of_a_ship_give_its_notation() -> None:
    given = read_given_loads("C:/ships/mine.yaml", SHIP)
    assert given.file.endswith("mine.yaml")
    question = CapabilityQuestion.of_state(State(load_layout("supply")), given)
    plot, _ = found(question)
    assert plot.notation is not None
    words = _remarks(plot, question, None, False, State(load_layout("supply")), given)
    assert f"DP capability-L1{plot.notation}" in words and "changed" not in words
    words = _remarks(plot, question, None, False, State(load_layout("drillship")), given)
    assert "The robot has changed since." in words
    assert capability_json(plot).startswith(b"{") and b"refusals" in capability_json(plot)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("loads.csv", b"heading_deg,Fq\n0,1\n"),
        ("loads.csv", b"\xff\xfe\x00"),
        ("ship.yaml", b"ship: {length_pp_m: -3}"),
        ("ship.yaml", b"ship: !!python/object/apply:os.system ['true']"),
        ("ship.json", b"{"),
        ("../../ship.yaml", b""),
    ],
)
def test_what_holds_no_loads_is_refused_without_a_folder(name: str, content: bytes) -> None:
    with pytest.raises(FinlabError) as refused:
        read_given_loads(name, content)
    assert "/tmp" not in str(refused.value) and len(str(refused.value)) < 600


def test_a_plot_ends_soon_once_it_is_cancelled(worker: Pool) -> None:
    question = CapabilityQuestion.of_state(State(load_layout("octo")), None)
    work = Work(question, lambda: work.cancelled.set())
    with pytest.raises(Cancelled):
        find_capability(question, work)
    slot: Slot[CapabilityQuestion, Capability] = Slot(
        worker, LoneBell(), find_capability, watched=True
    )
    slot.ask(question)
    slot.forget()
    start = time.monotonic()
    worker.submit(lambda: None).result(10.0)  # the thread is free again
    assert time.monotonic() - start < 5.0 and slot.answer is None and not slot.busy
    slot.ask(question)
    until(lambda: not slot.busy)
    assert slot.answer is not None and slot.error is None


def shares_of(points: str) -> Any:
    """Distances from the middle of a curve's points, as shares of the largest ring."""
    place = np.array([point.split(",") for point in points.split()], float) - CENTER
    return np.hypot(*place.T) / RADIUS, np.arctan2(place[:, 0], -place[:, 1]) % (2.0 * math.pi)


@pytest.mark.parametrize("robot", ["supply", "drillship", "bluerov2", "fish"])
def test_what_is_drawn_is_to_scale(robot: str) -> None:
    layout = load_layout(robot)
    plot = capability(layout)
    markup = polar_plot(plot, layout.names)
    drawn = re.findall(r"<polygon points='([^']*)'", markup)
    curves = curves_of(plot, layout.names)
    assert len(drawn) == len(curves) == len(plot.cases) + 1
    largest = float(re.findall(r"class='dim ring'[^>]*>([\d.e+]+)[^<]*</text>", markup)[-1])
    heading = np.deg2rad(plot.headings)
    for points, curve in zip(drawn, curves, strict=True):
        share, angle = shares_of(points)
        assert share == pytest.approx(curve.values / largest, abs=2e-3)
        is_apart = share > 0.1
        turn = (angle - heading + math.pi) % (2.0 * math.pi) - math.pi
        assert np.abs(turn[is_apart]).max(initial=0.0) < 0.02
    assert "nan" not in markup and "xmlns" in polar_file(plot, layout.names)


def test_names_are_text_and_another_robot_begins_without_loads() -> None:
    layout = load_layout("bluerov2")
    names = {"front_right": "<script>x</script>"}
    hostile = replace(
        layout,
        actuators=tuple(
            replace(each, name=names.get(each.name, each.name)) for each in layout.actuators
        ),
    )
    assert "<script" not in polar_file(capability(hostile), hostile.names)
    session = Session(layout)
    session.given_loads = GivenLoads("loads.csv", headings=(0.0,), wrenches=((1.0,) * 6,))
    session.open_layout(load_layout("ucat"))
    assert session.given_loads is None
