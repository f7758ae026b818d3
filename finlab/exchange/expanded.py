"""Descriptions that the package xacro expands, in a process of its own."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from finlab.errors import LayoutError

SECONDS, BYTES = 20, 1_000_000_000
"""Most time and memory that it may take."""
_PROGRAM = f"import resource, xacro; resource.setrlimit(resource.RLIMIT_AS, ({BYTES},) * 2); xacro.main()"


def expanded(path: Path | None) -> str:
    """Returns the text that xacro makes of a file. Raises LayoutError: xacro is not installed, or refuses the
    file; or it came without a path, from a browser: expanding opens other files."""
    if path is None or find_spec("xacro") is None:
        why = "`finlab layout convert` expands it" if path is None else "pip install finlab-marine[xacro]"
        raise LayoutError(f"is a xacro file, not a description; run `xacro FILE > robot.urdf` first ({why})")
    command = [sys.executable, "-c", _PROGRAM, str(path.absolute())]
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        raise LayoutError(f"is a xacro file that takes over {SECONDS} s to expand") from None
    if done.returncode:
        words = done.stderr.decode(errors="replace").split()
        raise LayoutError(f"is a xacro file that xacro refuses: {' '.join(words)[:300] or 'it says nothing'}")
    return done.stdout.decode(errors="replace")
