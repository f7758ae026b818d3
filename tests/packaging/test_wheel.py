"""The wheel carries everything a user needs, and works from any folder. Building needs no network."""

import email
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CORE = {"numpy", "scipy", "pyyaml", "safetensors", "threadpoolctl", "tyro", "tqdm"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel built from the tree."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return next(folder.glob("finlab-*.whl"))


@pytest.fixture(scope="module")
def unpacked(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel's contents in a folder of their own, as an installation would place them."""
    folder = tmp_path_factory.mktemp("site")
    zipfile.ZipFile(wheel).extractall(folder)
    return folder


def name_of(requirement: str) -> str:
    """The package that a requirement such as `viser>=1.1.1,<1.2` asks for."""
    return re.split(r"[<>=!~ ;\[]", requirement)[0].lower().replace("_", "-")


def run(unpacked: Path, cwd: Path, *argv: str) -> subprocess.CompletedProcess[str]:
    """Run the unpacked package, not the tree's, in another folder."""
    environment = os.environ | {"PYTHONPATH": str(unpacked)}
    command = [sys.executable, *argv]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=120)


def test_carries_library_app_layouts_and_checkpoints(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    for path in ROOT.glob("layouts/*.yaml"):
        assert f"finlab/shipped/layouts/{path.name}" in names
    for name in ("model.safetensors", "config.json"):
        assert f"finlab/shipped/checkpoints/default/{name}" in names
    for name in ("finlab/py.typed", "finlab/deploy/graph.schema.json", "finlab/layout/layout.schema.json"):
        assert name in names
    for name in ("problems.npz", "problems.md", "problems.schema.json", "results.json"):
        assert f"finlab/bench/{name}" in names
    assert "webapp/app.py" in names


def test_carries_nothing_else(wheel: Path) -> None:
    archive = zipfile.ZipFile(wheel)
    tops = {name.split("/")[0] for name in archive.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"finlab", "webapp"}
    assert not [n for n in archive.namelist() if n.endswith((".pt", ".pth", ".pkl", ".pyc"))]
    assert sum(info.file_size for info in archive.infolist()) < 40 * 2**20


def test_asks_for_the_core_and_offers_extras(wheel: Path) -> None:
    archive = zipfile.ZipFile(wheel)
    name = next(n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
    about = email.message_from_bytes(archive.read(name))
    required = [line for line in about.get_all("Requires-Dist", []) if "extra ==" not in line]
    assert {name_of(line) for line in required} == CORE
    extras = {"train", "app", "urdf", "ipopt", "plot", "fit", "test", "dev"}
    assert extras == set(about.get_all("Provides-Extra", []))


def test_installed_package_finds_its_own_layouts_and_checkpoints(unpacked: Path, tmp_path: Path) -> None:
    code = "from finlab.assets import *; print(layouts_dir()); print(checkpoint_path())"
    done = run(unpacked, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    assert all(line.startswith(str(unpacked)) for line in done.stdout.splitlines())


def test_installed_package_allocates_from_any_folder(unpacked: Path, tmp_path: Path) -> None:
    wrench = ["--wrench", "1", "0", "0.5", "0", "0", "0.1"]
    done = run(unpacked, tmp_path, "-m", "finlab", "allocate", "A", *wrench, "--json")
    assert done.returncode == 0, done.stderr
    assert '"checkpoint": null' in done.stdout and '"method": "search"' in done.stdout


@pytest.fixture(scope="module")
def bare(unpacked: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an empty environment with the wheel and what it requires without extras.

    What it requires is linked from this environment, so that no network is needed.
    """
    folder = tmp_path_factory.mktemp("bare") / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True, timeout=120)
    site = next(folder.glob("lib/python3*/site-packages"))
    waiting, seen = sorted(CORE), set()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        found = metadata.distribution(name)
        for file in found.files or ():
            if file.parts[0] not in ("..", "__pycache__") and not (site / file.parts[0]).exists():
                os.symlink(Path(str(found.locate_file(file.parts[0]))), site / file.parts[0])
        waiting += [name_of(line) for line in found.requires or () if ";" not in line]
    for path in unpacked.iterdir():
        os.symlink(path, site / path.name)
    return folder / "bin" / "python"


def bare_run(bare: Path, cwd: Path, *argv: str) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    return subprocess.run(
        [str(bare), *argv], cwd=cwd, env=environment, capture_output=True, text=True, timeout=300
    )


def test_without_extras_torch_is_absent_and_missed_in_a_sentence(bare: Path, tmp_path: Path) -> None:
    for name in ("torch", "viser", "matplotlib", "pytest"):
        assert bare_run(bare, tmp_path, "-c", f"import {name}").returncode == 1
    done = bare_run(bare, tmp_path, "-m", "finlab", "train", "surrogate", "-o", "out", "--preset", "smoke")
    assert done.returncode == 2
    assert done.stderr == (
        "finlab: error: training needs PyTorch, which cannot be imported (No module named 'torch'); "
        "run: pip install 'finlab-marine[train]'\n"
    )


def test_without_extras_every_method_but_ipopt_allocates(bare: Path, tmp_path: Path) -> None:
    code = (
        "import sys, finlab\n"
        "from finlab.allocation import METHODS\n"
        "layout = finlab.load_layout('A')\n"
        "for name in METHODS:\n"
        "    if name != 'ipopt':\n"
        "        result = finlab.load_allocator(name).allocate(layout, [1, 0, 0.5, 0, 0, 0.1])\n"
        "        assert result.err_norm < {'paper': 0.1, 'qp': 1.0}.get(name, 0.01), name\n"
        "        print(name)\n"
        "assert 'torch' not in sys.modules\n"
    )
    done = bare_run(bare, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 9


def test_without_extras_it_simulates_evaluates_and_exports(bare: Path, tmp_path: Path) -> None:
    for line in (
        "simulate A --duration 12",
        "eval wrench --split id --layouts 2 --targets 3 --methods search,paper,sqp",
        "layout check ucat",
        "bench analytic --quick --sets paper",
        "export mixed -o robot --objective effort",
    ):
        done = bare_run(bare, tmp_path, "-m", "finlab", *line.split())
        assert done.returncode == 0, (line, done.stderr)
    done = bare_run(bare, tmp_path, "-m", "finlab.deploy.command", "check", "robot")
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_lines_of_the_readme_run_from_any_folder(bare: Path, tmp_path: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.S)
    assert blocks
    for block in blocks:
        done = bare_run(bare, tmp_path, "-c", block)
        assert done.returncode == 0, done.stderr


def test_constraints_pin_everything_exactly() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = dict(line.split("==") for line in lines if line and not line.startswith("#"))
    assert pins["torch"] == "2.13.0"
    assert pins["viser"] == "1.1.1"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [*project["dependencies"], *(r for rs in project["optional-dependencies"].values() for r in rs)]
    assert {name_of(line) for line in wanted} <= set(pins)
