"""Checkpoints: what is saved comes back, and everything that is not one is refused with a
sentence."""

import hashlib
import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from finlab.assets import checkpoint_path, shipped_checkpoints
from finlab.errors import CheckpointError
from finlab.files import checkpoint_config
from finlab.layout import load_layout
from finlab.research.networks import checkpoint
from finlab.research.networks.trained import to_command, to_normalized
from tests.allocator_cache import AllocatorCache


def file_sha256(path: Path) -> str:
    """Hash of a file's content."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


Config = dict[str, Any]
"""The configuration of a checkpoint as JSON."""


@pytest.fixture
def folder(untrained_checkpoint: Path, tmp_path: Path) -> Path:
    """A whole checkpoint that a test may spoil."""
    return Path(shutil.copytree(untrained_checkpoint, tmp_path / "mine"))


def change_config(folder: Path, change: Callable[[Config], object]) -> None:
    """Change the configuration of a checkpoint, and leave its hash as it was."""
    path = folder / "config.json"
    config = json.loads(path.read_text())
    change(config)
    path.write_text(json.dumps(config))


def sign(folder: Path) -> None:
    """Write the right SHA-256 of the weights, as someone would who builds checkpoints by other
    means."""
    change_config(
        folder, lambda config: config.update(sha256=file_sha256(folder / "model.safetensors"))
    )


def change_weights(folder: Path, change: Callable[[dict[str, torch.Tensor]], object]) -> None:
    """Change the weights of a checkpoint, and sign it anew."""
    path = folder / "model.safetensors"
    tensors = load_file(path)
    change(tensors)
    save_file(tensors, path)
    sign(folder)


def refusal(folder: Path) -> str:
    """The sentence with which a folder is refused, at the latest by the method that would answer
    with it."""
    with pytest.raises(CheckpointError) as caught:
        checkpoint.read_checkpoint(folder)
        AllocatorCache("paper", checkpoint=folder).on(load_layout("A"))
    message = str(caught.value)
    assert "\n" not in message and folder.name in message
    return message


def test_round_trip(untrained_checkpoint: Path, tmp_path: Path) -> None:
    first = checkpoint.read_checkpoint(untrained_checkpoint)
    first = replace(first, metrics={"surrogate": {"error": 0.25}}, training={"seed": 7})
    second = checkpoint.write_checkpoint(tmp_path / "again", first)
    assert second.name == "again"
    kept = (
        "preset",
        "training",
        "metrics",
        "fin_model",
        "sha256",
        "network_sizes",
        "surrogate_sizes",
    )
    for name in kept:
        assert getattr(second, name) == getattr(first, name), name
    np.testing.assert_array_equal(np.array(second.normalization), np.array(first.normalization))
    for ours, theirs in ((second.network, first.network), (second.surrogate, first.surrogate)):
        assert ours.keys() == theirs.keys()
        assert all(np.array_equal(ours[name], theirs[name]) for name in ours)


def test_the_files_are_safetensors_and_json_with_all_that_the_format_promises(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == {"model.safetensors", "config.json"}
    config = json.loads((folder / "config.json").read_text())
    promised = {
        "format",
        "version",
        "preset",
        "sha256",
        "fin_model",
        "normalization",
        "surrogate",
        "network",
    }
    assert promised | {"training", "metrics"} == set(config)
    assert config["sha256"] == file_sha256(folder / "model.safetensors")
    prefixes = {name.split(".")[0] for name in load_file(folder / "model.safetensors")}
    assert prefixes == {"surrogate", "network"}


def test_refuses_a_missing_folder(tmp_path: Path) -> None:
    assert re.search(
        r"nowhere/config\.json: no such file; a checkpoint folder holds",
        refusal(tmp_path / "nowhere"),
    )


def test_refuses_missing_weights(folder: Path) -> None:
    (folder / "model.safetensors").unlink()
    assert "model.safetensors: no such file; a checkpoint folder holds" in refusal(folder)


@pytest.mark.parametrize("kept", [0, 100, -1])
def test_refuses_a_cut_file(folder: Path, kept: int) -> None:
    path = folder / "model.safetensors"
    path.write_bytes(path.read_bytes()[:kept])
    assert "its SHA-256 is not the one in config.json; the file was changed or cut off" in refusal(
        folder
    )


def test_refuses_one_changed_bit(folder: Path) -> None:
    path = folder / "model.safetensors"
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    assert "its SHA-256 is not the one in config.json" in refusal(folder)


def test_refuses_weights_of_another_format_even_when_signed(folder: Path) -> None:
    torch.save({"network": torch.zeros(3)}, folder / "model.safetensors")
    sign(folder)
    assert "config.json and model.safetensors do not fit together" in refusal(folder)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is not valid JSON"),
        (b'{"format": "finlab-checkpoint",', "is not valid JSON"),
        (b"\xff\xfe\x00", "is not UTF-8 text"),
        (b"[]", "not a finlab checkpoint (expected format 'finlab-checkpoint')"),
        (
            b'{"model_type": "bert"}',
            "not a finlab checkpoint (expected format 'finlab-checkpoint')",
        ),
        (b'"' + b"x" * 1_000_001 + b'"', "bytes, too large for a checkpoint's file"),
    ],
    ids=["empty", "cut", "binary", "list", "foreign", "huge"],
)
def test_refuses_a_configuration_that_is_none(folder: Path, content: bytes, sentence: str) -> None:
    (folder / "config.json").write_bytes(content)
    assert sentence in refusal(folder)


@pytest.mark.parametrize("version", [0, 2, "1", None])
def test_refuses_another_version_and_says_what_to_do(folder: Path, version: object) -> None:
    change_config(folder, lambda config: config.update(version=version))
    message = refusal(folder)
    assert f"checkpoint version {version!r}, this finlab reads version 1" in message
    assert "use the finlab that made it, or train again" in message


@pytest.mark.parametrize(
    "key", ["surrogate", "network", "normalization", "fin_model", "training", "metrics"]
)
def test_refuses_a_missing_key_and_names_it(folder: Path, key: str) -> None:
    change_config(folder, lambda config: config.pop(key))
    assert f"do not fit together ('{key}')" in refusal(folder)


@pytest.mark.parametrize("key", ["network.head.bias", "surrogate.net.0.weight"])
def test_refuses_missing_tensors(folder: Path, key: str) -> None:
    change_weights(folder, lambda tensors: tensors.pop(key))
    assert f"'{key.partition('.')[2]}' is missing or not expected" in refusal(folder)


def test_refuses_tensors_nobody_asked_for(folder: Path) -> None:
    change_weights(folder, lambda tensors: tensors.update({"network.extra": torch.zeros(2)}))
    assert "'extra' is missing or not expected" in refusal(folder)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30])
def test_refuses_weights_that_are_no_numbers(folder: Path, value: float) -> None:
    change_weights(folder, lambda tensors: tensors["network.head.bias"].fill_(value))
    assert "network.head.bias: holds NaN or a number beyond 1e+06" in refusal(folder)


def test_refuses_another_precision(folder: Path) -> None:
    change_weights(
        folder, lambda tensors: tensors.update({k: v.double() for k, v in tensors.items()})
    )
    assert "expected float32" in refusal(folder)


@pytest.mark.parametrize("name", shipped_checkpoints())
def test_shipped_files_are_what_is_written_for_their_weights(name: str) -> None:
    folder = checkpoint_path(name)
    files = checkpoint.checkpoint_files(checkpoint.read_checkpoint(folder))
    for file in ("config.json", "model.safetensors"):
        assert files[file] == (folder / file).read_bytes()


def test_reading_needs_no_torch() -> None:
    code = (
        "import sys\n"
        "for name in ('torch', 'scipy', 'yaml', 'tqdm', 'tyro'):\n"
        "    sys.modules[name] = None\n"
        "from finlab.assets import checkpoint_path\n"
        "from finlab.research.networks.checkpoint import read_checkpoint\n"
        "assert len(read_checkpoint(checkpoint_path('paper')).network) > 10\n"
        "assert len(read_checkpoint(checkpoint_path()).network) > 10"
    )
    subprocess.run([sys.executable, "-c", code], timeout=60, check=True)


@pytest.mark.parametrize(
    "change",
    [
        lambda config: config["network"].update(graph_layers=10**9),
        lambda config: config["network"].update(n_components=True),
        lambda config: config["network"].update(width=64),
        lambda config: config["network"].update(heads=3),
        lambda config: config["network"].update(features="magic"),
        lambda config: config["network"].update(dropout=0.1),
        lambda config: config["network"].update(joint=True),
        lambda config: config["surrogate"].update(kind="magic"),
        lambda config: config["surrogate"].update(hidden=[8]),
        lambda config: config["normalization"].update(std=[1, 1, 1]),
        lambda config: config["normalization"].update(std=[1, 1, 0, 1, 1, 1]),
        lambda config: config.update(network=[]),
    ],
)
def test_refuses_sizes_and_statistics_that_cannot_be(
    folder: Path, change: Callable[[Config], object]
) -> None:
    change_config(folder, change)
    assert refusal(folder)


def test_a_surrogate_alone_loads_but_cannot_allocate(folder: Path) -> None:
    checkpoint.write_checkpoint(
        folder, replace(checkpoint.read_checkpoint(folder), network_sizes=None, network={})
    )
    assert checkpoint.read_checkpoint(folder).network_sizes is None
    with pytest.raises(CheckpointError, match="holds no network, .* of the shipped `paper`"):
        AllocatorCache("paper", checkpoint=folder).on(load_layout("A"))


def test_a_network_over_forces_comes_back_without_a_surrogate(
    untrained_mdn: Path, tmp_path: Path
) -> None:
    first = checkpoint.read_checkpoint(untrained_mdn)
    assert first.surrogate_sizes is None and first.network_sizes is not None
    assert checkpoint.write_checkpoint(tmp_path / "again", first).sha256 == first.sha256
    with pytest.raises(CheckpointError, match="fed 'forces', expected one that is fed 'raw'"):
        AllocatorCache("paper", checkpoint=untrained_mdn).on(load_layout("A"))


def test_a_checkpoint_of_an_earlier_finlab_is_refused(folder: Path) -> None:
    change_config(folder, lambda config: config["network"].update(features="fin_frame", joint=True))
    assert "a network that is fed 'fin_frame', expected one that is fed 'raw'" in refusal(folder)


def test_normalization_alone_is_read_without_the_weights(folder: Path) -> None:
    expected = checkpoint.read_checkpoint(folder).normalization
    (folder / "model.safetensors").unlink()
    np.testing.assert_array_equal(checkpoint_config.read_normalization(folder).std, expected.std)
    change_config(folder, lambda config: config["normalization"].pop("std"))
    with pytest.raises(CheckpointError, match="normalization is missing or malformed"):
        checkpoint_config.read_normalization(folder)


def test_names_and_folders_are_told_apart(folder: Path) -> None:
    assert checkpoint.resolve_checkpoint(folder) == folder
    assert checkpoint.resolve_checkpoint("default").name == "default"
    with pytest.raises(CheckpointError, match="'magic' is not among the shipped ones"):
        checkpoint.resolve_checkpoint("magic")
    with pytest.raises(CheckpointError, match=r"away/from/home: no such checkpoint folder"):
        checkpoint.resolve_checkpoint("away/from/home")


COMMAND_MIN = torch.tensor(
    [[0.05, 0.1, -math.pi], [0.1, 0.2, 0.5], [0.3, 0.7, -2.5]], dtype=torch.float64
)
"""Lower limits (3, 3) of three fins, the last of which hardly moves."""
COMMAND_MAX = torch.tensor(
    [[0.6, 2.1, math.pi], [0.5, 1.0, 2.0], [0.3, 0.7, -2.0]], dtype=torch.float64
)
"""Their upper limits."""


def test_normalized_coordinates_go_from_minus_one_to_one_and_back() -> None:
    torch.testing.assert_close(
        to_normalized(COMMAND_MIN, COMMAND_MIN, COMMAND_MAX)[:2], -torch.ones(2, 3).double()
    )
    torch.testing.assert_close(
        to_normalized(COMMAND_MAX, COMMAND_MIN, COMMAND_MAX)[:2], torch.ones(2, 3).double()
    )
    command = COMMAND_MIN + 0.3 * (COMMAND_MAX - COMMAND_MIN)
    torch.testing.assert_close(
        to_command(to_normalized(command, COMMAND_MIN, COMMAND_MAX), COMMAND_MIN, COMMAND_MAX),
        command,
    )


def test_a_range_of_no_width_normalizes_to_zero() -> None:
    assert to_normalized(COMMAND_MIN, COMMAND_MIN, COMMAND_MAX)[2, :2].tolist() == [0.0, 0.0]


def test_arrays_are_answered_as_tensors() -> None:
    command = np.random.default_rng(0).normal(size=(50, 3, 3)) * 5
    lower = COMMAND_MIN.numpy()
    upper = COMMAND_MAX.numpy()
    for function in (to_normalized, to_command):
        expected = function(torch.from_numpy(command), COMMAND_MIN, COMMAND_MAX).numpy()
        np.testing.assert_allclose(function(command, lower, upper), expected, rtol=1e-12)
        single = function(*(part.astype(np.float32) for part in (command, lower, upper)))
        assert single.dtype == np.float32
