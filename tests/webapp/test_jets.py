"""Jets on the page: the switch, cones and arrows in the view, and the answer that leaves jets
out."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.interaction.jets import Jets
from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from tests.webapp.test_faults import Tab
from tests.webapp.test_faults_in_handlers import handles, use
from webapp.panels.wrench_tab import jets_table
from webapp.scene.jet_nodes import cone
from webapp.session import Session, files
from webapp.session.state import State
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver

HEAVY = load_layout("bluerov2_heavy")
"""Eight thrusters without jets."""
HEAVY_WITH_JETS = replace(HEAVY, interaction=Jets(hull=0.2, uncertain=0.1))
"""The same with jets of constants that are not the default ones."""
SURGE = (30.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""A wrench straight ahead [N, N m]."""


@pytest.mark.parametrize("layout", [load_layout("ucat"), HEAVY_WITH_JETS], ids=["none", "own"])
def test_the_switch_can_be_undone_and_remembers_the_robots_own(layout: Layout) -> None:
    session = Session(layout)
    own = layout.interaction
    session.set_jets(own is None)
    assert session.state.layout == replace(layout, interaction=Jets() if own is None else None)
    assert session.history.undo_name in ("Count jets", "Leave jets out")
    session.set_jets(own is not None)
    assert session.state.layout == layout
    session.undo()
    session.undo()
    assert session.state.layout == layout and session.history.undo_name is None
    session.open_layout(HEAVY)
    session.set_jets(True)
    assert session.state.layout.interaction == Jets(), (
        "another robot's constants are not this one's"
    )


def test_jets_travel_in_files_and_links() -> None:
    assert files.read_layout(*files.layout_file(HEAVY_WITH_JETS)).layout == HEAVY_WITH_JETS
    assert files.unpacked(files.packed(HEAVY_WITH_JETS)).layout == HEAVY_WITH_JETS


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_commands_without_jets_are_judged_with_them(speed: float) -> None:
    state = State(replace(HEAVY, interaction=Jets()), target=SURGE, speed=speed)
    solver = Solver()
    both = solver.jet_comparison(state)
    best = both.with_jets
    blind = both.without_jets
    alone = Allocator(HEAVY).allocate(SURGE)
    flow = np.array(state.flow) if state.flow else None
    miss = np.subtract(SURGE, plant_of(state.layout).wrench(alone.command, flow=flow))
    assert blind.err_norm == pytest.approx(np.linalg.norm(miss / alone.scale), rel=1e-6)
    assert best.reachable and blind.err_norm > 0.02 and blind.power < best.power
    told = jets_table(both)
    assert f"{abs(miss[0]):.3g} N of surge" in told and f"{best.power:.3g}" in told


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    """A page on which this wrench is asked for."""
    workers = Pools()
    tab = Tab(workers, HEAVY, Solver())
    tab.on_loop(
        lambda: tab.view.do(partial(tab.view.session.ask_for, [str(value) for value in SURGE]))
    )
    tab.settle()
    yield tab
    tab.close()
    workers.stop()


def test_jets_blow_against_the_forces_while_they_count(tab: Tab) -> None:
    session = tab.view.session
    assert not [
        name for name in tab.server.scene._handle_from_node_name if name.startswith("/robot/jets")
    ]
    switch = next(
        handle for handle in handles(tab.server) if getattr(handle, "label", "") == "Count jets"
    )
    use(tab.server, tab.view, switch, True)
    tab.settle()
    nodes = tab.server.scene._handle_from_node_name
    shown = tab.view.shown_allocation
    assert shown is not None and shown.layout.interaction == Jets()
    for i, force in enumerate(shown.forces):
        jet = nodes[f"/robot/jets/{i}"]
        assert jet.visible and np.allclose(jet.position, HEAVY.position[i])
        middle = jet.vertices.mean(axis=0)
        assert middle @ force == pytest.approx(
            -np.linalg.norm(middle) * np.linalg.norm(force), rel=1e-3
        )
    taken = [nodes[f"/robot/taken/{i}"].visible for i in range(HEAVY.n)]
    assert taken == [True] * 4 + [False] * 4, "jets of the lifting ones meet nothing"
    assert "taken by jets" in " ".join(tab.figures())
    view = tab.view
    assert view.board.facts is not None and view.board.facts["jet_comparison"] is not None

    def fail() -> object:
        view.do(partial(session.toggle_loss, "front_left"))
        view._write_words()
        return view.board.facts and view.board.facts["jet_comparison"]

    assert tab.on_loop(fail) is None, "no figure stands under another question"
    tab.settle()
    assert not nodes["/robot/jets/1"].visible
    made = len(nodes)
    tab.on_loop(lambda: tab.view.do(session.undo))
    use(tab.server, tab.view, switch, False)
    tab.settle()
    assert len(nodes) == made and not any(
        n.visible for name, n in nodes.items() if "/jets/" in name
    )
    assert "taken by jets" not in " ".join(tab.figures())
    tab.open(replace(load_layout("torpedo"), interaction=Jets()))
    assert not any(nodes[f"/robot/jets/{i}"].visible for i in range(1, HEAVY.n)), (
        "rudders have no jets"
    )


def test_a_jet_is_as_wide_as_the_formula_says() -> None:
    known = Jets()
    diameter = 0.1
    mesh = cone(np.array([-0.6, 0.0, 0.0]), diameter, known.width, known.spread)
    along = -mesh.vertices[:-2, 0]
    radius = np.hypot(*mesh.vertices[:-2, 1:].T)
    decay = known.spread * (radius / diameter) ** 2 / ((along / diameter) ** 2 + known.width**2)
    np.testing.assert_allclose(decay, 1.0)
    assert along.max() == pytest.approx(0.6) and radius.min() == pytest.approx(0.051, abs=1e-3)
