"""The loop of every training: its log, its rate, and runs that go on as if nothing had happened."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from finlab.errors import CommandError, DataError
from finlab.research.networks.trained import ArraysByName
from finlab.research.training import loop
from finlab.research.training.device import Workplace, workplace
from finlab.research.training.loop import LoopSettings, Training, learning_rate, seeded_generator

SETTINGS = LoopSettings(steps=45, batch_size=8, learning_rate=0.05, warmup=5, ema=0.9)
"""A training of 45 steps."""
CPU = torch.device("cpu")
"""Where tensors are."""


def terms_with(weights: dict[str, Tensor]) -> loop.Terms:
    """A line is fitted to noisy points of the step's own."""

    def terms(step: int) -> dict[str, Tensor]:
        x = torch.randn(8, generator=seeded_generator(1, step, CPU))
        return {"loss": (weights["slope"] * x + weights["shift"] - 3.0 * x + 1.0).square().mean()}

    return terms


def run(
    folder: Path, settings: LoopSettings = SETTINGS, die_at: int = 10**9, **options: Any
) -> ArraysByName:
    """The weights of a run, which ends by an error at its second save after `die_at` steps."""
    weights = {name: torch.zeros(1, requires_grad=True) for name in ("slope", "shift")}
    shipped: list[ArraysByName] = []

    def save(state: ArraysByName, progress: dict[str, Any]) -> None:
        if shipped and progress["steps_done"] > die_at:
            raise KeyboardInterrupt
        shipped.append(state)

    training = Training(weights, settings, folder, {"seed": options.pop("seed", 1)}, Workplace(CPU))
    if options.pop("resume", False):
        training.resume()
    training.run(terms_with(weights), save, **options)
    return shipped[-1]


def log_of(folder: Path) -> list[dict[str, str]]:
    """Rows of a training's log."""
    with (folder / "log.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("died", [[1], [20], [3, 4, 41]])
def test_a_run_that_died_ends_with_the_weights_and_the_log_of_one_that_did_not(
    died: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "SAVE_EVERY_S", 0.0)
    expected = run(tmp_path / "undisturbed")
    for step in died:
        with pytest.raises(KeyboardInterrupt):
            run(tmp_path / "died", die_at=step, resume=True)
    found = run(tmp_path / "died", resume=True)
    assert np.array_equal(
        run(tmp_path / "died", resume=True)["slope"], found["slope"]
    )  # nothing is left
    assert all(np.array_equal(found[name], expected[name]) for name in expected)
    logs = [
        [(row["step"], row["loss"]) for row in log_of(tmp_path / f)]
        for f in ("died", "undisturbed")
    ]
    assert logs[0] == logs[1] and [step for step, _ in logs[0]] == ["0", "20", "40", "44"]


def test_it_learns_and_leaves_curves_and_nothing_half(tmp_path: Path) -> None:
    (tmp_path / ".resume.pt.1.part").write_bytes(b"half")
    found = run(tmp_path, LoopSettings(steps=400, batch_size=8, learning_rate=0.05))
    assert found["slope"] == pytest.approx(3.0, abs=0.05) and found["shift"] == pytest.approx(
        -1.0, abs=0.05
    )
    assert {path.name for path in tmp_path.iterdir()} == {"log.csv", "curves.png", "resume.pt"}
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")


def test_weights_in_one_vector_are_trained_as_torch_trains_them_apart(tmp_path: Path) -> None:
    found = run(tmp_path)
    weights = {name: torch.zeros(1, requires_grad=True) for name in ("slope", "shift")}
    average = {name: torch.zeros(1) for name in weights}
    optimizer = torch.optim.Adam(weights.values())
    terms = terms_with(weights)
    for step in range(SETTINGS.steps):
        optimizer.param_groups[0]["lr"] = learning_rate(SETTINGS, step)
        optimizer.zero_grad()
        terms(step)["loss"].backward()
        torch.nn.utils.clip_grad_norm_(weights.values(), loop.GRADIENT_MAX)
        optimizer.step()
        decay = min(SETTINGS.ema, (1 + step) / (10 + step))
        for name, weight in weights.items():
            average[name] = decay * average[name] + (1.0 - decay) * weight.detach()
    for name, expected in average.items():
        np.testing.assert_allclose(found[name], expected, rtol=1e-5)


def test_weights_without_influence_stay_as_they_are(tmp_path: Path) -> None:
    weights = {name: torch.ones(2, requires_grad=True) for name in ("used", "unused")}
    training = Training(weights, SETTINGS, tmp_path, {}, Workplace(CPU))
    training.run(lambda step: {"loss": weights["used"].square().sum()}, lambda state, made: None)
    assert (weights["used"] < 1.0).all() and (weights["unused"] == 1.0).all()


def test_other_settings_and_damaged_states_are_refused_in_one_sentence(tmp_path: Path) -> None:
    run(tmp_path)
    with pytest.raises(DataError, match=r"holds a run with other settings \(seed\)"):
        run(tmp_path, resume=True, seed=2)
    content = (tmp_path / "resume.pt").read_bytes()
    (tmp_path / "resume.pt").write_bytes(content[: len(content) // 2])
    with pytest.raises(DataError, match="no state to go on from"):
        run(tmp_path, resume=True)


def test_time_that_is_up_ends_a_run_and_what_went_before_counts(tmp_path: Path) -> None:
    limited = LoopSettings(steps=10**6, batch_size=8, learning_rate=0.05, seconds=0.5)
    run(tmp_path, limited)
    steps = int(log_of(tmp_path)[-1]["step"])
    assert 10 < steps < 10**6 and 0.5 <= float(log_of(tmp_path)[-1]["seconds"]) < 5.0
    run(tmp_path, limited, resume=True)
    assert int(log_of(tmp_path)[-1]["step"]) == steps
    run(tmp_path, limited, spent=0.6)
    assert log_of(tmp_path)[-1]["step"] == "0"


def test_the_rate_rises_then_falls_with_the_later_of_steps_and_time() -> None:
    rates = [learning_rate(SETTINGS, step) for step in range(45)]
    assert rates[0] == pytest.approx(0.05 / 5, rel=1e-6) and max(rates) == rates[4]
    assert (np.diff(rates[4:]) < 0.0).all() and rates[-1] < 0.002
    assert learning_rate(SETTINGS, 10, 0.9) < learning_rate(SETTINGS, 10)
    assert (
        learning_rate(LoopSettings(steps=10, batch_size=1, learning_rate=0.1, cosine=False), 9)
        == 0.1
    )


@pytest.mark.parametrize(
    ("device", "world", "message"),
    [
        ("cuda:99", "1", "device: 'cuda:99'"),
        ("toaster", "1", "device: 'toaster'"),
        ("cpu", "3", "of 8 samples"),
    ],
)
def test_a_workplace_that_is_none_is_refused(
    device: str, world: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WORLD_SIZE", world)
    with pytest.raises(CommandError, match=message), workplace(device, 8):
        pass
