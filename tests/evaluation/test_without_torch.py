"""The base install has no torch: evaluating and simulating the numpy methods must not ask for it."""

import subprocess
import sys
from pathlib import Path

BLOCK = """
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "torch":
            raise ModuleNotFoundError("torch is not installed here", name=name)
sys.meta_path.insert(0, Blocked())
from finlab.cli import main
code = main(sys.argv[1:])
assert "torch" not in sys.modules
sys.exit(code)
"""


def _run(*arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", BLOCK, *arguments], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_block_blocks() -> None:
    code = BLOCK.replace("code = main(sys.argv[1:])", "import torch")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode != 0 and "torch is not installed here" in done.stderr


def test_eval_wrench() -> None:
    methods = "dual,analytic,qp"
    sizes = ("--split", "limits", "--layouts", "2", "--targets", "3")
    shown = _run("eval", "wrench", *sizes, "--methods", methods)
    assert all(name in shown for name in methods.split(","))


def test_simulate(tmp_path: Path) -> None:
    path = tmp_path / "line.csv"
    path.write_text("t,x,y,z\n0,0,0,-1\n3,0.3,0,-1\n")
    shown = _run("simulate", "A", "--trajectory", str(path), "--method", "dual", "--truth", "A")
    assert "ATE" in shown
