"""Methods side by side, and what the network proposes."""

import threading

import numpy as np
import pytest

from finlab.allocation.allocation import Allocation
from finlab.allocation.methods import load_allocator
from finlab.assets import shipped_checkpoints, shipped_layouts
from finlab.errors import AllocationError
from finlab.layout import load_layout
from tests.webapp.loops import AtOnce
from tests.webapp.stand_in import StandIn, load_stand_in
from webapp.markup.comparison import comparison_table
from webapp.session.state import COMPARED, State
from webapp.session.targets import PRESETS
from webapp.tasks.background import Worker
from webapp.tasks.comparison import Comparison
from webapp.tasks.solver import STEPS, Solver, densities

UCAT = load_layout(shipped_layouts()["ucat"])


def test_all_methods_answer_one_after_the_other() -> None:
    worker, done = Worker(), threading.Event()
    comparison = Comparison(
        Solver(load=load_stand_in), AtOnce(), worker, lambda: comparison.running or done.set()
    )
    assert "side by side" in comparison_table(comparison, None, False, "here")
    comparison.start(State(UCAT, target=PRESETS["Turn"]))
    assert done.wait(60)
    worker.stop()
    assert tuple(comparison.answers) == COMPARED
    assert all(isinstance(answer, Allocation) for answer in comparison.answers.values())
    table = comparison_table(comparison, "qp", True, "here")
    assert table.count("<tr") == 1 + len(COMPARED) and table.count("chosen") == 1 and "compare again" in table


def test_a_method_that_fails_keeps_nobody_else_waiting() -> None:
    def load(method: str = "learned", checkpoint: object = None) -> object:
        return load_stand_in("slsqp" if method == "paper" else method)

    worker, done = Worker(), threading.Event()
    comparison = Comparison(Solver(load=load), AtOnce(), worker, lambda: comparison.running or done.set())
    comparison.start(State(UCAT, target=PRESETS["Turn"]))
    assert done.wait(60)
    worker.stop()
    assert comparison.answers["paper"] == "slsqp is out of order in this test"
    assert isinstance(comparison.answers["multistart"], Allocation)


@pytest.mark.skipif("default" not in shipped_checkpoints(), reason="no trained checkpoint in the tree")
def test_densities_of_the_shipped_network() -> None:
    allocator, failed = load_allocator(), ("front_left",)
    insight = allocator.insight(UCAT.without(failed), PRESETS["Turn"])
    assert insight is not None and insight.attention.sum(axis=1) == pytest.approx(np.ones(3))
    found = densities(insight, UCAT, failed, 0.02)
    assert found.places[0, -1] == pytest.approx(np.degrees(0.6)) and found.places[2, 0] == pytest.approx(-180)
    assert np.isnan(found.curves[1]).all()
    assert found.curves[[0, 2, 3]].max(axis=-1) == pytest.approx(1.0)
    insight = allocator.insight(UCAT, PRESETS["Turn"])
    assert insight is not None
    assert densities(insight, UCAT, (), 1.0).curves.mean() > densities(insight, UCAT, (), 0.0).curves.mean()
    assert StandIn().insight(UCAT, PRESETS["Turn"]) is None


@pytest.mark.skipif("default" not in shipped_checkpoints(), reason="no trained checkpoint in the tree")
def test_refinement_makes_a_raw_candidate_exact() -> None:
    solver, state = Solver(), State(UCAT, failed=("back_left",), target=PRESETS["Turn"])
    reply = solver.reply(state)
    frames = solver.refinement(reply)
    errors = [frame.err_norm for frame in frames]
    assert len(frames) == STEPS + 2 and frames[-1] is reply.answer
    assert errors[0] > 10 * errors[STEPS] and np.isnan(frames[0].command[2]).all()
    with pytest.raises(AllocationError, match="learned"):
        Solver(load=load_stand_in).refinement(reply)


def test_what_a_page_tries_out_stays_with_its_own_answers() -> None:
    solver, target = Solver(load=load_stand_in), PRESETS["Turn"]
    loaded = solver.loaded("learned")
    few = solver.allocator(State(UCAT, target=target, n_candidates=8, temperature=1.5, gamma=0.5))
    assert few.options == {"n_candidates": 8, "temperature": 1.5, "gamma": 0.5}
    assert solver.loaded("learned") is loaded and loaded.options["n_candidates"] == 64
    assert solver.allocator(State(UCAT, target=target, method="multistart", n_candidates=8)).options == (
        solver.loaded("multistart").options
    )
