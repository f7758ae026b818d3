"""Robots with thrusters, azimuths and rudders are shown in every task; what is for fins only says
so."""

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation import Allocator
from finlab.deploy.bundle import make_bundle
from finlab.errors import LayoutError
from finlab.layout import Azimuth, Damage, Fin, Layout, Rudder, Thruster, load_layout
from tests.webapp.test_faults import Tab
from tests.webapp.test_faults_in_handlers import handles, use
from webapp.markup.answer import fin_table
from webapp.panels.actuator_list import actuator_list
from webapp.session import Session, files
from webapp.session.state import State
from webapp.session.targets import axis_reach, full_thrust
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver

HYBRID = load_layout("turtle_hybrid")
"""Fins and thrusters."""
BLUEROV = load_layout("bluerov2_heavy")
"""Eight thrusters."""
FISH = Layout(
    "fish",
    (
        Azimuth(
            name="pod",
            position=(-0.1, 0.0, -0.1),
            turn_axis=(0.0, 0.0, 1.0),
            zero=(1.0, 0.0, 0.0),
            force=(0.0, 20.0),
            model=PowerLaw(1.0, 1.4, 1.5),
        ),
        Rudder(
            name="rudder",
            position=(-0.4, 0.0, 0.0),
            shaft=(0.0, 0.0, 1.0),
            zero=(1.0, 0.0, 0.0),
            area=0.01,
            deflection=(-np.pi / 6, np.pi / 6),
            aspect_ratio=2.0,
        ),
        Fin(name="tail", position=(-0.5, 0.0, 0.0), shaft=(0.0, 0.0, 1.0), zero=(1.0, 0.0, 0.0)),
        Fin(name="left", position=(0.2, 0.15, 0.0), mounting_angle=np.pi / 2),
    ),
)
"""A pod, a rudder and two fins."""


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    """One page, at a robot of fins."""
    workers = Pools()
    tab = Tab(workers, load_layout("ucat"), Solver())
    yield tab
    tab.close()
    workers.stop()


@pytest.mark.parametrize("layout", [HYBRID, BLUEROV, FISH], ids=lambda layout: layout.name)
def test_every_task_shows_the_robot(
    tab: Tab, layout: Layout, capsys: pytest.CaptureFixture[str]
) -> None:
    tab.client.notes.clear()
    tab.open(layout)
    session = tab.view.session
    tab.on_loop(lambda: tab.view.do(lambda: session.set_target(0, 3.0)))
    tab.settle()
    told = " ".join(tab.figures())
    assert tab.client.notes == [] and "Traceback" not in capsys.readouterr().err
    assert (
        f"{layout.n} of {layout.n} actuators" in told and "Exact" in told and "proved least" in told
    )
    assert all(name in told for name in layout.names) and "cannot be shown" not in told
    assert "Start lets this robot swim" in told and "finlab allocate`" not in told
    assert "weakest direction" in told and "independent directions" in told, (
        "reach and score are of any robot"
    )
    nodes = tab.nodes()
    assert all(f"/robot/fins/{k}/turn/blade" in nodes for k in range(layout.n))
    assert f"/robot/fins/{layout.n}/turn/blade" not in nodes
    first = layout.names[0]
    tab.on_loop(lambda: tab.view.do(lambda: session.toggle_loss(first)))
    tab.settle()
    assert "lost" in " ".join(tab.figures()) and tab.client.notes == []
    for act in (
        partial(session.add, "tilt"),
        partial(session.drag, first, (0.1, 0.0, 0.0)),
        session.undo,
    ):
        tab.on_loop(partial(tab.view.do, act))
    tab.settle()
    assert "tilt" in " ".join(tab.figures()) and tab.client.notes == []


def test_a_method_for_fins_says_so_and_watts_go_on(
    tab: Tab, capsys: pytest.CaptureFixture[str]
) -> None:
    session = tab.view.session
    tab.open(HYBRID)
    tab.on_loop(lambda: tab.view.do(lambda: session.keep_least("effort")))
    tab.settle()
    assert "method mdn works for robots of fins only" in " ".join(tab.figures())
    tab.on_loop(lambda: tab.view.do(lambda: session.keep_least("watts")))
    tab.settle()
    assert "Exact" in " ".join(tab.figures()) and "Traceback" not in capsys.readouterr().err


def test_a_bundle_opens_with_what_was_lost() -> None:
    content = make_bundle(Allocator(BLUEROV), BLUEROV.names[:1]).zip_bytes()
    opened = files.read_layout("bundle.zip", content)
    assert opened.layout == BLUEROV and opened.lost == BLUEROV.names[:1]


@pytest.mark.parametrize("layout", [HYBRID, BLUEROV, FISH], ids=lambda layout: layout.name)
def test_a_file_goes_out_and_comes_back(
    layout: Layout, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    opened = files.read_layout(*files.layout_file(layout)).layout
    assert opened.actuators == layout.actuators
    assert {"turtle_hybrid", "bluerov2_heavy"} <= set(files.shipped())
    session = Session(load_layout("ucat"))
    session.open_layout(opened)
    session.set_center_of_gravity((0.01, 0.0, 0.0))
    moved = session.state.layout.position - opened.position
    np.testing.assert_allclose(moved, moved[:1].repeat(layout.n, axis=0), err_msg="all move along")


def test_each_actuator_has_a_row_with_its_type_and_force() -> None:
    state = State(FISH, target=(3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    answer = Solver().solve(state)
    table = fin_table(state.layout, state.damage, answer, full_thrust(FISH), None)
    assert "azimuth, " in table and "rudder, " in table and table.count("<tr") == 5
    assert "thruster" in fin_table(
        BLUEROV, Damage(), Solver().solve(State(BLUEROV)), full_thrust(BLUEROV), None
    )
    listed = actuator_list(state, ("rudder",))
    assert "rudder" in listed and "azimuth" in listed
    assert isinstance(BLUEROV.actuators[0], Thruster)


def test_reach_of_thrusters_is_the_sum_of_what_each_gives() -> None:
    upward = [
        part for part in BLUEROV.actuators if isinstance(part, Thruster) and abs(part.axis[2]) > 0.9
    ]
    most = sum(max(part.force[1] * part.axis[2], part.force[0] * part.axis[2]) for part in upward)
    least = sum(
        max(-part.force[1] * part.axis[2], -part.force[0] * part.axis[2]) for part in upward
    )
    assert axis_reach(BLUEROV)[2] == pytest.approx(max(most, least))
    assert axis_reach(FISH)[1] > 0.0 and full_thrust(FISH)[1] == 0.0, (
        "a rudder at rest gives nothing"
    )


def test_a_table_of_thrust_on_the_server_is_not_opened(tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("command,force_n,power_w\n-1,-5,9\n0,0,0\n1,5,9\n")
    model = {"type": "table", "path": str(tmp_path / "secret.csv")}
    thruster = {"name": "t", "type": "thruster", "position_m": [0, 0, 0], "axis": [0, 0, 1]}
    robot = {"format": "finlab-layout", "version": 2, "name": "x"}
    robot["actuators"] = [{**thruster, "force_n": [-5, 5], "model": model}]
    content = json.dumps(robot).encode()
    with pytest.raises(
        LayoutError, match="model.path of thruster 't': names a file, which is not opened here"
    ):
        files.read_layout("x.json", content)


def test_a_method_that_does_not_take_a_robot_gives_way_when_that_is_opened() -> None:
    session = Session(load_layout("ucat"))
    session.set_setting("method", "mdn")
    session.open_layout(load_layout("bluerov2_heavy"))
    session.undo()
    assert session.state.method == "mdn"
    session.redo()
    assert session.state.layout.name == "bluerov2_heavy" and session.state.method == "dual"
    session.open_layout(load_layout("ucat"))
    session.set_setting("method", "qp")
    session.open_layout(load_layout("hexa"))
    assert session.state.method == "qp", "it stays where it takes the robot"
    session.add("thruster")
    assert session.state.method == "dual"


def test_a_box_is_empty_where_nothing_is_said_and_zero_is_refused(tab: Tab) -> None:
    session = tab.view.session
    tab.open(FISH)
    tab.on_loop(lambda: tab.view.do(lambda: (session.show_task("Design"), session.select("pod"))))
    (box,) = (h for h in handles(tab.server) if getattr(h, "label", "") == "Turn rate [°/s]")
    assert np.isnan(box.value)
    use(tab.server, tab.view, box, 30.0)
    pod = session.state.layout.actuators[session.state.layout.index("pod")]
    assert (
        isinstance(pod, Azimuth) and pod.turn_rate == pytest.approx(np.pi / 6) and box.value == 30.0
    )
    tab.settle()  # else the page may write the box once more
    use(tab.server, tab.view, box, 0.0)
    tab.settle()
    pod = session.state.layout.actuators[session.state.layout.index("pod")]
    assert isinstance(pod, Azimuth) and pod.turn_rate == pytest.approx(np.pi / 6)
    assert box.value == 30.0 and "Turn rate [°/s]: expected more than 0" in tab.client.notes[-1]
    tab.type(box, "")
    pod = session.state.layout.actuators[session.state.layout.index("pod")]
    assert isinstance(pod, Azimuth) and pod.turn_rate is None and np.isnan(box.value)


__all__ = ["tab"]
