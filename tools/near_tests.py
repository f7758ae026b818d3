#!/usr/bin/env python3
"""Run the tests near a change: `make test-near`, or `tools/near_tests.py [PATH...] [-- PYTEST OPTIONS]`.

The change is what differs from the branch `main` (from the last commit while on it) and what git does not
track yet, or the paths that are given. Near are the tests in the folder that mirrors a changed module's
package, and each test file elsewhere that imports a changed module by its full name, where few do. Slow files
and folders are left to `make test`, unless they were changed themselves.
"""

import ast
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SLOW = (
    "tests/browser",
    "tests/packaging",
    "tests/webapp/test_faults_in_handlers.py",
    "tests/webapp/test_hostile.py",
    "tests/webapp/test_swimming.py",
    "tests/webapp/test_visitors.py",
)
"""What takes most of a minute by itself."""
FEW = 12
"""Of a module that more test files import, only the tests of its own package are near."""


def main(argv: list[str]) -> int:
    """Print which tests are near, and run them."""
    split = argv.index("--") if "--" in argv else len(argv)
    changed = argv[:split] or changed_files()
    tests = near(changed)
    if not tests:
        print("no tests are near what was changed:", *(changed or ["nothing"]))
        return 0
    print("near what was changed:", *tests)
    threads = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    skipped = [f"--ignore={path}" for path in SLOW if not any(name.startswith(path) for name in changed)]
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "worksteal", *skipped]
    command += argv[split + 1 :]
    return subprocess.run([*command, *tests], cwd=ROOT, env=os.environ | threads).returncode


def changed_files() -> list[str]:
    """Paths that differ from where this branch left `main`, and those that git does not track."""
    base = git("merge-base", "HEAD", "main") or ["HEAD"]
    return sorted({*git("diff", "--name-only", base[0]), *git("ls-files", "--others", "--exclude-standard")})


def git(*words: str) -> list[str]:
    """The lines that a git command prints; none where it fails."""
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.splitlines() if done.returncode == 0 else []


def near(changed: list[str]) -> list[str]:
    """Test files and folders near changed paths, none inside another."""
    found = set[str]()
    imports = {file: imported(ROOT / file) for file in test_files()}
    for path in map(Path, changed):
        if path.parts[0] == "tests":
            found.add(str(path if path.name.startswith("test_") else path.parent))
        elif path.parts[0] in ("finlab", "webapp"):
            module = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
            importers = [file for file, names in imports.items() if module in names]
            found |= {str(mirror(path)), *(importers if len(importers) <= FEW else ())}
    present = {name for name in found if (ROOT / name).exists()} - {"tests"}
    return sorted(name for name in present if not any(str(p) in present for p in Path(name).parents))


def mirror(path: Path) -> Path:
    """The folder of tests for a module: as deep as the tests mirror the packages."""
    parts = path.parts[1:-1] if path.parts[0] == "finlab" else path.parts[:-1]
    while parts and not (ROOT / "tests" / Path(*parts)).is_dir():
        parts = parts[:-1]
    return Path("tests", *parts)


def test_files() -> list[str]:
    """All test files but those of the slow folders."""
    files = (path.relative_to(ROOT).as_posix() for path in sorted((ROOT / "tests").rglob("test_*.py")))
    return [file for file in files if not file.startswith(SLOW)]


def imported(path: Path) -> set[str]:
    """Full names of the modules that a file imports."""
    names = set[str]()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
