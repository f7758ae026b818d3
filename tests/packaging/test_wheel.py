"""The wheel carries everything a user needs, and works from any folder. Building needs no
network."""

import ast
import email
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from finlab.assets import DISTRIBUTION, EXTRA_OF_PACKAGE

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
"""Table `project` of pyproject.toml."""
CORE_REQUIREMENTS = {
    "msgspec",
    "numpy",
    "scipy",
    "pyyaml",
    "safetensors",
    "threadpoolctl",
    "tyro",
    "tqdm",
}
"""Packages that an installation without extras needs."""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel built from the tree."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return next(folder.glob(f"{DISTRIBUTION.replace('-', '_')}-*.whl"))


@pytest.fixture(scope="module")
def bare(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an empty environment with the wheel and what it requires without extras.

    What it requires is linked from this environment, so that no network is needed.
    """
    folder = tmp_path_factory.mktemp("bare") / "venv"
    subprocess.run(
        [sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True, timeout=120
    )
    site = next(folder.glob("lib/python3*/site-packages"))
    for name in with_requirements(CORE_REQUIREMENTS):
        found = metadata.distribution(name)
        for file in found.files or ():
            if file.parts[0] not in ("..", "__pycache__") and not (site / file.parts[0]).exists():
                os.symlink(Path(str(found.locate_file(file.parts[0]))), site / file.parts[0])
    zipfile.ZipFile(wheel).extractall(site)
    return folder / "bin" / "python"


def normal_name(name: str) -> str:
    """The name of a package as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def counts_here(line: Requirement) -> bool:
    """Whether a requirement is one for this Python and system."""
    return line.marker is None or line.marker.evaluate()


def with_requirements(names: set[str]) -> set[str]:
    """Names of distributions and of all that they require without extras."""
    waiting = set(names)
    seen = set[str]()
    while waiting:
        name = waiting.pop()
        seen.add(name)
        lines = map(Requirement, metadata.distribution(name).requires or ())
        needed = {normal_name(line.name) for line in lines if counts_here(line)}
        waiting |= needed - seen
    return seen


def declared(*extras: str) -> set[str]:
    """Names of what the project requires, with extras and the extras that these name."""
    lines = [Requirement(line) for line in PROJECT["dependencies"]]
    for extra in extras:
        lines += map(Requirement, PROJECT["optional-dependencies"][extra])
    extras_of_extras = set[str]()
    for line in lines:
        if line.name == DISTRIBUTION:
            extras_of_extras |= line.extras
    if extras_of_extras - set(extras):
        return declared(*extras, *(extras_of_extras - set(extras)))
    return {normal_name(line.name) for line in lines if counts_here(line)} - {DISTRIBUTION}


def bare_run(bare: Path, cwd: Path, *argv: str) -> subprocess.CompletedProcess[str]:
    """Run a program of the fresh environment, which sees nothing of this tree."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    return subprocess.run(
        [str(bare), *argv], cwd=cwd, env=environment, capture_output=True, text=True, timeout=300
    )


def test_carries_library_app_layouts_and_checkpoints_and_nothing_else(wheel: Path) -> None:
    archive = zipfile.ZipFile(wheel)
    names = set(archive.namelist())
    for path in ROOT.glob("layouts/*.yaml"):
        assert f"finlab/shipped/layouts/{path.name}" in names
    for name in ("model.safetensors", "config.json"):
        assert f"finlab/shipped/checkpoints/default/{name}" in names
    for package in ("finlab", "webapp"):  # sources and all that lies beside them
        for path in (ROOT / package).rglob("*"):
            if path.is_file() and path.suffix != ".pyc":
                inside = path.relative_to(ROOT).as_posix()
                assert ("finlab/shipped/" if package == "webapp" else "") + inside in names
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"finlab"}
    assert not [n for n in names if n.endswith((".pt", ".pth", ".pkl", ".pyc"))]
    assert sum(info.file_size for info in archive.infolist()) < 40 * 2**20


def test_asks_for_the_core_and_offers_extras(wheel: Path) -> None:
    archive = zipfile.ZipFile(wheel)
    name = next(n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
    about = email.message_from_bytes(archive.read(name))
    assert about["Name"] == DISTRIBUTION == PROJECT["name"]
    lines = [line for line in about.get_all("Requires-Dist", []) if "extra ==" not in line]
    required = [line for line in map(Requirement, lines) if counts_here(line)]
    assert {normal_name(line.name) for line in required} == CORE_REQUIREMENTS
    extras = {
        "train",
        "plot",
        "app",
        "ipopt",
        "bench",
        "peers",
        "ros",
        "xacro",
        "cluster",
        "logs",
        "docs",
        "mujoco",
        "all",
        "test",
        "dev",
    }
    assert extras == set(about.get_all("Provides-Extra", []))
    assert set(EXTRA_OF_PACKAGE.values()) <= extras


def imported(package: str) -> Iterator[str]:
    """Names of the packages that a package's files import."""
    for path in (ROOT / package).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            yield from (name.split(".")[0] for name in names)


@pytest.mark.parametrize(("package", "extra"), [("finlab", "all"), ("webapp", "app")])
def test_what_is_imported_is_required(package: str, extra: str) -> None:
    known = with_requirements(declared(extra))
    home = metadata.packages_distributions()
    own = {"finlab", "webapp"}
    if sys.version_info >= (3, 11):
        own.add("tomli")  # of Python 3.10 alone
    foreign = set(imported(package)) - sys.stdlib_module_names - own
    missing = {name for name in foreign if not {normal_name(each) for each in home[name]} & known}
    assert not missing, f"name them in the extra {extra} of pyproject.toml"


def test_installed_package_finds_its_own_files(bare: Path, tmp_path: Path) -> None:
    code = "from finlab.assets import *; "
    code += (
        "print(shipped_folder('layouts'), checkpoint_path(), shipped_folder('webapp'), sep='\\n')"
    )
    done = bare_run(bare, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    site = next(bare.parents[1].glob("lib/python3*/site-packages"))
    assert all(line.startswith(str(site)) for line in done.stdout.splitlines())
    assert bare_run(bare, tmp_path, "-c", "import webapp").returncode == 1


def test_without_extras_what_needs_one_says_so_in_a_sentence(bare: Path, tmp_path: Path) -> None:
    for name in ("torch", "viser", "matplotlib", "pytest"):
        assert bare_run(bare, tmp_path, "-c", f"import {name}").returncode == 1
    for extra, words in {"train": "train mdn -o out --preset smoke", "app": "app"}.items():
        done = bare_run(bare, tmp_path, "-m", "finlab", *words.split())
        assert done.returncode == 2 and done.stderr.count("\n") == 1
        assert done.stderr.endswith(f"run: pip install '{DISTRIBUTION}[{extra}]'\n")


def test_without_extras_every_method_but_ipopt_allocates(bare: Path, tmp_path: Path) -> None:
    code = (
        "import sys, finlab\n"
        "from finlab.allocation import METHODS\n"
        "layout = finlab.load_layout('A')\n"
        "heavy = finlab.load_layout('bluerov2_heavy')\n"
        "for name in METHODS:\n"
        "    if name != 'ipopt':\n"
        "        robot = heavy if name in ('px4', 'ardusub') else layout\n"
        "        result = finlab.Allocator(robot, name).allocate([1, 0, 0.5, 0, 0, 0.1])\n"
        "        assert result.err_norm < {'paper': 0.1, 'qp': 1.0}.get(name, 0.01), name\n"
        "assert 'torch' not in sys.modules\n"
    )
    done = bare_run(bare, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr


def test_without_extras_it_simulates_evaluates_and_exports(bare: Path, tmp_path: Path) -> None:
    for line in (
        "simulate A --duration 12",
        "eval wrench --split id --layouts 2 --targets 3 --methods dual,paper,sqp",
        "bench analytic --quick --splits id",
        "export mixed -o robot",
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
    pins = {normal_name(line.split("==")[0]) for line in lines if line and not line.startswith("#")}
    assert all("==" in line for line in lines if not line.startswith("#"))
    assert declared("dev") <= pins


def test_every_place_tells_the_same_version() -> None:
    import yaml

    import finlab

    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == finlab.__version__
