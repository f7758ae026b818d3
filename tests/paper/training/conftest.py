"""A trained smoke surrogate and one uninterrupted smoke run, which several tests compare with."""

import csv
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from finlab.networks.trained import TrainedWeights
from finlab.paper.training.network import train_allocator
from finlab.paper.training.surrogate import train_surrogate
from finlab.training.loop import LOG_FILE


class Run(NamedTuple):
    """A finished run."""

    folder: Path
    checkpoint: TrainedWeights

    @property
    def log(self) -> list[dict[str, float]]:
        """Its log, a number in every cell."""
        return read_log(self.folder)


def read_log(folder: Path) -> list[dict[str, float]]:
    with (folder / LOG_FILE).open(newline="") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


@pytest.fixture(scope="session")
def log_every_step() -> Iterator[None]:
    """Log each step instead of every twentieth, so that there is more to compare."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("finlab.training.loop.LOG_EVERY", 1)
        yield


@pytest.fixture(scope="session")
def fewer_samples() -> Iterator[None]:
    """Take the wrench statistics over fewer samples: they only need to be the same each time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("finlab.paper.training.surrogate.NORMALIZATION_SAMPLES", 20_000)
        yield


@pytest.fixture(scope="session")
def smoke_surrogate(tmp_path_factory: pytest.TempPathFactory, fewer_samples: None) -> Run:
    """The preset `smoke`'s surrogate, trained in a moment."""
    folder = tmp_path_factory.mktemp("smoke") / "surrogate"
    return Run(folder, train_surrogate("smoke", folder))


@pytest.fixture(scope="session")
def smoke_run(tmp_path_factory: pytest.TempPathFactory, smoke_surrogate: Run, log_every_step: None) -> Run:
    """The preset `smoke`'s allocator, trained without interruption."""
    folder = tmp_path_factory.mktemp("smoke") / "allocator"
    return Run(folder, train_allocator("smoke", folder, surrogate=smoke_surrogate.folder))


@pytest.fixture
def resume(smoke_surrogate: Run, log_every_step: None, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Run]:
    """Start or go on with the smoke allocator in a folder."""

    def go_on(folder: Path, **options: Any) -> Run:
        return Run(folder, train_allocator("smoke", folder, surrogate=smoke_surrogate.folder, **options))

    return go_on
