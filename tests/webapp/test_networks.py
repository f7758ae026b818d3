"""The networks that method `paper` may answer with in the app."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.session.state import State
from webapp.tasks.solver import Solver

TARGET = (1.0, 0.0, 0.5, 0.0, 0.0, 0.1)


@pytest.fixture
def mine(untrained_checkpoint: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Name of a network that was trained where the app runs, beside a folder of something else."""
    shutil.copytree(untrained_checkpoint, tmp_path / "runs" / "mine")
    (tmp_path / "runs" / "other").mkdir()
    (tmp_path / "runs" / "other" / "config.json").write_text("{}")
    monkeypatch.chdir(tmp_path)
    return str(Path("runs") / "mine")


def test_a_trained_network_is_offered_and_answers(mine: str, layout_a: Layout) -> None:
    solver, state = Solver(), State(layout_a, target=TARGET, method="paper")
    assert list(solver.networks()) == ["paper", mine] and solver.first_network == "paper"
    chosen = state.with_setting("network", mine)
    answers = [solver.solve(s).checkpoint for s in (state, chosen, state.with_setting("network", "paper"))]
    assert answers == ["paper", "mine", "paper"]
    assert solver.solve(replace(chosen, method="mdn")).checkpoint == "default"
    with pytest.raises(FinlabError, match="network: expected one of"):
        solver.solve(state.with_setting("network", "/etc"))


def test_a_network_that_the_app_was_started_with_answers_first(mine: str, layout_a: Layout) -> None:
    solver = Solver(mine)
    state = State(layout_a, target=TARGET, method="paper")
    assert solver.solve(state).checkpoint == "mine" and solver.first_network == mine
    assert solver.solve(replace(state, method="mdn")).checkpoint == "default"
