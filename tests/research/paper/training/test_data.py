"""The data set: what was asked for, drawn as the paper says, and repeatable part by part."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from finlab.errors import DataError
from finlab.layout import Fin, Layout
from finlab.physics import Plant
from finlab.research.networks.trained import to_command
from finlab.research.paper.network import raw_features
from finlab.research.paper.training import samples as parts_of
from finlab.research.paper.training.samples import (
    DataSettings,
    SampleSet,
    drawn_part,
    generate,
    part_file,
)

SETTINGS = DataSettings(layouts=30, commands=40, seed=3)
"""A small data set."""
CPU = torch.device("cpu")
"""Where tensors are."""
ALL_COMMANDS = slice(None)
"""Of a batch."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of these settings."""
    path = tmp_path_factory.mktemp("data")
    generate(path, SETTINGS)
    return path


def test_layouts_do_not_depend_on_the_parts_they_are_in(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts_of, "PART", 10 * SETTINGS.commands)
    for number in range(3):
        part_file(tmp_path, number).write_bytes(drawn_part(SETTINGS, number))
    (whole,) = (np.load(path) for path in folder.glob("*.npz"))
    parts = [np.load(tmp_path / f"part-{number:05d}.npz") for number in range(3)]
    for name in whole.files:
        assert np.array_equal(whole[name], np.concatenate([part[name] for part in parts]))


def test_samples_are_what_the_paper_draws(folder: Path) -> None:
    (whole,) = (np.load(path) for path in folder.glob("*.npz"))
    counts = whole["mask"].sum(1)
    assert set(counts) == {2, 3, 4, 5}
    assert (np.abs(whole["position"]) <= [0.3, 0.3, 0.1 + 1e-6]).all()
    own = (whole["upper"] != whole["upper"][:1]).any((1, 2))
    assert own.any()
    for row in range(8):
        n = counts[row]
        low = whole["lower"][row, :n]
        high = whole["upper"][row, :n]
        command = whole["command"][row, :, :n].astype(np.float64)
        assert (command >= low - 1e-6).all() and (command <= high + 1e-6).all()
        assert np.ptp(command, axis=0) == pytest.approx(high - low, rel=0.4)
        fins = [
            Fin(
                f"fin_{i}",
                tuple(whole["position"][row, i].tolist()),
                float(whole["mounting_angle"][row, i]),
            )
            for i in range(n)
        ]
        expected = Plant(Layout("one", tuple(fins))).wrench(command)
        np.testing.assert_allclose(whole["wrench"][row], expected, atol=2e-5)


def test_normalization_is_that_of_all_samples(folder: Path) -> None:
    (whole,) = (np.load(path) for path in folder.glob("*.npz"))
    wrench = whole["wrench"].reshape(-1, 6).astype(float)
    found = SampleSet(folder, CPU).normalization
    np.testing.assert_allclose(found.mean, wrench.mean(0), atol=1e-9)
    np.testing.assert_allclose(found.std, wrench.std(0), rtol=1e-9)


def test_a_batch_has_the_drawn_samples_as_networks_take_them(folder: Path) -> None:
    (whole,) = (np.load(path) for path in folder.glob("*.npz"))
    wrenches = whole["wrench"].reshape(-1, 6)
    batch = SampleSet(folder, CPU).batch(3, 50, 1, False, ALL_COMMANDS)
    for row, wrench in enumerate(batch.wrench.numpy()):
        (number,) = np.flatnonzero((wrenches == wrench).all(axis=1))
        robot, command = divmod(int(number), SETTINGS.commands)
        n = int(whole["mask"][robot].sum())
        lower = whole["lower"][robot, :n]
        upper = whole["upper"][robot, :n]
        assert np.array_equal(batch.mask[row], whole["mask"][robot])
        assert np.array_equal(batch.position[row], whole["position"][robot])
        angle = whole["mounting_angle"][robot, :n]
        expected = raw_features(whole["position"][robot, :n], angle, lower, upper)
        np.testing.assert_allclose(batch.features[row, :n], expected, atol=1e-6)
        drawn = to_command(batch.command[row, :n].numpy(), lower, upper)
        np.testing.assert_allclose(drawn, whole["command"][robot, command, :n], atol=1e-6)


def test_an_epoch_has_every_sample_once_in_an_order_of_its_own(folder: Path) -> None:
    samples = SampleSet(folder, CPU)
    size = 100
    epochs = [
        torch.cat(
            [samples.batch(12 * epoch + k, size, 1, False, ALL_COMMANDS).wrench for k in range(12)]
        )
        for epoch in range(2)
    ]
    assert not torch.equal(*epochs)
    first, second = (np.unique(epoch.numpy(), axis=0) for epoch in epochs)
    assert len(first) == 1200 and np.array_equal(first, second)
    again = SampleSet(folder, CPU).batch(
        7, size, 1, False, ALL_COMMANDS
    )  # whatever was asked before
    assert torch.equal(again.wrench, epochs[0][700:800])
    halves = [samples.batch(7, size, 1, False, slice(k, k + 50)).wrench for k in (0, 50)]
    assert torch.equal(torch.cat(halves), again.wrench)


def test_a_step_of_one_layout_has_random_commands_of_it(folder: Path) -> None:
    samples = SampleSet(folder, CPU)
    seen = []
    for step in range(30):
        batch = samples.batch(step, 16, 1, True, ALL_COMMANDS)
        assert (batch.position == batch.position[:1]).all() and len(batch.command.unique(dim=0)) > 8
        seen.append(batch.position[0])
    assert len(torch.stack(seen).unique(dim=0)) == 30


def test_refuses_in_one_sentence_what_does_not_fit(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="drawn otherwise"):
        generate(folder, replace(SETTINGS, seed=4))
    with pytest.raises(DataError, match="data.json: "):
        SampleSet(tmp_path, CPU)
    about = json.loads((folder / "data.json").read_text())
    (tmp_path / "data.json").write_text(json.dumps(about | {"normalization": None}))
    with pytest.raises(DataError, match="unfinished"):
        SampleSet(tmp_path, CPU)
    (tmp_path / "data.json").write_text(json.dumps(about))
    (tmp_path / "part-00000.npz").write_bytes(b"nothing")
    with pytest.raises(DataError, match="part-00000.npz: no part of a data set"):
        SampleSet(tmp_path, CPU)


def test_parts_of_another_set_are_refused(folder: Path, tmp_path: Path) -> None:
    about = json.loads((folder / "data.json").read_text())
    (part,) = folder.glob("*.npz")
    (tmp_path / part.name).write_bytes(part.read_bytes())
    about["settings"]["layouts"] = SETTINGS.layouts + 1
    (tmp_path / "data.json").write_text(json.dumps(about))
    with pytest.raises(DataError, match="its parts are not those of its data.json"):
        SampleSet(tmp_path, CPU)
    arrays = dict(np.load(part))
    np.savez(tmp_path / part.name, **(arrays | {"lower": arrays["lower"][:-1]}))
    with pytest.raises(DataError, match="part-00000.npz: no part of a data set"):
        SampleSet(tmp_path, CPU)


def test_both_kinds_of_batch_take_turns(folder: Path) -> None:
    """Batches of one layout and of all, on one data set: each is that of a data set of its own."""
    both = SampleSet(folder, CPU)
    for step in range(6):
        for one_layout in (True, False):
            batch = both.batch(step, 16, 1, one_layout, ALL_COMMANDS)
            alone = SampleSet(folder, CPU).batch(step, 16, 1, one_layout, ALL_COMMANDS)
            torch.testing.assert_close(batch.command, alone.command, rtol=0.0, atol=0.0)
    other = both.batch(0, 16, 2, True, ALL_COMMANDS)
    again = SampleSet(folder, CPU).batch(0, 16, 2, True, ALL_COMMANDS)
    torch.testing.assert_close(other.command, again.command, rtol=0.0, atol=0.0)
