"""Training of the network of method `mdn`: repeatable answers, batches as seen, a likelihood that
is one."""

import csv
import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch

from finlab.research.mdn.network import ForceNetworkConfig
from finlab.research.mdn.training import train_mdn as mdn_training
from finlab.research.mdn.training.teacher import TeacherData, read_answers, write_answers
from finlab.research.mdn.training.train_mdn import RECIPES, losses, train_mdn
from finlab.research.networks.checkpoint import read_checkpoint, write_checkpoint
from finlab.research.networks.trained import TrainedWeights
from finlab.research.training import loop
from finlab.research.training.loop import first_weights

SMOKE = RECIPES["smoke"]
"""The recipe of a training of seconds."""


@pytest.fixture(scope="module")
def shard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of the teacher's answers."""
    return write_answers(tmp_path_factory.mktemp("answers"), SMOKE.answers, 0, 0)


def test_a_file_of_answers_depends_on_its_seed_and_number(shard: Path, tmp_path: Path) -> None:
    again = read_answers(write_answers(tmp_path, SMOKE.answers, 0, 0))
    other = read_answers(write_answers(tmp_path, SMOKE.answers, 0, 1))
    first = read_answers(shard)
    assert first.keys() == again.keys()
    for n, arrays in first.items():
        assert all(np.array_equal(values, again[n][name]) for name, values in arrays.items())
    groups = [*first.values(), *other.values()]
    asked = [np.abs(group["asked"]).sum() for group in groups]
    assert len(set(asked)) == len(asked)


def test_batches_say_what_a_robot_and_its_mirror_image_are_asked_for(shard: Path) -> None:
    answers = TeacherData([shard])
    known = sum(
        int((group["weight"].sum(-1) > 0.5).sum()) for group in read_answers(shard).values()
    )
    assert len(answers) == known > 0
    batch = answers.draw(np.random.default_rng(0), 64)
    assert batch.weight.sum(1) == pytest.approx(torch.ones(64), abs=1e-5)
    # The ways still solve P x = p: in these frames p is real and not negative.
    way = torch.view_as_complex(batch.way.contiguous())
    share = way * way.abs()
    a, b = torch.view_as_complex(batch.pairs.reshape(*batch.pairs.shape[:-1], 2, 2)).unbind(-1)
    got = torch.einsum("bij,blj->bli", a, share) + torch.einsum("bij,blj->bli", b, share.conj())
    asked = batch.nodes[..., 0].square().to(got.dtype)
    missed = (got - asked[:, None]).abs().amax(-1)
    assert missed[batch.weight > 0.01].max() < 0.05


def test_the_loss_is_per_fin_and_rewards_components_that_are_used(shard: Path) -> None:
    answers = TeacherData([shard])
    batch = answers.draw(np.random.default_rng(0), 32)
    network = partial(SMOKE.network, first_weights(SMOKE.network.shapes(), 0))
    found = losses(network, batch, 1.0, 0.0)
    spread = losses(network, batch, 1.0, 0.5)
    assert found["loss"] == found["imitation"]
    given = network(batch.nodes, batch.pairs)
    expected = -(given.log_prob(batch.way) * batch.weight).sum(-1).mean() / batch.nodes.shape[1]
    torch.testing.assert_close(found["imitation"], expected)
    torch.testing.assert_close(spread["loss"], expected - 0.5 * spread["used"].log())
    assert 1.0 <= spread["used"] <= SMOKE.network.n_components + 1e-4


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of a training that is done."""
    folder = tmp_path_factory.mktemp("trained")
    train_mdn("smoke", folder)
    return folder


def with_answers(trained: Path, folder: Path) -> Path:
    """A folder for a run with the answers of one that has ended."""
    shutil.copytree(trained / "answers", folder / "answers")
    return folder


def test_it_learns(trained: Path, tmp_path: Path) -> None:
    finished = read_checkpoint(trained)
    assert finished.training["mdn"]["steps_done"] == 30
    assert finished.network_of(ForceNetworkConfig) == SMOKE.network
    with (trained / "log.csv").open(newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    assert [row["step"] for row in rows] == [0, 20, 29]
    assert rows[-1]["imitation"] < rows[0]["imitation"]
    assert rows[-1]["seconds"] >= rows[1]["seconds"]
    assert train_mdn("smoke", with_answers(trained, tmp_path), steps=2).sha256 != finished.sha256


def test_time_that_is_up_ends_the_run(trained: Path, tmp_path: Path) -> None:
    cut = train_mdn("smoke", with_answers(trained, tmp_path), seconds=1e-9)
    assert cut.training["mdn"]["steps_done"] == 1


def test_a_run_that_died_ends_with_the_weights_of_one_that_did_not(
    trained: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = read_checkpoint(trained)
    died = with_answers(trained, tmp_path / "died")
    saves = 0

    def dying(folder: Path, weights: TrainedWeights) -> TrainedWeights:
        nonlocal saves
        saves += 1
        if saves == 12:
            raise KeyboardInterrupt
        return write_checkpoint(folder, weights)

    monkeypatch.setattr(loop, "SAVE_EVERY_S", 0.0)
    monkeypatch.setattr(mdn_training, "write_checkpoint", dying)
    with pytest.raises(KeyboardInterrupt):
        train_mdn("smoke", died, resume=True)
    found = train_mdn("smoke", died, resume=True)
    assert 12 < saves < 12 + 30  # it did not begin anew
    for name, value in expected.network.items():
        np.testing.assert_allclose(found.network[name], value, atol=1e-6)


def test_answers_end_with_half_of_the_time(tmp_path: Path) -> None:
    settings = replace(SMOKE.answers, files=6)
    assert len(mdn_training.answers_in(tmp_path, settings, 0, until=0.0)) == 2
    assert len(list(tmp_path.iterdir())) == 2
