"""The fields of a block are said once: one more in the middle changes no answer, in Python or
exported C."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

import finlab

ANSWERS_SCRIPT = """
import sys
import numpy as np
from pathlib import Path
from finlab import Allocator, load_layout
from finlab.core.fields import struct
from finlab.deploy.c_sources import c_sources, write_c
from finlab.physics import plant_of

folder = Path(sys.argv[1])
commands = {}
for name in ("A", "bluerov2_heavy", "catamaran"):
    layout = load_layout(Path(sys.argv[2]) / f"{name}.yaml")
    allocator = Allocator(layout)
    middle = layout.lower + 0.4 * (layout.upper - layout.lower)
    wrench = plant_of(layout).wrench(middle)
    first = allocator.allocate(wrench)
    tick = allocator.allocate(3.0 * wrench, previous=first, policy="direction")
    commands[name] = np.stack([first.command, tick.command])
    write_c(c_sources(layout, samples=4), folder / name)
np.savez(folder / "commands.npz", fields=struct("fl_actuator").names, **commands)
"""
"""A program that loads the changed core, and writes what it answers for three robots."""
LAYOUT_FOLDER = Path(finlab.__file__).parents[1] / "layouts"
"""The shipped layouts."""
C_FLAGS = ["-std=c99", "-O0", "-ffp-contract=off", "-Wall", "-Wextra", "-Wno-cpp", "-Werror"]
"""Options of the C compiler; warnings are errors."""
OF_LIBRARY = ["-fPIC", "-shared", "-DFL_WITH_POWER_SETS"]
"""More of them for the library that Python loads."""


def copied(folder: Path) -> Path:
    """A copy of the package, with a field more in the middle of what is said of an actuator."""
    package = Path(finlab.__file__).parent
    copy = folder / "finlab"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__", "libfinlab.*"))
    fields = copy / "core" / "fl_fields.h"
    before = "FL_FIELD(fl_real, command_kind, ,"
    text = fields.read_text()
    assert text.count(before) == 1
    fields.write_text(
        text.replace(before, f'FL_FIELD(fl_real, spare, [5], "1", "of a test")\n{before}')
    )
    return copy


def test_a_field_more_in_the_middle_changes_no_answer(tmp_path: Path) -> None:
    copy = copied(tmp_path)
    sources = sorted(map(str, (copy / "core" / "src").glob("*.c")))
    library = str(copy / "core" / "libfinlab.so")
    subprocess.run(
        ["gcc", *C_FLAGS, *OF_LIBRARY, f"-I{copy / 'core'}", *sources, "-o", library, "-lm"],
        check=True,
    )
    said = {}
    for name, place in (("now", Path(finlab.__file__).parents[1]), ("more", tmp_path)):
        out = tmp_path / name
        out.mkdir()
        words = {**os.environ, "PYTHONPATH": str(place)}
        subprocess.run(
            [sys.executable, "-c", ANSWERS_SCRIPT, str(out), str(LAYOUT_FOLDER)],
            env=words,
            cwd=out,
            check=True,
        )
        said[name] = dict(np.load(out / "commands.npz"))
    assert "spare" in said["more"].pop("fields") and "spare" not in said["now"].pop("fields")
    for name, commands in said["now"].items():
        np.testing.assert_allclose(said["more"][name], commands, rtol=0.0, atol=1e-9)
    for name in said["now"]:
        folder = tmp_path / "more" / name
        files = sorted(map(str, folder.glob("*.c")))
        subprocess.run(["gcc", *C_FLAGS, *files, "-o", str(folder / "selftest"), "-lm"], check=True)
        subprocess.run([str(folder / "selftest")], check=True, stdout=subprocess.DEVNULL)
