"""The core's own tests in C, by cmake and ctest, in both precisions."""

import subprocess
from pathlib import Path

import pytest

from finlab import core

CORE_FOLDER = Path(core.__path__[0])
"""The core with its `CMakeLists.txt`."""


@pytest.mark.parametrize("single", ["OFF", "ON"])
def test_tests_in_c_hold(single: str, tmp_path: Path) -> None:
    configure = ["cmake", "-S", str(CORE_FOLDER), "-B", str(tmp_path), f"-DFL_SINGLE={single}"]
    subprocess.run([*configure, "-DCMAKE_BUILD_TYPE=Debug"], check=True)
    subprocess.run(["cmake", "--build", str(tmp_path)], check=True)
    subprocess.run(["ctest", "--output-on-failure"], check=True, cwd=tmp_path)
