"""The sample logs, and swims of the app as logs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.log import judge
from finlab.log.judging import STOPPED, Progress
from finlab.swim.simulation.log import SHAPES, RunLog, Tick
from tests.webapp.stand_in import Direct, context_of
from webapp.markup.words import three_digits
from webapp.panels.log_tab import _summary, _whose_robot, moved_markup
from webapp.session import Session
from webapp.tasks.jobs import Jobs
from webapp.tasks.log_reading import LogReading
from webapp.tasks.log_samples import SAMPLES, Sample
from webapp.tasks.swim_logs import read_any_log
from webapp.tasks.swimming import Swimming

LARGEST = 100_000
"""Most bytes of a sample."""


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda sample: sample.file)
def test_a_sample_is_small_and_has_something_to_show(sample: Sample, tmp_path: Path) -> None:
    content = sample.content()
    assert len(content) < LARGEST
    path = tmp_path / sample.file
    path.write_bytes(content)
    judged = judge(read_any_log(path, sample.layout(), ()), improve=False)
    assert judged.axis == "Tz" and judged.n_spells == 1 and judged.held_by is not None
    np.testing.assert_allclose(judged.seconds, 30.0, atol=0.2)


def test_a_judgement_is_told_part_by_part_and_can_be_stopped(tmp_path: Path) -> None:
    path = tmp_path / "dive.ulg"
    path.write_bytes(SAMPLES[0].content())
    log = read_any_log(path, None, ())
    reports: list[Progress] = []
    whole = judge(log, improve=False, report=reports.append)
    first = reports[0]
    assert first.n_done == 0 and first.judgement.replays == () and first.judgement.axis == "Tz"
    assert first.judgement.sentence == first.judgement.loss and first.judgement.sentence[-1] == "."
    assert [report.n_done for report in reports] == [*range(len(whole.replays) + 1)]
    assert {report.n_parts for report in reports} == {len(whole.replays)}
    stopped = judge(log, report=reports.append, cancelled=lambda: len(reports) > 60)
    assert 0 < len(stopped.replays) < len(whole.replays) and stopped.improved is None
    assert STOPPED in stopped.notes
    at_once = judge(log, cancelled=lambda: True)
    assert at_once.replays == () and "lost" in at_once.sentence


def test_a_sample_puts_its_robot_and_worst_moment_on_the_page() -> None:
    session = Session(load_layout("ucat"))
    context = context_of(Direct(), session)
    reading = LogReading(context, Swimming(context))
    reading.open_sample(SAMPLES[3])
    reading.attend()
    judgement = reading.answer
    assert judgement is not None and session.state.layout == load_layout("bluerov2_heavy")
    (spell,) = judgement.spells
    assert reading.moment is not None and spell.start < reading.moment < spell.end
    np.testing.assert_allclose(session.state.target[5], 24.0, rtol=1e-6)
    assert "of the log, bluerov2_heavy" in _whose_robot(judgement, session.state.layout, False)
    improved = judgement.improved
    assert improved is not None and improved.name == "bluerov2_heavy improved"
    moved = moved_markup(judgement)
    assert "bluerov2_heavy improved" in moved and "moved" in moved
    # Both robots by the first method that was asked: what each misses, and takes.
    own, other = (
        next(replay for replay in judgement.replays if replay.robot == robot)
        for robot in ("as it is", "improved")
    )
    assert own.name == other.name and own.lost is None and other.lost is None
    assert f"By {own.name} it misses" in moved
    assert f"at {three_digits(other.watts)} W, not {three_digits(own.watts)} W." in moved
    kept = [a == improved.actuator(a.name) for a in judgement.robot.actuators]
    assert moved.count("<tr><td>") == kept.count(False)
    assert "not the robot of the log" in _whose_robot(judgement, load_layout("ucat"), False)
    assert "swim waits" in _whose_robot(judgement, judgement.robot, True)
    assert "the improved robot" in _whose_robot(judgement, improved, False)


def test_a_swim_waits_while_a_log_is_looked_at() -> None:
    session = Session(load_layout("ucat"))
    jobs = Jobs(context_of(Direct(), session))
    swimming = jobs.swimming
    swimming.start(session.swim.plan(session.state))
    swimming.attend()
    swimmer = swimming.swimmer
    assert swimmer is not None and swimming.running and jobs.visible_swimmer is swimmer
    jobs.log.open_sample(SAMPLES[3])
    assert not swimming.running and jobs.visible_swimmer is swimmer, "there is no moment yet"
    jobs.log.attend()
    assert jobs.visible_swimmer is None and swimming.active, "the moment is on the robot"
    session.show_task("Simulate")
    assert jobs.visible_swimmer is swimmer
    jobs.stop()


def test_the_empty_page_offers_samples_and_says_how_far_it_is() -> None:
    markup = _summary(None, None, None)
    assert markup.count("data-press='sample'") == len(SAMPLES)
    assert "Reading the log" in _summary(None, "reading the log", None)


def swim_of(names: tuple[str, ...], n: int = 40, layout: str = "ucat", **columns: Any) -> RunLog:
    """A swim of fins that beat alike, of n ticks."""
    count = len(names)
    shapes = {
        name: tuple(count if size is None else size for size in shape)
        for name, shape in SHAPES.items()
    }
    made = {name: np.zeros((n, *shapes.get(name, ()))) for name in Tick._fields}
    made["time"] = 0.1 * np.arange(n)
    made["alive"] = np.ones((n, count), bool)
    made["quaternion"][:, 0] = 1.0
    return RunLog(
        layout=layout,
        names=names,
        method="dual",
        controller="tracking",
        task="circle",
        water="still",
        seed=0,
        columns=made | columns,
    )


def test_a_swim_of_the_page_is_judged(tmp_path: Path) -> None:
    robot = load_layout("ucat")
    command = np.tile(0.5 * (robot.lower + robot.upper), (40, 1, 1))
    command[..., 2] = 0.0
    asked = np.zeros((40, 6))
    asked[:, 0] = 1e3  # beyond all that fins give
    swim = swim_of(robot.names, command=command, asked=asked)
    path = tmp_path / "swim.npz"
    swim.save(path)
    log = read_any_log(path, None, [load_layout("bluerov2_heavy"), robot])
    assert log.robot == robot and log.form == "finlab" and "circle" in log.notes[0]
    np.testing.assert_allclose(log.demand[:, 0], 1e3)
    assert log.command is not None
    np.testing.assert_allclose(log.command, command)
    with pytest.raises(FinlabError, match="open that robot first"):
        read_any_log(path, None, [load_layout("bluerov2_heavy")])
