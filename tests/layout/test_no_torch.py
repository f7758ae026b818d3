"""The layout package serves runtimes without torch, so it must not pull it in."""

import subprocess
import sys


def test_layouts_load_without_torch():
    code = "import sys, finlab.layout; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
