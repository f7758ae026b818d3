"""Training runs of seconds: they learn, write down what they did, and go on exactly where they stopped."""

import csv
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from finlab.errors import CheckpointError, DataError
from finlab.layout import FinModelSpec
from finlab.networks.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.networks.trained import TrainedWeights
from finlab.paper.network import NetworkConfig
from finlab.paper.training.network import make_terms, train_allocator
from finlab.paper.training.recipes import RECIPES
from finlab.paper.training.surrogate import first_surrogate, surrogate_metrics, train_surrogate
from finlab.physics import make_law
from finlab.training.first_weights import first_weights
from finlab.training.saving import Tensors, tensors_of

DRAG = make_law(FinModelSpec())
SMOKE = RECIPES["smoke"]

FIXED = ["step", "samples", "seconds", "learning_rate", "loss"]


def weights(folder: Path) -> dict[str, torch.Tensor]:
    return load_file(folder / "model.safetensors")


def same_losses(log: list[dict[str, float]], expected: list[dict[str, float]]) -> bool:
    """Equal to the last digit written, but for the time it took."""
    without_time = [
        [{k: v for k, v in row.items() if k != "seconds"} for row in rows] for rows in (log, expected)
    ]
    return without_time[0] == without_time[1]


def same_weights(folder: Path, expected: Path) -> bool:
    mine, theirs = weights(folder), weights(expected)
    return mine.keys() == theirs.keys() and all(torch.equal(mine[key], theirs[key]) for key in mine)


def held_out_guidance(base: TrainedWeights, network: Tensors) -> float:
    """Physics guidance on samples that no smoke run comes to see."""
    training = replace(RECIPES["smoke"].allocator_training, batch_size=1024)
    with torch.no_grad():
        terms = make_terms(base, SMOKE.network, training, 0, torch.device("cpu"))
        return float(terms(network, 10_000)["guidance"])


def test_the_surrogate_learns(smoke_surrogate) -> None:
    fresh = surrogate_metrics(SMOKE.surrogate, first_surrogate(SMOKE.surrogate, 0), DRAG, seed=1)
    learned = smoke_surrogate.checkpoint.metrics["surrogate"]
    assert learned["wrench_error_norm"] < 0.95 * fresh["wrench_error_norm"]
    assert smoke_surrogate.checkpoint.network_sizes is None


def test_the_allocator_learns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finlab.training.loop.LOG_EVERY", 20)  # other tests log each step
    base = read_checkpoint(resolve_checkpoint("paper"))  # its surrogate knows what a fin can do
    fresh = held_out_guidance(base, first_weights(SMOKE.network.shapes(), 0))
    run = train_allocator("smoke", tmp_path, surrogate=Path("paper"), steps=100, learning_rate=3e-3)
    assert held_out_guidance(base, tensors_of(run.network)) < 0.6 * fresh
    with (tmp_path / "log.csv").open(newline="") as file:
        imitation = [float(row["imitation"]) for row in csv.DictReader(file)]
    assert imitation[-1] < imitation[0] - 1.0  # the loss itself grows with the weight of its guidance


def test_the_log_has_a_column_for_each_term(smoke_surrogate, smoke_run) -> None:
    assert list(smoke_surrogate.log[0]) == FIXED
    assert list(smoke_run.log[0]) == [*FIXED, "imitation", "entropy", "guidance"]
    assert [row["step"] for row in smoke_run.log] == list(range(40))
    assert [row["samples"] for row in smoke_run.log] == [128 * (k + 1) for k in range(40)]
    seconds = [row["seconds"] for row in smoke_run.log]
    assert seconds == sorted(seconds)


def test_the_loss_is_the_weighted_sum_of_its_terms(smoke_run) -> None:
    training = RECIPES["smoke"].allocator_training
    start, end = training.guidance_start, training.guidance
    for row in smoke_run.log:
        ramp = min(1.0, row["step"] / (training.ramp * training.steps))
        beta = start + ramp * (end - start)
        expected = row["imitation"] + beta * row["guidance"] + training.entropy * row["entropy"]
        assert row["loss"] == pytest.approx(expected, rel=1e-5)


def test_the_checkpoint_says_how_it_was_made(smoke_surrogate, smoke_run) -> None:
    checkpoint = read_checkpoint(smoke_run.folder)
    made = checkpoint.training["allocator"]
    assert (made["preset"], made["seed"], made["steps_done"], made["samples"]) == ("smoke", 0, 40, 40 * 128)
    assert made["surrogate_sha256"] == smoke_surrogate.checkpoint.sha256
    assert checkpoint.training["surrogate"]["samples"] == 60 * 256
    assert checkpoint.metrics == smoke_surrogate.checkpoint.metrics


def test_the_surrogate_stays_as_it_is(smoke_surrogate, smoke_run) -> None:
    before, after = weights(smoke_surrogate.folder), weights(smoke_run.folder)
    assert all(torch.equal(after[key], value) for key, value in before.items())
    assert any(key.startswith("network.") for key in after)


def test_the_seed_decides_the_run(smoke_run, resume, tmp_path: Path) -> None:
    again = resume(tmp_path / "again", stop_after=3)
    other = resume(tmp_path / "other", seed=1, stop_after=3)
    assert same_losses(again.log, smoke_run.log[:3])
    assert not same_losses(other.log, smoke_run.log[:3])


def test_a_stopped_run_goes_on_as_if_it_had_not_been(smoke_run, resume, tmp_path: Path) -> None:
    stopped = resume(tmp_path / "run", stop_after=13)
    assert len(stopped.log) == 13
    assert stopped.checkpoint.training["allocator"]["steps_done"] == 13
    finished = resume(tmp_path / "run")
    assert same_losses(finished.log, smoke_run.log)
    assert same_weights(finished.folder, smoke_run.folder)


def test_a_finished_run_is_left_alone(smoke_run, resume) -> None:
    before = smoke_run.log
    again = resume(smoke_run.folder)
    assert same_losses(again.log, before)
    assert again.checkpoint.sha256 == smoke_run.checkpoint.sha256


def test_a_stopped_surrogate_goes_on_as_if_it_had_not_been(smoke_surrogate, tmp_path: Path) -> None:
    train_surrogate("smoke", tmp_path / "run", stop_after=25)
    train_surrogate("smoke", tmp_path / "run")
    assert same_weights(tmp_path / "run", smoke_surrogate.folder)


def test_a_run_that_dies_while_it_writes_the_checkpoint_can_go_on(
    smoke_run, resume, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def out_of_power(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("finlab.paper.training.network.save_checkpoint", out_of_power)
        with pytest.raises(KeyboardInterrupt):
            resume(tmp_path / "run")
    finished = resume(tmp_path / "run")
    assert same_weights(finished.folder, smoke_run.folder)


@pytest.mark.parametrize(
    ("options", "named"),
    [({"seed": 1}, "seed"), ({"steps": 50}, "training"), ({"entropy": 0.0}, "training")],
)
def test_refuses_to_go_on_with_other_settings(
    resume, tmp_path: Path, options: dict[str, object], named: str
) -> None:
    folder = resume(tmp_path / "run", stop_after=1).folder
    before = weights(folder)
    with pytest.raises(DataError) as caught:
        resume(folder, **options)
    assert str(caught.value) == (
        f"{folder}: holds a run with other settings ({named}); "
        "resume with the same ones, or train into an empty folder"
    )
    assert all(torch.equal(weights(folder)[key], value) for key, value in before.items())


def test_refuses_to_go_on_with_another_surrogate(resume, untrained_checkpoint: Path, tmp_path: Path) -> None:
    folder = resume(tmp_path / "run", stop_after=1).folder
    with pytest.raises(DataError, match=r"other settings \(surrogate_sha256\)"):
        train_allocator("smoke", folder, surrogate=untrained_checkpoint)


def test_refuses_a_missing_surrogate(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match="no such checkpoint folder"):
        train_allocator("smoke", tmp_path / "run", surrogate=tmp_path / "nowhere")


@pytest.mark.exhaustive
def test_the_paper_s_recipe_runs(fewer_samples: None, tmp_path: Path) -> None:
    surrogate = train_surrogate("paper", tmp_path / "surrogate", steps=2)
    assert surrogate.metrics["surrogate"].keys() == {"wrench_error_norm"}
    paper = train_allocator(
        "paper", tmp_path / "paper", surrogate=tmp_path / "surrogate", steps=2, batch_size=32
    )
    assert paper.network_of(NetworkConfig) == RECIPES["paper"].network
