"""Methods side by side, what they keep least, and what a network proposes."""

import shutil
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.allocation import Allocation
from finlab.assets import shipped_checkpoints, shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import Layout, load_layout
from tests.webapp.stand_in import StandIn, context_of, load_stand_in, until
from webapp.markup.mode_plot import mode_plot
from webapp.markup.words import source_words, three_digits
from webapp.panels.files_tab import command_line
from webapp.panels.modes_tab import comparison_table, why_left_out
from webapp.panels.status import corner
from webapp.session.state import COMPARED, LEAST, State, compared
from webapp.session.targets import PRESETS
from webapp.tasks.comparing import Comparison, Run
from webapp.tasks.slot import Pool
from webapp.tasks.solver import Solver

UCAT = load_layout(shipped_layouts()["ucat"])
"""Four fins."""


def test_all_methods_answer_one_after_the_other(worker: Pool) -> None:
    comparison = Comparison(context_of(worker))
    assert "side by side" in comparison_table(comparison.run, False)
    comparison.start(State(UCAT, target=PRESETS["Turn"]))
    until(lambda: not comparison.run.running)
    answers = dict(comparison.run.answers)
    assert tuple(answers) == COMPARED
    assert all(isinstance(answer, Allocation) for answer in answers.values())
    table = comparison_table(comparison.run, True)
    assert table.count("<tr") == 1 + len(COMPARED) and "compare again" in table


def test_a_comparison_is_of_its_question_whatever_method_answers() -> None:
    state = State(UCAT, target=PRESETS["Turn"])
    run = Run(state)
    assert not Run().answers_other_than(state)
    paired = replace(UCAT, mirror_pairs=(("front_right", "front_left"),))
    for same in (replace(state, method="mdn"), replace(state, layout=paired)):
        assert not run.answers_other_than(same)
    others = (
        state.with_target(0, 2.0),
        state.with_loss_toggled("front_left"),
        replace(state, policy="direction"),
        replace(state, speed=0.5),
        replace(state, temperature=0.5),
        state.with_layout(UCAT.replace_actuator("front_left", position=(0.2, 0.1, 0.0))),
    )
    for other in others:
        assert run.answers_other_than(other)


@pytest.mark.parametrize("robot", ["ucat", "bluerov2", "torpedo"])
def test_a_comparison_that_is_cancelled_keeps_its_answers(robot: str, worker: Pool) -> None:
    state = State(load_layout(robot))
    gate = threading.Event()
    comparison = Comparison(context_of(worker, solver=Solver()))
    comparison.start(state)
    until(lambda: bool(comparison.run.answers))
    comparison.cancel()
    assert not comparison.run.running
    worker.submit(gate.set)
    assert gate.wait(60)  # what was under way has come
    comparison.attend()
    assert [method for method, _ in comparison.run.answers] == ["dual"] and not comparison.busy
    table = comparison_table(comparison.run, False)
    assert "…" not in table and table.count("<tr") == 1 + len(compared(state.layout))


def test_a_method_that_fails_keeps_nobody_else_waiting(worker: Pool) -> None:
    def load(method: str = "dual", checkpoint: object = None) -> object:
        return load_stand_in("ipopt" if method == "paper" else method)

    comparison = Comparison(context_of(worker, solver=Solver(load=load)))
    comparison.start(State(UCAT, target=PRESETS["Turn"]))
    until(lambda: not comparison.run.running)
    answers = dict(comparison.run.answers)
    assert answers["paper"] == "ipopt is out of order in this test"
    assert isinstance(answers["sqp"], Allocation)


def test_a_method_that_is_left_out_says_why_in_four_words() -> None:
    solver = Solver()
    reasons = {}
    for robot, method, policy in (
        ("ucat", "qp", "priority"),
        ("catamaran", "px4", "closest"),
        ("fish", "paper", "closest"),
    ):
        state = State(load_layout(robot), method=method, policy=policy)
        with pytest.raises(FinlabError) as error:
            solver.solve(state.with_target(0, 1.0))
        reasons[method] = str(error.value)
    for reason in (*reasons.values(), "something else"):
        assert len(why_left_out(reason).split()) == 4
    assert why_left_out(reasons["px4"]) == "is for thrusters alone"
    run = Run(State(UCAT), (("qp", reasons["qp"]),))
    table = comparison_table(run, False)
    assert "knows policy closest alone</td>" in table and "title='policy: method" in table


def test_what_is_in_reach_is_compared_under_every_policy(worker: Pool) -> None:
    comparison = Comparison(context_of(worker, solver=Solver()))
    comparison.start(State(UCAT, target=PRESETS["Turn"], policy="priority"))
    until(lambda: len(comparison.run.answers) >= 3)
    comparison.cancel()
    answers = dict(comparison.run.answers)
    assert isinstance(answers["dual"], Allocation) and answers["dual"].target[0] == 1.2
    qp = answers["qp"]
    if isinstance(qp, Allocation):
        assert qp.reachable
    else:
        assert qp.startswith("policy:")


def test_the_table_tells_what_is_kept_least() -> None:
    answers = {
        method: Allocator(UCAT, method).allocate(PRESETS["Turn"]) for method in ("qp", "dual")
    }
    answers["mdn"] = Allocator(UCAT, StandIn).allocate(PRESETS["Turn"])
    table = comparison_table(Run(State(UCAT), tuple(answers.items())), False)
    assert (
        three_digits(answers["dual"].power) in table and three_digits(answers["qp"].effort) in table
    )
    assert "<td>mdn</td><td>effort</td>" in table and "<td>dual</td><td>watts</td>" in table


@pytest.mark.skipif(
    "default" not in shipped_checkpoints(), reason="no trained checkpoint in the tree"
)
def test_each_mode_of_mdn_tells_its_components_and_dual_has_one_answer() -> None:
    solver = Solver()
    state = State(UCAT, target=PRESETS["Turn"], method="mdn")
    reply = solver.reply(state)
    samples = reply.answer.samples
    modes = solver.modes(reply)
    assert samples is not None and modes.refinement[0] == samples
    assert modes.visible[0].mode.sources[0].startswith("component "), (
        "the answer comes from the network"
    )
    led = {samples.source[k] for k in range(len(samples)) if modes.ends[k] == 0}
    assert led and led <= set(modes.visible[0].mode.sources)
    dear = replace(samples, effort=np.full(len(samples), 1e4))
    far = mode_plot(replace(modes, refinement=(dear, *modes.refinement[1:])), 0, None, 200)
    assert "1e+04" not in far and "e+" not in far, "samples that are far too dear stand at the edge"
    assert all(source_words(named.mode.sources).startswith("component") for named in modes.visible)
    assert {named.badge for named in modes.visible} == {"network"}


@pytest.mark.skipif(
    "default" not in shipped_checkpoints(), reason="no trained checkpoint in the tree"
)
def test_beside_the_one_answer_of_dual_stands_what_the_network_proposes() -> None:
    solver = Solver()
    state = State(UCAT, target=PRESETS["Turn"])
    reply = solver.reply(state)
    modes = solver.modes(reply)
    first, *others = (named.mode for named in modes.visible)
    assert [named.badge for named in modes.visible] == ["optimum", *["network"] * len(others)]
    assert source_words(first.sources) == "the answer" and first.power == pytest.approx(
        reply.answer.power
    )
    assert others and all(mode.err_norm < 1e-3 and mode.power >= first.power for mode in others)
    assert mode_plot(modes, 0, None, 200).count("class='mode'") == len(modes.visible)
    end = modes.refinement[-1]
    for k, place in enumerate(modes.ends):
        assert place >= 1 and end.err_norm[k] < 1e-6, "each proposal is refined to a mode, exact"
        assert end.effort[k] == pytest.approx(modes.visible[place].mode.effort, rel=0.02)
    beyond = solver.reply(state.with_target(0, 500.0))
    assert solver.modes(beyond).visible == (), "there is nothing to compare"
    for target in ((0.0,) * 6, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)):
        found = solver.modes(solver.reply(State(UCAT, target=target, method="qp")))
        badges = ["qp", "network"] if any(target) else []
        assert [named.badge for named in found.visible][:2] == badges, (
            "whoever answers, where there is a wrench"
        )


def test_what_a_page_tries_out_stays_with_its_own_answers() -> None:
    solver = Solver(load=load_stand_in)
    target = PRESETS["Turn"]
    shipped = solver.allocator(State(UCAT, method="mdn"))
    state = State(UCAT, target=target, method="mdn", temperature=1.5)
    few = solver.allocator(state)
    assert vars(few.settings)["temperature"] == 1.5
    assert solver.allocator(replace(state, temperature=None)) is shipped
    assert vars(shipped.settings)["temperature"] != 1.5
    assert solver.allocator(replace(state, method="sqp")) is solver.allocator(
        State(UCAT, method="sqp")
    )


def test_an_allocator_is_kept_until_its_robot_changes() -> None:
    solver = Solver()
    state = State(UCAT, target=PRESETS["Turn"])
    first = solver.allocator(state)
    assert solver.allocator(state.with_target(0, 2.0).with_loss_toggled(UCAT.names[0])) is first
    moved = UCAT.replace_actuator(UCAT.names[0], position=(0.2, -0.1, 0.0))
    assert solver.allocator(state.with_layout(moved)) is not first


def test_every_answer_keeps_least_what_is_asked() -> None:
    solver = Solver()
    state = State(UCAT, target=PRESETS["Turn"])
    power, effort = (solver.solve(replace(state, method=method)) for method in LEAST.values())
    assert power.power < effort.power
    assert power.effort is not None and effort.effort is not None and power.effort > effort.effort
    assert "least power" in corner(state, "", power, False, None)
    assert "least effort" in corner(state, "", effort, False, None)
    assert "--method mdn" in command_line(replace(state, method="mdn"))


TARGET = (1.0, 0.0, 0.5, 0.0, 0.0, 0.1)
"""A wrench within reach of robot A: surge, heave and yaw [N, N m]."""


@pytest.fixture
def mine(untrained_checkpoint: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Name of a network that was trained where the app runs, beside a folder of something else."""
    shutil.copytree(untrained_checkpoint, tmp_path / "runs" / "mine")
    (tmp_path / "runs" / "other").mkdir()
    (tmp_path / "runs" / "other" / "config.json").write_text("{}")
    monkeypatch.chdir(tmp_path)
    return str(Path("runs") / "mine")


def test_a_trained_network_is_offered_and_answers(mine: str, layout_a: Layout) -> None:
    solver = Solver()
    state = State(layout_a, target=TARGET, method="paper")
    assert list(solver.networks()) == ["paper", mine] and solver.first_network == "paper"
    chosen = state.with_setting("network", mine)
    answers = [
        solver.solve(s).checkpoint for s in (state, chosen, state.with_setting("network", "paper"))
    ]
    assert answers == ["paper", "mine", "paper"]
    assert solver.solve(replace(chosen, method="mdn")).checkpoint == "default"
    with pytest.raises(FinlabError, match="network: expected one of"):
        solver.solve(state.with_setting("network", "/etc"))


def test_a_network_that_the_app_was_started_with_answers_first(mine: str, layout_a: Layout) -> None:
    solver = Solver(mine)
    state = State(layout_a, target=TARGET, method="paper")
    assert solver.solve(state).checkpoint == "mine" and solver.first_network == mine
    assert solver.solve(replace(state, method="mdn")).checkpoint == "default"
