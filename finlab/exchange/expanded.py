"""Descriptions that the package xacro expands, in a process of its own."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from finlab.errors import LayoutError

SECONDS, BYTES = 20, 1_000_000_000
"""Most time and memory that it may take."""
_PROGRAM = (
    "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[1]),) * 2); "
    "import xacro; sys.argv[1:] = sys.argv[2:]; xacro.main()"
)


def expanded(path: Path | None) -> str:
    """Returns the text that xacro makes of a file.

    Raises:
        LayoutError: xacro is not installed, or refuses the file; or it came without a path, from a browser:
            expanding opens other files.
    """
    if path is None or find_spec("xacro") is None:
        why = "`finlab layout convert` expands it" if path is None else "pip install finlab-marine[xacro]"
        raise LayoutError(
            f"is a xacro file, not a robot description; run `xacro FILE > robot.urdf` first ({why})"
        )
    command = [sys.executable, "-c", _PROGRAM, str(BYTES), str(path.absolute())]
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        raise LayoutError(f"is a xacro file that takes over {SECONDS} s to expand") from None
    if done.returncode:
        said = [line for line in done.stderr.decode(errors="replace").splitlines() if line.strip()]
        raise LayoutError(
            f"is a xacro file that xacro refuses: {' '.join(said[:2])[:300] or 'it says nothing'}"
        )
    return done.stdout.decode(errors="replace")
