"""The files of the page of six sliders: the core as WebAssembly, and robots as its blocks of
numbers.

`hooks.py` adds them to the site; `tests/browser/test_six_sliders.py` holds them.
"""

import json
import subprocess
import sys
from importlib.resources import files as package_files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from mkdocs.exceptions import PluginError

from finlab import load_layout
from finlab.allocation.dual.method import Dual, DualSettings
from finlab.allocation.policy import Policy
from finlab.forces.reach import axis_ranges
from finlab.layout import Layout
from finlab.physics.objective import wrench_scale_of
from finlab.swim.vehicle.fossen import complete_body

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = "bluerov2_heavy", "A", "turtle_hybrid", "catamaran"
EXPORTS = (
    "fl_fields",
    "fl_constant_name",
    "fl_constant_value",
    "fl_check",
    "fl_prepare",
    "fl_answer_one",
    "fl_power_of_force",
    "__heap_base",
)


def demo_files(robots: tuple[str, ...] = ROBOTS) -> dict[str, bytes]:
    """The files by name, as they lie beside the page."""
    about, blocks = zip(*(_robot(load_layout(name)) for name in robots), strict=True)
    files = {f"{name}.bin": content for name, content in zip(robots, blocks, strict=True)}
    return {"robots.json": json.dumps(about).encode(), "finlab.wasm": _compiled(), **files}


def _robot(layout: Layout) -> tuple[dict[str, Any], bytes]:
    """What the page shows of a robot, and its block."""
    scale = wrench_scale_of(layout)
    robot = Dual(layout, DualSettings(), scale, None).compiled
    most = np.abs(axis_ranges(layout, np.zeros(6))).max(axis=0) * layout.commanded
    most[most < 1e-6 * scale] = 0.0
    hull = complete_body(layout).hull
    about = {
        "name": layout.name,
        "most": most.tolist(),
        "wrench": (most * [0.4, 0, 0.2, 0, 0, 0.3]).tolist(),
        "groups": np.array(Policy("priority").groups).astype(int).tolist(),
        "hull": hull.size_m,
        "center": hull.center_m,
        "size": float(max(np.abs(layout.position).max(), max(hull.size_m) / 2)),
        "strongest": float(robot.row_force_max.max()),
        "actuators": [
            {
                "name": name,
                "position": at.tolist(),
                "directions": own.tolist(),
                "numbers": [(number.name, number.unit) for number in part.KIND.numbers],
            }
            for name, at, own, part in zip(
                layout.names,
                layout.position,
                robot.effectiveness[..., :3],
                layout.actuators,
                strict=True,
            )
        ],
    }
    return about, robot.block.astype("<f8").tobytes()


def _compiled() -> bytes:
    """The core, whose sines the browser computes: so it needs headers, and no C library."""
    headers = package_files("ziglang") / "lib" / "libc" / "include"
    words = (
        "cc -std=c99 -O2 -ffp-contract=off -fno-math-errno -mbulk-memory -target wasm32-wasi "
        "-nostdlib -s"
    )
    words += " -DFL_MOST=16 -Wl,--no-entry -Wl,--import-symbols"
    core = ROOT / "finlab" / "core"
    include = [
        f"-I{core}",
        *(f"-isystem{headers / name}" for name in ("wasm-wasi-musl", "generic-musl")),
    ]
    sources = sorted(map(str, (core / "src").glob("*.c")))
    with TemporaryDirectory() as folder:
        made = Path(folder) / "finlab.wasm"
        exports = [f"-Wl,--export={name}" for name in EXPORTS]
        command = [sys.executable, "-m", "ziglang", *words.split(), *include, *exports, *sources]
        done = subprocess.run([*command, "-o", str(made)], capture_output=True, text=True)
        if done.returncode:
            raise PluginError(f"the core did not compile to WebAssembly\n{done.stderr}")
        return made.read_bytes()
