"""What the tests of the app share: a worker, a session and a swim; the process that reads files is ready."""

from collections.abc import Iterator

import pytest

from finlab.files.worker import prepare
from finlab.layout import load_layout
from tests.webapp.stand_in import page_of
from webapp.session import Session
from webapp.tasks.background import Worker
from webapp.tasks.swimming import Swimming

prepare(["webapp.session.files", "webapp.tasks.fitting"])


@pytest.fixture
def worker() -> Iterator[Worker]:
    worker = Worker()
    yield worker
    worker.stop()


@pytest.fixture
def session() -> Session:
    return Session(load_layout("ucat"))


@pytest.fixture
def swimming(worker: Worker) -> Iterator[Swimming]:
    notes: list[str] = []
    swim = Swimming(page_of(worker, notify=lambda _, text: notes.append(text)))
    swim.notes = notes
    yield swim
    swim.stop()
