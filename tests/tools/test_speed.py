"""The tool that measures speed: times without the clock's, goals, rows of each group, peers that
answer the same question, and the table of the page."""

from collections.abc import Iterator
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np
import pytest

import tools.figures
from finlab.errors import DataError
from finlab.layout import load_layout
from finlab.research.evaluation.document import Row, to_text
from tools import speed
from tools.speed_groups import around, batches, calls, coupled, peers
from tools.speed_groups.peer_solvers import Thrusters
from tools.speed_groups.questions import (
    allocator_of,
    core_side,
    rim_targets,
    thruster_effectiveness,
    unit_side,
    walk,
)
from tools.speed_groups.timing import (
    Goal,
    Side,
    Sizes,
    clock_ns,
    figure_row,
    least_times,
    ratio_row,
    tail_row,
)

TINY = Sizes(questions=3, repeats=1, batch=20, swim_s=12.0, steps=2, drags=1)
"""Sizes with which a group takes a moment."""


def test_the_least_of_the_repeats_counts_without_the_clock() -> None:
    asked = []

    def slow_at_first(name: str) -> None:
        asked.append(name)
        if len(asked) <= 2:
            sum(range(300_000))

    times = least_times({"a": Side(slow_at_first, [("a",), ("b",)]), "b": Side(len, [("",)])}, 3)
    assert asked == ["a", "b"] * 3
    assert {name: array.shape for name, array in times.items()} == {"a": (2,), "b": (1,)}
    assert (times["a"] < 300_000).all() and clock_ns() > 0


def test_rows_are_ratios_of_medians() -> None:
    times = np.arange(1.0, 102.0)
    row = ratio_row("call", "A", "unit", times, np.array([2.0, 3.0, 100.0]), Goal(17.0))
    assert row["figure"] == 51.0 / 3.0 and row["p99"] == 100.0 / 3.0
    assert (row["goal"], row["met"]) == ("≤ 17", "yes")
    tail = tail_row("call", "A", times, Goal(1.0))
    assert tail["figure"] == 100.0 / 51.0 and tail["met"] == "no"
    assert figure_row("swim", "A", "second", 300.0, Goal(300, is_least=True))["met"] == "yes"
    assert figure_row("swim", "A", "second", 299.0, Goal(300, is_least=True))["met"] == "no"
    assert "met" not in figure_row("swim", "A", "second", 299.0)


@pytest.mark.parametrize("robot", ["bluerov2", "A"])
def test_targets_lie_at_their_share_of_reach(robot: str) -> None:
    allocator = allocator_of(robot)
    assert all(allocator.allocate(w).reachable for w in rim_targets(allocator, 0.97, 5))
    assert not any(allocator.allocate(w).reachable for w in rim_targets(allocator, 1.03, 5))
    path = walk(allocator, 50)
    assert path.shape == (50, 6) and (path[:, ~allocator.layout.commanded] == 0.0).all()


def test_the_core_solves_what_allocate_answers() -> None:
    allocator = allocator_of("A")
    targets = rim_targets(allocator, 0.5, 3)
    answers = allocator.allocate_batch(targets).command
    solve, questions = core_side(allocator.layout, targets)
    for question in questions:
        solve(*question)
    *_, memory, records = solve.__kwdefaults__["keep"]
    assert len(records) == 3
    np.testing.assert_allclose(memory.command[:3], answers, atol=1e-9)


def test_the_core_solves_in_a_flow_what_allocate_answers() -> None:
    robot, flow = calls.IN_FLOW
    allocator = allocator_of(robot)
    targets = rim_targets(allocator, 0.5, 3, flow=flow)
    answers = allocator.allocate_batch(targets, flow=flow)
    assert answers.reachable.all()
    solve, questions = core_side(allocator.layout, targets, flow=flow)
    for question in questions:
        solve(*question)
    *_, memory, _ = solve.__kwdefaults__["keep"]
    np.testing.assert_allclose(memory.command[:3], answers.command, atol=1e-6)


def test_the_unit_is_the_clipped_pseudo_inverse() -> None:
    call, questions = unit_side(4)
    layout = load_layout("bluerov2_heavy")
    (target,) = questions[0]
    force = call(target)
    assert (force >= layout.lower[:, 0]).all() and (force <= layout.upper[:, 0]).all()
    small = 0.01 * target
    np.testing.assert_allclose(thruster_effectiveness(layout) @ call(small), small, atol=1e-12)


INSTALLED = [peer for peer in peers.PEERS if peers.is_installed(peer.package)]
"""Solvers that run here."""


@pytest.mark.parametrize("peer", INSTALLED, ids=lambda peer: f"{peer.package}{peer.make.__name__}")
def test_peers_answer_the_same_question(peer: peers.Peer) -> None:
    robot = Thrusters.of(load_layout("bluerov2_heavy"))
    solve = peer.make(robot)
    allocator = allocator_of("bluerov2_heavy")
    targets = rim_targets(allocator, 0.3, 3)
    forces = np.array([solve(target) for target in targets])
    np.testing.assert_allclose(forces @ robot.B.T, targets, atol=1e-6)
    assert (forces >= robot.low - 1e-9).all() and (forces <= robot.high + 1e-9).all()
    if "watts" in peer.words:
        best = allocator.allocate_batch(targets).command[:, :, 0]
        np.testing.assert_allclose(forces, best, atol=1e-3 * robot.high.max())
    else:
        # Nothing is clipped so far within reach: least squares are the pseudo-inverse's.
        np.testing.assert_allclose(forces, targets @ np.linalg.pinv(robot.B).T, atol=1e-5)


@pytest.mark.parametrize(
    "peer",
    [peer for peer in peers.PEERS_BEYOND if "least squares" in peer.words],
    ids=lambda peer: peer.package,
)
def test_peers_beyond_reach_give_the_nearest_wrench(peer: peers.Peer) -> None:
    if not peers.is_installed(peer.package):
        pytest.skip(f"{peer.package} is not installed")
    robot = Thrusters.of(load_layout("bluerov2_heavy"))
    solve = peer.make(robot)
    allocator = allocator_of("bluerov2_heavy")
    for target in rim_targets(allocator, 1.5, 3):
        nearest = allocator.allocate(target).wrench
        np.testing.assert_allclose(robot.B @ solve(target), nearest, atol=1e-4 * robot.scale.max())


def test_a_peer_that_is_not_installed_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    gone = peers.Peer("squared force", peers.PEERS[0].make, "no_such_solver")
    monkeypatch.setattr(peers, "PEERS", (gone, peers.PEERS[-1]))
    rows = list(peers.peer_rows(TINY))
    own, left_out, pseudo_inverse = rows[:3]
    assert own["error"] < 1e-9 and own["watts"] == 1.0 and own["missed"] == 0.0
    assert left_out["met"] == "left out: no_such_solver is not installed"
    assert "figure" not in left_out and pseudo_inverse["figure"] > 0.0
    assert pseudo_inverse["watts"] > 1.0
    near_rim = rows[5]
    assert near_rim["missed"] > 0.0 and near_rim["error"] > 1e-3
    beyond = [row for row in rows if "1.5" in row["measured"] and "error" in row]
    assert beyond[0]["over"] == "itself"
    assert all(row["error"] >= beyond[0]["error"] * (1.0 - 1e-6) for row in beyond)


def test_rows_of_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calls, "GOALS_OVER_UNIT", {"bluerov2_heavy": (Goal(3), Goal(4))})
    monkeypatch.setattr(calls, "GOALS_BEYOND", {"bluerov2_heavy": {"closest": Goal(2)}})
    monkeypatch.setattr(calls, "READ_ROBOTS", ("bluerov2_heavy",))
    rows = list(calls.call_rows(TINY))
    assert len(rows) == 7 + 3 + 3 + 1 + 3 + 2
    assert all(row["figure"] > 0.0 for row in rows)
    assert {row["robot"] for row in rows} == {"bluerov2_heavy", "torpedo"}
    assert [row["goal"] for row in rows if "policy `closest`" in row["measured"]] == ["≤ 2"]


def test_rows_of_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batches, "GOALS", {"bluerov2_heavy": Goal(0.2)})
    monkeypatch.setattr(batches, "THREADED", ("bluerov2_heavy",))
    rows = list(batches.batch_rows(TINY))
    assert [row["over"] for row in rows] == ["the unit", "`allocate`", "one thread"]
    assert all(row["figure"] > 0.0 for row in rows)


def test_rows_of_jets_and_of_a_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_network(words: str, network: object, sizes: Sizes) -> Iterator[Row]:
        yield figure_row(words, "robot", "without", 1.0)

    monkeypatch.setattr(coupled, "trained_network", lambda folder: None)
    monkeypatch.setattr(coupled, "_rows_of_network", no_network)
    jets, batch, network = coupled.coupled_rows(TINY)
    assert jets["figure"] > 1.0 and batch["figure"] > 0.0
    assert network["measured"].endswith("with a learned interaction")


def test_without_torch_and_viser_their_rows_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coupled, "find_spec", lambda name: None)
    monkeypatch.setattr(around, "find_spec", lambda name: None)
    monkeypatch.setattr(coupled, "_rows_of_jets", lambda sizes: iter(()))
    rows = [*coupled.coupled_rows(TINY), *around.slider_rows(TINY), *around.training_rows(TINY)]
    assert [row["met"].split()[2] for row in rows] == ["torch", "viser", "torch"]


def test_rows_of_what_is_around(monkeypatch: pytest.MonkeyPatch) -> None:
    cost = SimpleNamespace(ratio=5.0)
    monkeypatch.setattr(around, "slider_rows", lambda sizes: iter(()))
    monkeypatch.setattr(
        "finlab.research.paper.training.training_costs.training_costs",
        lambda preset, folder, steps: {"surrogate": cost},
    )
    monkeypatch.setattr(around, "PREPARED", {2: None, 3: Goal(1e9)})
    monkeypatch.setattr(around, "PREPARATIONS", 1)
    monkeypatch.setattr(around, "SWIMMERS", ("bluerov2_heavy",))
    monkeypatch.setattr(around, "SWIMS", 1)
    monkeypatch.setattr(around, "STARTS", 1)
    monkeypatch.setattr(around, "FIRST_ANSWER", "import numpy")
    rows = {row["measured"]: row for row in around.around_rows(TINY)}
    assert rows["simulated seconds of a swim"]["figure"] > 1.0
    assert rows["a step of the training of the surrogate"]["figure"] == 5.0
    assert rows["`Allocator(layout)`"]["met"] == "yes"
    assert rows["the first answer of a process"]["figure"] > 0.0


def test_groups_are_chosen_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    def rows(sizes: Sizes) -> Iterator[Row]:
        yield figure_row("it", "A", "the unit", float(sizes.questions), Goal(10))

    monkeypatch.setattr(speed, "GROUPS", {"call": rows, "peers": rows})
    (row,) = speed.experiment.rows(groups=("peers",), questions=7)
    assert row["group"] == "peers" and row["figure"] == 7.0 and row["met"] == "yes"
    assert len(speed.experiment.rows()) == 2
    with pytest.raises(DataError, match="groups: expected some of all, call, peers, got 'nobody'"):
        speed.experiment.rows(groups=("nobody",))


def test_the_page_has_command_table_and_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    def rows(sizes: Sizes) -> Iterator[Row]:
        yield figure_row("it", "A", "the unit", 2.0, Goal(3))

    monkeypatch.setattr(speed, "GROUPS", {"call": rows})
    table = tools.figures.table_of("speed", ["measured", "figure", "goal", "met"])
    lines = table.strip().splitlines()
    assert lines[0] == "`python tools/speed.py`:"
    assert "| it | 2.00 | ≤ 3 | yes |" in lines
    assert lines[-1].startswith("Measured on 20") and f"numpy {version('numpy')}" in lines[-1]
    results = to_text(*speed.experiment.results(speed.experiment.rows()))
    assert "Measured on" in results and "99th" in results
