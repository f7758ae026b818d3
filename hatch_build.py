"""The compiled core's build: a hook of hatchling, and a command that compiles it in the tree.

The compiler is `$CC`, else one on PATH, else that of the package ziglang, which compiles for other
systems, too, where FINLAB_TARGET names one.
"""

import os
import shlex
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging.tags import platform_tags

CORE = Path(__file__).with_name("finlab") / "core"
# No fast math, no contraction, no instructions of this machine alone: results do not depend on the
# builder.
FLAGS = shlex.split(
    "-std=c99 -O3 -ffp-contract=off -fno-math-errno -fno-trapping-math -fPIC -shared -Wall "
    "-DFL_WITH_FALLING -DFL_WITH_POWER_SETS"
)
ZIG = [sys.executable, "-m", "ziglang", "cc", "-s", "-mcpu=baseline", "-target"]
# Target as zig names it: platform in the name of the wheel, ending of a library.
TARGETS = {
    "x86_64-linux-gnu.2.17": ("manylinux_2_17_x86_64", "so"),
    "aarch64-linux-gnu.2.28": ("manylinux_2_28_aarch64", "so"),
    "x86_64-macos.11.0": ("macosx_11_0_x86_64", "dylib"),
    "aarch64-macos.11.0": ("macosx_11_0_arm64", "dylib"),
    "x86_64-windows-gnu": ("win_amd64", "dll"),
}


def target() -> tuple[list[str], str, str]:
    """Returns the compiler's first words, the wheel's platform and the library's file name."""
    name = os.environ.get("FINLAB_TARGET")
    if name and name not in TARGETS:
        sys.exit(f"FINLAB_TARGET is {name!r}; name one of {', '.join(TARGETS)}")
    if name:
        platform, ending = TARGETS[name]
        return [*ZIG, name], platform, f"libfinlab.{ending}"
    ending = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
    # The library needs this system's C library or a newer one, so its platform is no manylinux.
    platform = next(
        tag for tag in platform_tags() if not tag.startswith(("manylinux", "musllinux"))
    )
    return compiler() or [*ZIG, "native"], platform, f"libfinlab.{ending}"


def compiler() -> list[str]:
    """Returns the words of the system's C compiler, none where there is none."""
    names = () if os.name == "nt" else ("cc", "gcc", "clang")
    return (
        shlex.split(os.environ.get("CC", "")) or [name for name in names if shutil.which(name)][:1]
    )


def requirements() -> list[str]:
    """Returns the packages that compiling needs."""
    return ["ziglang>=0.13"] if target()[0][: len(ZIG)] == ZIG else []


def compile_core(folder: Path) -> Path:
    """Compiles the core; returns the library's path in a folder, where a file of that name is
    replaced."""
    words, _, name = target()
    with (
        TemporaryDirectory() as work
    ):  # a process that has loaded the library in the folder keeps its own
        made = Path(work) / name
        sources = map(str, sorted((CORE / "src").glob("*.c")))
        command = [*words, *FLAGS, f"-I{CORE}", *sources, "-o", str(made), "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, text=True)
            said = done.stderr or done.stdout
            failed = done.returncode != 0
        except OSError as error:
            said = str(error)
            failed = True
        if failed:
            sys.exit(
                f"{said}\nthe core of finlab did not compile by {shlex.join(command)}; install a "
                "C compiler "
                "with its headers (on Debian and Ubuntu: apt-get install gcc libc6-dev), or set "
                "CC to one"
            )
        print(said, end="", file=sys.stderr)  # warnings
        shutil.copy(made, folder / f"{name}.new")
        return (folder / f"{name}.new").replace(folder / name)


class CoreHook(BuildHookInterface[Any]):
    """Puts the library into the wheel, or into the tree where the install is editable."""

    def dependencies(self) -> list[str]:
        return requirements()

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            compile_core(CORE)
            return
        self.work = TemporaryDirectory()
        made = compile_core(Path(self.work.name))
        build_data["force_include"][str(made)] = f"finlab/core/{made.name}"
        build_data["tag"] = f"py3-none-{target()[1]}"
        build_data["pure_python"] = False

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        if version != "editable":
            self.work.cleanup()


if __name__ == "__main__":
    if requirements() and not find_spec("ziglang"):
        pip = [
            sys.executable,
            "-m",
            "pip",
            "install",
            "--disable-pip-version-check",
            "-c",
            "constraints.txt",
        ]
        subprocess.run([*pip, *requirements()], check=True)
    print(compile_core(CORE))
