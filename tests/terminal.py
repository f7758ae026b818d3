"""The command on a terminal: what a person sees first, and the sentence of a refusal."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path

from finlab.cli import main

ROOT = Path(__file__).resolve().parents[1]


def first_shown(*words: str) -> tuple[str, float]:
    """What `finlab WORDS` shows first on a terminal, and the processor's time until then [s]; it is
    ended there."""
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    program = [sys.executable, "-m", "finlab", *words]
    process = subprocess.Popen(program, cwd=ROOT, stderr=follower, stdout=subprocess.DEVNULL)
    os.close(follower)
    try:
        shown = os.read(leader, 1000).decode()
        user, system = (
            Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
        )
    finally:
        process.kill()
        process.wait()
        os.close(leader)
    return shown, (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def refused(argv: list[str]) -> str:
    """The one sentence in which the command `finlab ARGV` says what is wrong."""
    with redirect_stderr(StringIO()) as stream:
        assert main(argv) == 2
    error = stream.getvalue()
    assert error.startswith("finlab: error: ") and error.count("\n") == 1, error
    return error
