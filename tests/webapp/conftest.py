"""What the tests of the app share: a thread, a session and a swim; the process that reads files is
ready."""

from collections.abc import Iterator

import pytest

from finlab.files.worker import prepare
from finlab.layout import load_layout
from tests.webapp.stand_in import context_of
from webapp.session import Session
from webapp.tasks.slot import Pool
from webapp.tasks.swimming import Swimming

prepare(["webapp.session.files", "webapp.tasks.fitting"])


@pytest.fixture
def worker() -> Iterator[Pool]:
    """The process that computes for a page."""
    worker = Pool()
    yield worker
    worker.stop()


@pytest.fixture
def session() -> Session:
    """A session of U-CAT."""
    return Session(load_layout("ucat"))


@pytest.fixture
def swimming(worker: Pool) -> Iterator[Swimming]:
    """Swims of a page."""
    swim = Swimming(context_of(worker))
    yield swim
    swim.halt()
