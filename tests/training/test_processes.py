"""Training in real processes: killed without warning, and two at once."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from finlab.training.device import autocast_dtype

SAVING_ALL_THE_TIME = """
import sys, time
from pathlib import Path
from finlab.training import allocator, loop

loop.plot_log = lambda folder: time.sleep(0.2)  # leaves time to be killed
loop.LOG_EVERY, loop.SAVE_EVERY_S = 1, 0.0
allocator.train_allocator("smoke", Path(sys.argv[1]), surrogate=Path(sys.argv[2]))
"""


def environment() -> dict[str, str]:
    """As many threads as here: sums in another order would round differently."""
    return os.environ | {"OMP_NUM_THREADS": str(torch.get_num_threads()), "CUDA_VISIBLE_DEVICES": ""}


def saved_step(folder: Path) -> int:
    path = folder / "resume.pt"
    return int(torch.load(path, weights_only=True)["done"][0]) if path.exists() else 0


def test_a_killed_run_goes_on_as_if_it_had_not_been(
    smoke_run, smoke_surrogate, resume, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    command = [sys.executable, "-c", SAVING_ALL_THE_TIME, str(folder), str(smoke_surrogate.folder)]
    process = subprocess.Popen(command, env=environment(), stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 120
    while saved_step(folder) < 2 and process.poll() is None and time.monotonic() < until:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL, process.communicate()[1]
    assert 2 <= saved_step(folder) < 40
    finished = resume(folder)
    for row, expected in zip(finished.log, smoke_run.log, strict=True):
        assert {**row, "seconds": 0} == {**expected, "seconds": 0}
    mine, theirs = (load_file(run.folder / "model.safetensors") for run in (finished, smoke_run))
    assert mine.keys() == theirs.keys()
    assert all(torch.equal(mine[key], theirs[key]) for key in mine)


@pytest.mark.skipif(not torch.distributed.is_gloo_available(), reason="this torch is built without gloo")
def test_two_processes_give_the_losses_of_one(smoke_run, smoke_surrogate, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    launcher = ["-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2"]
    verb = ["-m", "finlab", "train", "allocator", "--preset", "smoke", "-o", str(folder)]
    verb += ["--surrogate", str(smoke_surrogate.folder)]
    result = subprocess.run(
        [sys.executable, *launcher, *verb], env=environment(), capture_output=True, text=True, timeout=240
    )
    assert result.returncode == 0, result.stderr
    # Reduced precision, on processors that have it, rounds differently for batches of another size.
    tolerance = 1e-4 if autocast_dtype("cpu") is None else 2e-2
    from_two = type(smoke_run)(folder, smoke_run.checkpoint).log
    from_one = {row["step"]: row for row in smoke_run.log}
    assert [row["step"] for row in from_two] == [0, 20, 39]
    for row in from_two:
        for term in ("loss", "imitation", "entropy", "guidance"):
            assert row[term] == pytest.approx(from_one[row["step"]][term], abs=tolerance, rel=tolerance)
    two, one = (load_file(path / "model.safetensors") for path in (folder, smoke_run.folder))
    for key in one:
        torch.testing.assert_close(two[key], one[key], atol=10 * tolerance, rtol=0.0)
