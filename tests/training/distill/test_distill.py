"""The way to the fast path: answers on disk, what shares cost, and a training that goes on after a stop."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from finlab.allocation import load_allocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.cli import main
from finlab.errors import DataError
from finlab.forces.force_space import descend
from finlab.layout import layout_from_arrays
from finlab.layout.arrays import LayoutArrays
from finlab.training.distill.answers import AnswerSettings, make_answers, read_answers, write_answers
from finlab.training.distill.network import FastConfig, decode, energy
from finlab.training.distill.train import FAST_TRAINING, train_fast

SMALL = AnswerSettings(n_shards=2, layouts_per_shard=4, targets_per_layout=5)


@pytest.fixture(scope="module")
def allocator() -> LearnedAllocator:
    allocator = load_allocator()
    assert isinstance(allocator, LearnedAllocator)
    return allocator


def test_answers_are_repeatable_and_not_made_twice(allocator: LearnedAllocator, tmp_path: Path) -> None:
    write_answers(allocator, tmp_path, SMALL)
    first = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.npz")}
    answers = read_answers(tmp_path)
    assert answers.energy.shape == (8, 5) and (answers.energy > 0).all()
    assert ((answers.share >= 0) & (answers.share <= 1)).all()
    again = make_answers(allocator, SMALL, 1)
    np.testing.assert_array_equal(again.share, answers.share[4:])
    next(iter(first)).unlink()
    write_answers(allocator, tmp_path, SMALL)
    kept = [path for path, time in first.items() if path.stat().st_mtime_ns == time]
    assert len(kept) == 1 and len(read_answers(tmp_path).energy) == 8
    with pytest.raises(DataError, match="holds answers of other settings"):
        write_answers(allocator, tmp_path, AnswerSettings(n_shards=2, layouts_per_shard=3))


def test_decoding_is_that_of_the_robot(allocator: LearnedAllocator) -> None:
    answers = make_answers(allocator, SMALL, 0)
    row = int(np.flatnonzero(answers.free)[0])
    layout = layout_from_arrays(LayoutArrays(*answers[:5]), row)
    n = layout.n_fins
    prepared = allocator.pipeline.prepare(layout)
    share, target = answers.share[row, :, :n].astype(np.float64), answers.target[row].astype(np.float64)
    robot = descend(prepared.planar, target, share**4 * prepared.planar.curves.maximum, 0)
    count = len(target)
    columns = torch.tensor(answers.columns[row, :n]).expand(count, n, 2, 6)
    maximum = torch.tensor(answers.maximum[row, :n]).expand(count, n)
    alive = torch.ones(count, n)
    forces = decode(torch.tensor(share), columns, maximum, alive, torch.tensor(target))
    size = forces.size.numpy() * answers.maximum[row, :n]
    inside = (size < 0.98 * answers.maximum[row, :n]).all(axis=1)
    np.testing.assert_allclose(size[inside], np.maximum(robot.thrust, 0)[inside], rtol=2e-3, atol=2e-3)
    best = energy(forces, alive).numpy()
    np.testing.assert_allclose(best[inside], answers.energy[row][inside], rtol=0.1)


def test_training_goes_on_after_a_stop(allocator: LearnedAllocator, tmp_path: Path) -> None:
    small = FastConfig(width=8, rounds=1)
    settings = replace(FAST_TRAINING, steps=6, batch_size=16)

    def run(folder: str, stop_after: int | None = None) -> dict[str, float]:
        return train_fast(
            allocator,
            tmp_path / folder,
            config=small,
            settings=settings,
            data=SMALL,
            stop_after=stop_after,
        )

    run("parts", stop_after=3)
    stopped, whole = run("parts"), run("whole")
    assert stopped == pytest.approx(whole, rel=1e-5)
    assert {"err_norm_mean", "energy_ratio", "held_out_regret"} <= set(whole)


def test_verb_refuses_what_is_no_count(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "fast", "-o", str(tmp_path / "x"), "--steps", "0"]) == 2
    assert "steps: expected a number of at least 1" in capsys.readouterr().err
