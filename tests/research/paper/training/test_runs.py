"""The paper's training by the command line: whole, killed and resumed, by two processes."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.files.checkpoint_config import read_normalization
from finlab.research.networks.checkpoint import read_checkpoint, resolve_checkpoint
from tests.terminal import refused

PATIENT = (
    "import finlab.research.training.loop as loop; loop.SAVE_EVERY_S = 0.1; from finlab.cli "
    "import main; import sys; "
)
"""A command that saves its state ten times a second."""


GOLDEN = {
    "surrogate": [18.156822, 5.9099579, 5.7872725],
    "allocator": [17.678448, 16.317541, 14.230668],
}
"""Losses of the log of 30 steps of each training of the preset `smoke`."""


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small data set."""
    folder = tmp_path_factory.mktemp("runs") / "data"
    assert main(["data", "generate", "-o", str(folder), "--layouts", "60", "--commands", "80"]) == 0
    return folder


@pytest.fixture(scope="module")
def trained(data: Path) -> Path:
    """Folder with a trained `surrogate` and `allocator`."""
    place = data.parent
    surrogate = str(place / "surrogate")
    allocator = str(place / "allocator")
    smoke = ["--data", str(data), "--preset", "smoke", "--steps", "30"]
    assert main(["train", "surrogate", "-o", surrogate, *smoke]) == 0
    assert main(["train", "allocator", "-o", allocator, "--surrogate", surrogate, *smoke]) == 0
    return place


def losses(folder: Path) -> list[float]:
    """Losses of a log, step by step."""
    with (folder / "log.csv").open(newline="") as file:
        return [float(row["loss"]) for row in csv.DictReader(file)]


def test_what_is_trained_allocates_and_is_described(
    trained: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = [
        "allocate",
        "A",
        "--wrench",
        "1",
        "0",
        "0",
        "0",
        "0",
        "0",
        "--method",
        "paper",
        "--json",
    ]
    assert main([*command, "--checkpoint", str(trained / "allocator")]) == 0
    assert json.loads(capsys.readouterr().out)["checkpoint"] == "allocator"
    surrogate, whole = (read_checkpoint(trained / name) for name in ("surrogate", "allocator"))
    assert whole.training["allocator"]["surrogate_sha256"] == surrogate.sha256
    assert all(
        np.array_equal(whole.surrogate[name], surrogate.surrogate[name])
        for name in surrogate.surrogate
    )
    assert surrogate.metrics["surrogate"]["wrench_error_norm"] > 0.0
    for name, made in (("surrogate", surrogate), ("allocator", whole)):
        files = {path.name for path in (trained / name).iterdir()}
        assert {"README.md", "log.csv", "curves.png", "resume.pt", "config.json"} <= files
        card = (trained / name / "README.md").read_text()
        assert made.sha256 in card and "| surrogate data layouts | 1000 | 60 |" in card
        assert losses(trained / name)[-1] < losses(trained / name)[0]


def test_a_smoke_run_has_the_losses_that_it_had(trained: Path) -> None:
    """Golden losses of 30 steps: data, first weights, batches, noise and both losses are the same.

    In float32, whose order of sums depends on the processor: hence the tolerance.
    """
    np.testing.assert_allclose(losses(trained / "surrogate"), GOLDEN["surrogate"], rtol=0.01)
    np.testing.assert_allclose(losses(trained / "allocator"), GOLDEN["allocator"], rtol=0.01)


def test_the_shipped_recipe_runs_twice_to_the_same_bytes(data: Path, tmp_path: Path) -> None:
    """At a size of seconds; what differs between the two is the time in the log alone."""
    for name in ("first", "second"):
        surrogate = str(tmp_path / name / "surrogate")
        allocator = str(tmp_path / name / "paper")
        options = ["--data", str(data), "--preset", "shipped", "--device", "cpu"]
        assert main(["train", "surrogate", "-o", surrogate, *options, "--steps", "12"]) == 0
        line = ["train", "allocator", "-o", allocator, "--surrogate", surrogate, *options]
        assert main([*line, "--steps", "2"]) == 0
    for file in ("README.md", "config.json", "model.safetensors"):
        for part in ("surrogate", "paper"):
            first, second = (tmp_path / name / part / file for name in ("first", "second"))
            assert first.read_bytes() == second.read_bytes()
    made = read_checkpoint(tmp_path / "first" / "paper")
    card = (tmp_path / "first" / "paper" / "README.md").read_text()
    for verb in ("surrogate", "allocator"):
        said = made.training[verb]
        assert len(said["data_sha256"]) == len(said["recipe_sha256"]) == 64
        assert said["data_sha256"] in card and said["recipe_sha256"] in card
        assert said["training"]["seconds"] is None
    shipped = read_normalization(resolve_checkpoint("default"))
    np.testing.assert_array_equal(made.normalization.std, shipped.std)


def test_a_killed_run_that_goes_on_has_the_weights_of_one_that_was_not(
    trained: Path, tmp_path: Path
) -> None:
    out = str(tmp_path / "killed")
    options = ["--surrogate", str(trained / "surrogate"), "--data", str(trained / "data")]
    verb = [
        "train",
        "allocator",
        "-o",
        out,
        *options,
        "--preset",
        "smoke",
        "--steps",
        "30",
        "--resume",
    ]
    code = PATIENT + "sys.exit(main(sys.argv[1:]))"
    for _ in range(2):
        process = subprocess.Popen([sys.executable, "-c", code, *verb])
        before = _time_of(tmp_path / "killed" / "resume.pt")
        while _time_of(tmp_path / "killed" / "resume.pt") == before and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
    assert main(verb) == 0
    killed, whole = (read_checkpoint(path) for path in (tmp_path / "killed", trained / "allocator"))
    assert killed.training["allocator"]["steps_done"] == 30
    for name, value in whole.network.items():
        np.testing.assert_allclose(killed.network[name], value, atol=1e-6)
    assert not list(tmp_path.rglob("*.part"))


def _time_of(path: Path) -> float:
    """When a file was written last [s]; 0 where there is none."""
    return path.stat().st_mtime if path.exists() else 0.0


def test_a_killed_generation_leaves_whole_parts_and_no_processes(tmp_path: Path) -> None:
    verb = ["data", "generate", "-o", str(tmp_path), "--layouts", "200", "--commands", "50000"]
    process = subprocess.Popen([sys.executable, "-m", "finlab", *verb], start_new_session=True)
    while not list(tmp_path.glob("part-*.npz")) and process.poll() is None:
        time.sleep(0.01)
    process.kill()
    process.wait()
    for path in tmp_path.glob("part-*.npz"):
        with np.load(path) as part:
            assert part["wrench"].shape == (5, 50_000, 6)
    ends = time.monotonic() + 10.0
    while time.monotonic() < ends:
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    pytest.fail("processes outlived the one that started them")


def test_two_processes_have_the_losses_of_one(trained: Path, tmp_path: Path) -> None:
    command = [
        "-m",
        "finlab",
        "train",
        "allocator",
        "-o",
        str(tmp_path),
        "--data",
        str(trained / "data"),
    ]
    command += ["--preset", "smoke", "--steps", "30", "--device", "cpu"]
    command += ["--surrogate", str(trained / "surrogate")]
    launch = [
        sys.executable,
        "-m",
        "torch.distributed.run",
        "--nproc-per-node",
        "2",
        "--standalone",
    ]
    done = subprocess.run([*launch, *command], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(losses(tmp_path), losses(trained / "allocator"), rtol=1e-3)
    assert read_checkpoint(tmp_path).training["allocator"]["processes"] == 2


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["data", "generate", "--layouts", "0"], "layouts: expected a number of at least 1, got 0"),
        (["data", "generate", "--varied-limits", "2"], "a share from 0 to 1"),
        (
            ["train", "surrogate", "--preset", "long"],
            "preset: expected one of paper, shipped, short, smoke, got 'long'",
        ),
        (["train", "surrogate", "--data", "nowhere"], "nowhere/data.json"),
        (["train", "surrogate", "--steps", "0"], "steps: expected a number of at least 1, got 0"),
        (["train", "allocator", "--surrogate", "default"], "holds no surrogate"),
    ],
)
def test_refuses_in_one_sentence(argv: list[str], message: str, tmp_path: Path) -> None:
    assert message in refused([*argv, "-o", str(tmp_path / "out")])
