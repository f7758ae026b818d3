"""A log that is dropped on the page: what is said of it, its moments on the robot, and what is
refused."""

from pathlib import Path

import numpy as np
import pytest

from finlab.layout import load_layout
from tests.log.conftest import px4_dive
from tests.webapp.stand_in import Direct, context_of
from webapp.panels.log_tab import _losses, _summary, log_plots, replays_table
from webapp.session import Session
from webapp.tasks.log_reading import LogReading
from webapp.tasks.swimming import Swimming


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> tuple[Session, LogReading]:
    """A dive whose yaw was out of reach for a while."""
    path = px4_dive(tmp_path_factory.mktemp("log") / "dive.ulg", n=600).path
    session = Session(load_layout("ucat"))
    context = context_of(Direct(), session)
    reading = LogReading(context, Swimming(context))
    reading.open("../some where/dive.ulg", path.read_bytes())
    assert reading.attend()
    assert reading.error is None and session.desk.task == "Log"
    return session, reading


def test_it_says_what_was_lost_and_draws_it(judged: tuple[Session, LogReading]) -> None:
    log = judged[1].answer
    assert log is not None and log.source == "dive.ulg"
    said = _summary(log, None, None)
    assert "<progress" not in said and "Yaw (Tz) was lost" in said and "--" not in said
    assert _losses(log, None).count("data-press='spell'") == len(log.spells) > 0
    assert log_plots(log, None).count("<svg") == sum(value > 0.0 for value in log.asked) + 1
    table = replays_table(log)
    assert table.count("<tr>") == len(log.replays) + 1 and log.held_by is not None
    assert table.count("class='given'>") == 2 and log.held_by.name in table, (
        "the one that holds it, and the key"
    )


def test_a_moment_of_it_is_put_on_the_robot(judged: tuple[Session, LogReading]) -> None:
    session, reading = judged
    log = reading.answer
    assert log is not None
    spell = log.spells[0]
    assert session.state.layout == log.robot and session.history.undo_name == "Robot of dive.ulg"
    np.testing.assert_allclose(session.state.target[5], 18.0, rtol=1e-3)
    assert reading.moment is not None and spell.start <= reading.moment <= spell.end
    assert "chosen" in _losses(log, reading.moment) and "currentColor" in log_plots(
        log, reading.moment
    )
    session.undo()
    assert session.state.layout.name == "ucat"


def test_what_is_no_log_is_refused_in_a_sentence(
    judged: tuple[Session, LogReading], tmp_path: Path
) -> None:
    session = Session(load_layout("ucat"))
    context = context_of(Direct(), session)
    reading = LogReading(context, Swimming(context))
    reading.open("dive.ulg", b"no log")
    assert reading.attend() and reading.answer is None and reading.error is not None
    assert str(tmp_path.parent) not in reading.error and "/tmp" not in reading.error
    assert reading.is_error_new and reading.title == "Not judged"
    reading.choose_robot(True)
    assert reading.question is not None and reading.question.robot == session.state.layout
