"""The fast path: true to its network, as exact as the full pipeline, hardly dearer, and never stuck."""

import json
import math
import shutil
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.allocation import load_allocator
from finlab.allocation.learned.fast import FastAllocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.assets import checkpoint_path, shipped_layouts
from finlab.errors import AllocationError, CheckpointError
from finlab.inference.checkpoint import read_checkpoint
from finlab.inference.fast_network import save_fast
from finlab.layout import Limits, random_layout
from finlab.physics import Plant
from finlab.physics.energy import EnergyWeights, command_energy


@pytest.fixture(scope="module")
def fast() -> FastAllocator:
    allocator = load_allocator("fast")
    assert isinstance(allocator, FastAllocator)
    return allocator


def targets(layout: finlab.Layout, count: int, seed: int = 0) -> np.ndarray:
    """Wrenches of random commands."""
    lower = layout.lower
    upper = layout.upper
    draws = np.random.default_rng(seed).random((count, layout.n_fins, 3))
    return Plant(layout).wrench(lower + draws * (upper - lower))


def test_exact_and_hardly_dearer_on_new_layouts(fast: FastAllocator) -> None:
    full = LearnedAllocator(fast.weights)
    rng = np.random.default_rng(5)
    errors, ratios = [], []
    for _ in range(12):
        layout = random_layout(rng)
        wanted = targets(layout, 40)
        quick, whole = (a.allocate_batch(layout, wanted).command for a in (fast, full))
        errors.append(fast.normalization.error(Plant(layout).wrench(quick), wanted))
        upper = layout.upper
        ratios.append(command_energy(quick, upper) / command_energy(whole, upper))
    assert np.mean(errors) < 5e-3
    assert np.mean(ratios) < 1.08


def test_answers_stay_inside_limits_also_with_arcs(fast: FastAllocator) -> None:
    rng = np.random.default_rng(6)
    for _ in range(10):
        layout = random_layout(rng, limits="varied")
        for i, target in enumerate(targets(layout, 4)):
            result = fast.allocate(layout, target * (1 + 2 * (i == 3)), failed=layout.names[:1] * (i == 2))
            limits = [fin.limits for fin in layout.fins]
            alive = ~np.isnan(result.command).any(axis=1)
            assert (result.command >= [limit.lower for limit in limits])[alive].all()
            assert (result.command <= [limit.upper for limit in limits])[alive].all()


def test_answers_stay_inside_full_turns_that_begin_anywhere(fast: FastAllocator) -> None:
    layout = random_layout(np.random.default_rng(8), n_fins=4)
    for start in (0.0, -2.0 * math.pi, -1.0):
        limits = Limits(zero_direction=(start, start + 2.0 * math.pi))
        turned = replace(layout, fins=tuple(replace(fin, limits=limits) for fin in layout.fins))
        wanted = targets(turned, 40)
        command = fast.allocate_batch(turned, wanted).command
        assert ((command >= turned.lower) & (command <= turned.upper)).all()
        assert np.median(fast.normalization.error(Plant(turned).wrench(command), wanted)) < 5e-3


def test_far_from_its_training_the_network_still_gives_shares(fast: FastAllocator) -> None:
    x = np.random.default_rng(0).normal(size=(4, 3, 25)).astype(np.float32) * np.float32(1e8)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        share = fast.network(x)
    assert ((share >= 0.0) & (share <= 1.0)).all()


def test_out_of_reach_the_full_pipeline_answers(fast: FastAllocator) -> None:
    layout = finlab.load_layout(shipped_layouts()["A"])
    far = [60.0, 0, 0, 0, 0, 0]
    for policy in ("closest", "direction", "priority"):
        quick = fast.allocate(layout, far, policy=policy)
        whole = LearnedAllocator(fast.weights).allocate(layout, far, policy=policy)
        np.testing.assert_allclose(quick.command, whole.command, atol=1e-9)


def test_one_target_as_in_a_batch(fast: FastAllocator) -> None:
    layout = random_layout(np.random.default_rng(7), n_fins=4)
    wanted = targets(layout, 6)
    together = fast.allocate_batch(layout, wanted).command
    alone = np.array([fast.allocate(layout, target).command for target in wanted])
    np.testing.assert_allclose(alone, together, atol=1e-5)


def test_checkpoint_without_a_distilled_network_says_so(untrained_checkpoint: Path) -> None:
    with pytest.raises(AllocationError, match="has no distilled network; train one with `finlab train fast`"):
        load_allocator("fast", checkpoint=untrained_checkpoint)


def test_changed_weights_are_refused(tmp_path: Path) -> None:
    shutil.copytree(checkpoint_path(), tmp_path / "mine")
    folder = tmp_path / "mine" / "fast"
    shipped = read_checkpoint(checkpoint_path()).fast
    assert shipped is not None
    save_fast(folder, shipped, {"who": "a test"})
    back = read_checkpoint(folder.parent).fast
    assert back is not None and all(np.array_equal(back.state[k], v) for k, v in shipped.state.items())
    config = json.loads((folder / "config.json").read_text())
    for key, value, message in (
        ("version", 2, "version 1"),
        ("sha256", "0" * 64, "SHA-256"),
        ("rounds", 2, "not a distilled network"),
        ("rounds", 10**9, "not a distilled network"),
    ):
        (folder / "config.json").write_text(json.dumps(config | {key: value}))
        with pytest.raises(CheckpointError, match=message):
            read_checkpoint(folder.parent)
    shutil.rmtree(folder)
    assert read_checkpoint(folder.parent).fast is None


@pytest.mark.parametrize("case", ["previous", "tradeoff", "weights"])
def test_questions_that_the_network_did_not_learn_go_to_the_full_pipeline(
    fast: FastAllocator, case: str
) -> None:
    """Slow turns, and energies other than the usual one."""
    changes: dict[str, Any] = {
        "tradeoff": {"energy_tradeoff": 0.01},
        "weights": {"energy_weights": EnergyWeights(1.0, 1.0, 0.5, 1.0)},
    }.get(case, {})
    allocators = fast.with_settings(**changes), LearnedAllocator(fast.weights).with_settings(**changes)
    layout = finlab.load_layout("penta")
    previous = 0.5 * (layout.lower + layout.upper) if case == "previous" else None
    target = targets(layout, 1)[0] * 0.3
    quick, full = (a.allocate(layout, target, previous=previous).command for a in allocators)
    np.testing.assert_allclose(quick, full, atol=1e-9)
    assert np.abs(fast.allocate(layout, target).command - full).max() > 1e-5


def test_what_the_network_meets_never_sees_the_full_pipeline(
    fast: FastAllocator, monkeypatch: pytest.MonkeyPatch
) -> None:
    layout = finlab.load_layout("penta")
    wanted = 0.3 * targets(layout, 8)
    expected = fast.allocate_batch(layout, wanted).command

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("asked the full pipeline")

    monkeypatch.setattr(LearnedAllocator, "_solve", refuse)
    np.testing.assert_array_equal(fast.allocate_batch(layout, wanted).command, expected)
    with pytest.raises(AssertionError, match="asked the full pipeline"):
        fast.allocate(layout, wanted[0], previous=expected[0])


def test_only_the_targets_that_are_missed_go_to_the_full_pipeline(fast: FastAllocator) -> None:
    layout = finlab.load_layout("penta")
    wanted = np.concatenate([0.3 * targets(layout, 3), [[40.0, 0.0, 0.0, 0.0, 0.0, 0.0]]])
    together = fast.allocate_batch(layout, wanted[[0, 3, 1, 2]])
    for row, place in enumerate((0, 3, 1, 2)):
        alone = fast.allocate(layout, wanted[place])
        np.testing.assert_allclose(together.command[row], alone.command, atol=1e-5)
        assert together.wrench_surrogate is not None and alone.wrench_surrogate is not None
        np.testing.assert_allclose(together.wrench_surrogate[row], alone.wrench_surrogate, atol=1e-5)
    full = LearnedAllocator(fast.weights).allocate(layout, wanted[3])
    np.testing.assert_allclose(together.command[1], full.command, atol=1e-5)
