"""The code blocks of pages: found, run in folders of their own, and shown with their output.

A block ```python or ```sh is run, after those before it on its page. One whose title begins with "Not run"
is not, and its title says so to the reader. Another title names a file: a block of any language is written to
it, and not run.
"""

import base64
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mkdocs.exceptions import PluginError

ROOT = Path(__file__).resolve().parents[2]
RUNNER = Path(__file__).with_name("runner.py")
KEPT = ROOT / "build" / "shown"
FENCE = re.compile(r'^```(\w*)(?: title="(.*?)")?\n(.*?)^```\n', re.MULTILINE | re.DOTALL)
LONGEST = 40  # lines of output that are shown
Blocks = list[dict[str, str]]
Shown = list[dict[str, Any]]


def blocks_of(text: str) -> Blocks:
    """The blocks of a page in order, but those that are not run and name no file."""
    found = [
        dict(zip(("language", "title", "text"), match.groups(""), strict=True))
        for match in FENCE.finditer(text)
    ]
    return [each for each in found if is_run(each)]


def is_run(block: dict[str, str]) -> bool:
    """Whether a block is run, or written to a file."""
    if not block["language"]:
        raise PluginError(f"a block has no language (python, sh, yaml, text, ...):\n{block['text']}")
    return not block["title"].startswith("Not run") and (
        block["language"] in ("python", "sh") or bool(block["title"])
    )


def cells_of(text: str) -> tuple[str, Blocks]:
    """The title of an example, and its cells: a notebook in percent format, or one cell with a docstring."""
    first, *rest = re.split(r"^# %%(.*)\n", text, flags=re.MULTILINE)
    cells = [{"language": "python", "title": "", "text": first}] if first.strip() else []
    for mark, cell in zip(rest[::2], rest[1::2], strict=True):
        words = "markdown" in mark
        cell = re.sub("^# ?", "", cell, flags=re.MULTILINE) if words else cell
        cells.append(
            {"language": "markdown" if words else "python", "title": "", "text": cell.strip() + "\n"}
        )
    about = re.search(r'^(?:# |""")(.*)', cells[0]["text"])
    return (about.group(1).rstrip(".") if about else ""), cells


def run_all(sources: dict[str, Blocks]) -> dict[str, Shown]:
    """What the blocks of each source show. Blocks that ran with this code before are in `build/shown`."""
    code = hashlib.sha256(RUNNER.read_bytes())
    for path in sorted([*(ROOT / "finlab").rglob("*.[pch]*"), *(ROOT / "layouts").iterdir()]):
        if path.suffix in (".py", ".c", ".h", ".yaml", ".csv"):
            code.update(path.read_bytes())
    with ThreadPoolExecutor(2) as pool:
        shown = pool.map(lambda item: _run(*item, code.hexdigest()), sources.items())
        return dict(zip(sources, shown, strict=True))


def _run(source: str, blocks: Blocks, code: str) -> Shown:
    asked = json.dumps(blocks)
    kept = KEPT / f"{hashlib.sha256((code + source + asked).encode()).hexdigest()}.json"
    if not blocks or kept.exists():
        return json.loads(kept.read_text()) if blocks else []
    own = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}", "COLUMNS": "100"}
    own |= {"MPLBACKEND": "agg", "NO_COLOR": "1", "PYTHONWARNINGS": "ignore"}
    with TemporaryDirectory() as folder:
        if source.startswith("examples/"):
            for data in (ROOT / "examples").glob("*.csv"):
                shutil.copy(data, folder)
        command = [sys.executable, str(RUNNER), str(ROOT / source)]
        done = subprocess.run(
            command, cwd=folder, env=os.environ | own, input=asked, capture_output=True, text=True
        )
    if done.returncode:
        raise PluginError(f"{source}: a block failed\n{done.stderr}")
    KEPT.mkdir(parents=True, exist_ok=True)
    kept.write_text(done.stdout)
    return json.loads(done.stdout)


def with_output(text: str, shown: Shown) -> str:
    """A page with the output of each of its blocks below it."""
    left = iter(shown)

    def add(match: re.Match[str]) -> str:
        block = dict(zip(("language", "title", "text"), match.groups(""), strict=True))
        return match.group() + (output(next(left)) if is_run(block) else "")

    return FENCE.sub(add, text)


def output(shown: dict[str, Any]) -> str:
    """What a block showed, in Markdown."""
    lines = shown["text"].rstrip().splitlines()
    lines = [*lines[: LONGEST - 10], "...", *lines[-9:]] if len(lines) > LONGEST else lines
    parts = ["```{ .text .output }\n" + "\n".join(lines) + "\n```"] if lines else []
    parts += [f'<div class="output">{shown["html"]}</div>'] if shown["html"] else []
    parts += [
        f'<img class="output" alt="what it draws" src="data:image/png;base64,{data}">'
        for data in shown["pictures"]
    ]
    return "".join(f"\n{part}\n" for part in parts)


def picture(shown: Shown) -> bytes | None:
    """The last picture of an example."""
    found = [
        data
        for each in shown
        for data in (*re.findall(r"base64,([\w+/=]+)", each["html"] or ""), *each["pictures"])
    ]
    return base64.b64decode(found[-1]) if found else None
