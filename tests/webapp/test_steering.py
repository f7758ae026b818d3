"""Ways to ask: one axis alone, a sweep; and what is seen of a fin on its way."""

import asyncio
from typing import Any

import pytest

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.loops import AtOnce, page_of, running
from webapp.session import Session
from webapp.session.core import MAX_STEPS
from webapp.tasks import sweeping
from webapp.tasks.answering import Answering
from webapp.tasks.sweeping import POINTS, Sweep


@pytest.fixture
def session() -> Session:
    return Session(load_layout(shipped_layouts()["ucat"]))


def test_an_axis_alone_and_the_other_way_round(session: Session) -> None:
    session.set_only_axis(5)
    first = session.state.target
    assert first[5] > 0 and first[:5] == (0.0,) * 5
    session.set_only_axis(5)
    assert session.state.target[5] == -first[5]
    session.set_only_axis(0)
    assert session.state.target[5] == 0.0 and session.state.target[0] > 0
    session.open_layout(load_layout(shipped_layouts()["no_yaw"]))
    with pytest.raises(FinlabError, match="acts on yaw"):
        session.set_only_axis(5)


def test_a_full_history_keeps_its_oldest_step_when_a_sweep_is_stopped(session: Session) -> None:
    for k in range(MAX_STEPS + 5):
        session.set_only_axis(k % 3)
    past = list(session.history.past)
    assert len(past) == MAX_STEPS
    session.sweep_target(0, 0.5)
    session.sweep_target(0, 0.6)
    session.end_sweep()
    assert session.history.past == past


def test_a_sweep_is_one_step_and_ends_when_someone_else_steers(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweeping, "STEP_S", 0.001)

    async def run() -> Sweep:
        answering: Any = None

        class Ready:
            """A worker that is never busy."""

            def forget(self, key: object) -> None:
                pass

            def submit(self, key: object, job: Any, failed: Any) -> None:
                job()

        def changed() -> None:
            sweep.note(answering)

        def do(act: Any) -> None:
            act()
            answering.ask()

        worker: Any = Ready()
        answering = Answering(page_of(worker, session, changed=changed))
        sweep = Sweep(page_of(worker, session, loop=running(), do=do))
        with pytest.raises(FinlabError, match="smaller end first"):
            sweep.start(0, 2.0, -2.0)
        sweep.start(0, -2.0, 2.0)
        while not all(abs(sweep.error) < 9.0):
            await asyncio.sleep(0.01)
        assert sweep.running
        session.set_target(1, 0.5)
        while sweep.running:
            await asyncio.sleep(0.01)
        return sweep

    sweep = asyncio.run(asyncio.wait_for(run(), 60.0))
    assert sweep.force.shape == (4, POINTS) and (sweep.force >= 0).all()
    session.undo()
    assert session.history.undo_name == "Sweep Fx"
    session.undo()
    assert session.state.target[0] == 1.2


def test_a_sweep_goes_to_and_fro(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeping, "POINTS", 4)
    loop, seen = AtOnce(), []

    def do(act: Any) -> None:
        act()
        seen.append(session.state.target[5])

    sweep = Sweep(page_of(None, session, loop=loop, do=do))
    sweep.start(5, -0.1, 0.2)
    for _ in range(11):
        loop.ring()
    assert seen == pytest.approx([-0.1, 0.0, 0.1, 0.2, 0.1, 0.0, -0.1, 0.0, 0.1, 0.2, 0.1], abs=1e-12)
    sweep.stop()
    assert not sweep.running
    assert session.state.target[5] == 0.25 and session.history.undo_name is None, "as if nothing had been"
    session.set_target(1, 0.5)
    sweep.start(5, -0.1, 0.2)
    for _ in range(3):
        loop.ring()
    assert sweep.running and seen[-3:] == pytest.approx([-0.1, 0.0, 0.1], abs=1e-12), (
        "what came between is no change"
    )
