"""Training of the network of method `mdn`: repeatable answers, batches as seen, a likelihood that is one."""

import csv
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch

from finlab.errors import DataError
from finlab.mdn.network import ForceNetworkConfig
from finlab.mdn.training.batches import MIRRORED, Answers
from finlab.mdn.training.recipes import RECIPES
from finlab.mdn.training.shards import read_shard, write_shard
from finlab.mdn.training.train import losses, make_terms, train_mdn, write_answers
from finlab.networks.checkpoint import read_checkpoint, read_normalization, resolve_checkpoint
from finlab.training.first_weights import first_weights

SMOKE = RECIPES["smoke"]
STD = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])


@pytest.fixture(scope="module")
def shard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_shard(tmp_path_factory.mktemp("answers"), SMOKE.answers, STD, 0, 0)


def test_a_file_of_answers_depends_on_its_seed_and_number(shard: Path, tmp_path: Path) -> None:
    again = read_shard(write_shard(tmp_path, SMOKE.answers, STD, 0, 0))
    other = read_shard(write_shard(tmp_path, SMOKE.answers, STD, 0, 1))
    first = read_shard(shard)
    assert first.keys() == again.keys()
    for n, arrays in first.items():
        assert all(np.array_equal(values, again[n][name]) for name, values in arrays.items())
    asked = [np.abs(group["asked"]).sum() for part in (first, other) for group in part.values()]
    assert len(set(asked)) == len(asked)


def test_batches_say_what_a_robot_and_its_mirror_image_are_asked_for(shard: Path) -> None:
    answers = Answers()
    answers.read([shard])
    answers.read([shard])  # nothing joins twice
    known = sum(int((group["weight"].sum(-1) > 0.5).sum()) for group in read_shard(shard).values())
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


def test_mirrored_features_are_the_vertical_parts() -> None:
    from finlab.mdn.features import VECTORS

    assert [place + 1 for place in VECTORS] == MIRRORED


def test_the_loss_is_per_fin_and_rewards_components_that_are_used(shard: Path) -> None:
    answers = Answers()
    answers.read([shard])
    batch = answers.draw(np.random.default_rng(0), 32)
    network = partial(SMOKE.network, first_weights(SMOKE.network.shapes(), 0))
    found, spread = losses(network, batch, 1.0, 0.0), losses(network, batch, 1.0, 0.5)
    assert found["loss"] == found["imitation"]
    given = network(batch.nodes, batch.pairs)
    expected = -(given.log_prob(batch.way) * batch.weight).sum(-1).mean() / batch.nodes.shape[1]
    torch.testing.assert_close(found["imitation"], expected)
    torch.testing.assert_close(spread["loss"], expected - 0.5 * spread["used"].log())
    assert 1.0 <= spread["used"] <= SMOKE.network.n_components + 1e-4


def test_it_learns_and_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finlab.training.loop.LOG_EVERY", 20)
    # All answers are there from the beginning, so that what is learned does not depend on the machine's load.
    scale = read_normalization(resolve_checkpoint("paper")).std
    (tmp_path / "answers").mkdir()
    write_answers(tmp_path / "answers", SMOKE.answers, scale, 0)
    stopped = train_mdn("smoke", tmp_path, stop_after=10)
    assert stopped.training["mdn"]["steps_done"] == 10
    finished = train_mdn("smoke", tmp_path)
    assert finished.training["mdn"]["steps_done"] == 30 and finished.sha256 != stopped.sha256
    assert read_checkpoint(tmp_path).network_of(ForceNetworkConfig) == SMOKE.network
    with (tmp_path / "log.csv").open(newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    assert [row["step"] for row in rows] == [0, 9, 20, 29]
    assert rows[-1]["imitation"] < rows[0]["imitation"]
    assert rows[-1]["seconds"] >= rows[1]["seconds"] and rows[-1]["targets"] > 0
    with pytest.raises(DataError, match=r"other settings \(seed\)"):
        train_mdn("smoke", tmp_path, seed=1)


def test_time_that_is_up_ends_the_run(tmp_path: Path) -> None:
    cut = train_mdn("smoke", tmp_path, seconds=1e-9)
    assert cut.training["mdn"]["steps_done"] == 1


def test_a_writer_that_has_died_ends_the_wait(tmp_path: Path) -> None:
    class Dead:
        exitcode = 1

    with pytest.raises(DataError, match="the process that writes answers has ended"):
        make_terms(SMOKE.network, tmp_path, SMOKE.answers, SMOKE.training, 0, Dead())  # type: ignore[arg-type]
