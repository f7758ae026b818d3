"""The compiled core is built for the wheel anew, and says what to do where it is missing."""

import ctypes
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from packaging.tags import platform_tags

from finlab import core
from finlab.errors import FinlabError

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """What the build reads of the tree, with libraries in it that are stale."""
    core = tmp_path / "finlab" / "core"
    shutil.copytree(ROOT / "finlab" / "core", core, ignore=shutil.ignore_patterns("libfinlab.*"))
    for name in ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE", "finlab/__init__.py"):
        shutil.copy(ROOT / name, tmp_path / name)
    for ending in ("so", "dylib", "dll"):
        (core / f"libfinlab.{ending}").write_text("stale")
    return tmp_path


def python(project: Path, *argv: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a project, without the settings of a compiler that this machine may have."""
    clean = {key: value for key, value in os.environ.items() if key not in ("CC", "FINLAB_TARGET")}
    words = [sys.executable, *argv]
    variables = clean | variables
    return subprocess.run(
        words, cwd=project, env=variables, capture_output=True, text=True, timeout=120
    )


def test_wheels_and_the_tree_get_a_new_library_and_the_source_distribution_none(
    project: Path,
) -> None:
    assert python(project, "-m", "hatchling", "build").returncode == 0
    archive = str(
        next(project.glob("dist/*.tar.gz"))
    )  # Python before 3.11.4 knows no filter for it
    assert python(project, "-m", "tarfile", "-e", archive, "unpacked").returncode == 0
    source = next(project.glob("unpacked/*"))
    assert not list(source.rglob("libfinlab.*"))
    assert python(source, "-m", "hatchling", "build", "-t", "wheel").returncode == 0
    for tree in (project, source):
        wheel = next(tree.glob("dist/*.whl"))
        _, _, tag, abi, platform = wheel.stem.split("-")
        assert (tag, abi) == ("py3", "none") and platform in platform_tags()
        (name,) = (name for name in zipfile.ZipFile(wheel).namelist() if "libfinlab." in name)
        packed = zipfile.ZipFile(wheel).extract(name, tree / "packed")
        assert ctypes.PyDLL(packed).fl_version() == core.VERSION
    assert python(source, "hatch_build.py").returncode == 0
    assert ctypes.PyDLL(str(source / name)).fl_version() == core.VERSION


def test_what_does_not_compile_is_said_in_the_words_of_the_compiler(project: Path) -> None:
    for source in (project / "finlab" / "core" / "src").glob("*.c"):
        source.unlink()  # one file is compiled sooner than all
    (project / "finlab" / "core" / "src" / "wrong.c").write_text(
        "int wrong(void) { return nowhere; }\n"
    )
    for argv in (["hatch_build.py"], ["-m", "hatchling", "build", "-t", "wheel"]):
        done = python(project, *argv)
        assert done.returncode == 1 and "nowhere" in done.stderr and "Traceback" not in done.stderr
        assert "install a C compiler" in done.stderr
    assert (
        "name one of x86_64-linux-gnu"
        in python(project, "hatch_build.py", FINLAB_TARGET="pdp11").stderr
    )


def test_only_without_a_compiler_another_is_fetched(project: Path) -> None:
    code = "import hatch_build; print(*hatch_build.requirements())"
    assert python(project, "-c", code, PATH="").stdout.startswith("ziglang")
    assert python(project, "-c", code, PATH="", CC="mycc -m64").stdout == "\n"


def test_library_that_is_missing_broken_or_of_other_sources_is_refused(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    load = core.library.__wrapped__
    monkeypatch.setattr(core, "VERSION", 99)
    with pytest.raises(
        FinlabError, match=r"has version \d+, and this finlab needs 99; run `make setup`"
    ):
        load()
    monkeypatch.setattr(core, "PATH", project / "finlab" / "core" / core.PATH.name)
    with pytest.raises(
        FinlabError, match=r"cannot be loaded \(.*\); run `make setup` or `pip install \.`"
    ):
        load()
    core.PATH.unlink()
    with pytest.raises(FinlabError, match=r"core .*libfinlab\.\w+ is missing; run `make setup`"):
        load()
