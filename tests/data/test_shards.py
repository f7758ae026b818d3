"""Data on disk: reproducible, resumable after a kill, checked, and equal to what the plant says."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.layout import layout_from_arrays
from finlab.physics import Plant
from finlab.training.data.dataset import open_dataset
from finlab.training.data.manifest import FILE_NAME
from finlab.training.data.reserved import shipped_reserved
from finlab.training.data.shards import LAYOUTS_PER_SHARD, generate, verify

LAYOUTS, COMMANDS = 2 * LAYOUTS_PER_SHARD + 5, 30


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data") / "forward"
    report = generate(folder, LAYOUTS, COMMANDS, seed=3)
    assert report.samples == LAYOUTS * COMMANDS and report.samples_per_second > 0
    return folder


def test_the_manifest_says_what_it_is(made):
    manifest = json.loads((made / FILE_NAME).read_text())
    assert manifest["format"] == "finlab-forward-data" and manifest["version"] == 1
    assert manifest["complete"] and manifest["samples"] == LAYOUTS * COMMANDS
    assert manifest["recipe"]["seed"] == 3
    assert manifest["recipe"]["fin_model"]["type"] == "drag"
    assert manifest["recipe"]["limits"]["amplitude_rad"] == [0.05, 0.6]
    assert set(manifest["sha256"]) == {path.name for path in made.iterdir()} - {FILE_NAME}
    assert verify(made) == LAYOUTS * COMMANDS


def test_same_arguments_same_bytes_whatever_the_workers(made, tmp_path):
    generate(tmp_path, LAYOUTS, COMMANDS, seed=3, workers=1)
    assert contents(tmp_path) == contents(made)
    generate(tmp_path / "other", LAYOUTS, COMMANDS, seed=4)
    assert contents(tmp_path / "other")["wrench-00000.npy"] != contents(made)["wrench-00000.npy"]


def test_a_second_call_has_nothing_to_do_and_a_lost_shard_is_made_again(made, tmp_path):
    generate(tmp_path, LAYOUTS, COMMANDS, seed=3)
    assert generate(tmp_path, LAYOUTS, COMMANDS, seed=3).samples == 0
    (tmp_path / "wrench-00001.npy").unlink()
    assert generate(tmp_path, LAYOUTS, COMMANDS, seed=3).samples == LAYOUTS_PER_SHARD * COMMANDS
    assert contents(tmp_path) == contents(made)


def test_a_generation_that_was_killed_ends_in_the_same_bytes(tmp_path):
    size = (40 * LAYOUTS_PER_SHARD, 1000)
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    code = f"from finlab.training.data.shards import generate; generate({str(killed)!r}, *{size}, seed=1)"
    process = subprocess.Popen([sys.executable, "-c", code], env={**os.environ, "OMP_NUM_THREADS": "1"})
    deadline = time.monotonic() + 60
    while not list(killed.glob("wrench-*.npy")) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    with pytest.raises(DataError, match="shards are done; run the same `finlab data generate`"):
        open_dataset(killed)
    generate(killed, *size, seed=1)
    generate(whole, *size, seed=1)
    assert verify(killed) == verify(whole) == size[0] * size[1]
    assert (killed / FILE_NAME).read_text() == (whole / FILE_NAME).read_text()
    assert not list(killed.glob("*.part"))


def test_samples_are_what_the_plant_says(made):
    data = open_dataset(made)
    assert len(data) == LAYOUTS * COMMANDS
    batch = data.batch(np.array([0, 31, 700, len(data) - 1]))
    for row, number in enumerate([0, 31, 700, len(data) - 1]):
        layout = layout_from_arrays(data.layouts, number // COMMANDS)
        command = batch.command[row, : layout.n_fins]
        np.testing.assert_allclose(Plant(layout).wrench(command), batch.wrench[row], rtol=1e-4, atol=1e-4)
        assert not batch.command[row, layout.n_fins :].any()
    assert (batch.command >= batch.lower)[batch.mask].all() and (batch.command <= batch.upper)[
        batch.mask
    ].all()
    assert (
        not shipped_reserved()
        .matches(data.layouts.position, data.layouts.mounting_angle, data.layouts.mask)
        .any()
    )


def test_an_epoch_has_every_sample_once_and_epochs_differ(made):
    data = open_dataset(made)
    wrenches = [batch.wrench.numpy() for batch in data.batches(50, seed=1, epoch=0)]
    assert len(wrenches) == len(data) // 50
    everything = data.batch(np.arange(len(data))).wrench.numpy()
    np.testing.assert_array_equal(np.sort(np.concatenate(wrenches), axis=0), np.sort(everything, axis=0))
    again = next(iter(data.batches(50, seed=1, epoch=0))).wrench.numpy()
    other = next(iter(data.batches(50, seed=1, epoch=1))).wrench.numpy()
    assert np.array_equal(again, wrenches[0]) and not np.array_equal(other, wrenches[0])


def test_what_is_wrong_is_said(made, tmp_path):
    with pytest.raises(DataError, match="holds a data set of other settings"):
        generate(made, LAYOUTS, COMMANDS, seed=4)
    with pytest.raises(DataError, match="expected 1 to 10,000,000 layouts, got 0"):
        generate(tmp_path / "x", 0)
    with pytest.raises(DataError, match="seed of at least 0"):
        generate(tmp_path / "x", 1, 1, seed=-1)
    with pytest.raises(DataError, match="has no manifest.json"):
        open_dataset(tmp_path)
    (tmp_path / FILE_NAME).write_text('{"format": "something"}')
    with pytest.raises(DataError, match="is not a manifest"):
        open_dataset(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot be written"):
        generate(tmp_path / "file", 1, 1)


def test_a_changed_byte_or_a_short_file_is_noticed(tmp_path):
    generate(tmp_path, 3, 10)
    path = tmp_path / "wrench-00000.npy"
    good = path.read_bytes()
    path.write_bytes(good[:-1] + bytes([good[-1] ^ 1]))
    with pytest.raises(DataError, match="does not match its checksum"):
        verify(tmp_path)
    path.write_bytes(good[:-100])
    with pytest.raises(DataError, match="cannot be mapped"):
        open_dataset(tmp_path)
    path.unlink()
    with pytest.raises(DataError, match="is missing"):
        verify(tmp_path)
