"""The code blocks of pages, and the cells of examples: run as notebooks, and shown with their
output.

A block ```python or ```sh is run, after those before it on its page. One whose title begins with
"Not run" is not, and its title says so to the reader. Another title names a file: a block of any
language is written to it, and not run.

`hooks.py` calls these functions; `tests/examples/test_site.py` holds them.
"""

import base64
import hashlib
import os
import re
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import nbformat
from mkdocs.exceptions import PluginError
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat.v4 import new_code_cell, new_notebook

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / "build" / "shown"
FENCE = re.compile(r'^```(\w*)(?: title="(.*?)")?\n(.*?)^```\n', re.MULTILINE | re.DOTALL)
LONGEST = 40  # lines of output that are shown
ENVIRONMENT = {"COLUMNS": "100", "NO_COLOR": "1", "PYTHONWARNINGS": "ignore"}
QUIET = ["--IPKernelApp.log_level=40"]  # of kernels
WRITE = """from pathlib import Path
_ = Path({0!r})
_.parent.mkdir(parents=True, exist_ok=True)
_ = _.write_text({1!r})"""


def cell_of(language: str, title: str, text: str) -> Any:
    """The cell that runs a block, or writes it to a file; None where it does neither."""
    if not language:
        raise PluginError(f"a block has no language (python, sh, yaml, text, ...):\n{text}")
    if title.startswith("Not run") or not (title or language in ("python", "sh")):
        return None
    shell = "%%bash -euo pipefail\n" * (language == "sh")
    return new_code_cell(WRITE.format(title, text) if title else shell + text.rstrip())


def notebook_of(page: str) -> Any:
    """The blocks of a page as a notebook."""
    cells = (cell_of(*match.groups("")) for match in FENCE.finditer(page))
    return new_notebook(cells=[cell for cell in cells if cell is not None])


def run_all(notebooks: dict[str, Any]) -> dict[str, Any]:
    """The notebook of each source with its outputs. Those that ran with this code before are in
    `build/shown`."""
    code = hashlib.sha256(Path(__file__).read_bytes())
    for path in sorted([*(ROOT / "finlab").rglob("*.[pch]*"), *(ROOT / "layouts").iterdir()]):
        if path.suffix in (".py", ".c", ".h", ".yaml", ".csv"):
            code.update(path.read_bytes())
    with ThreadPoolExecutor(2) as pool:
        done = pool.map(lambda item: run(*item, code.hexdigest()), notebooks.items())
        return dict(zip(notebooks, done, strict=True))


def run(source: str, notebook: Any, code: str) -> Any:
    """A notebook with its outputs, run in a folder of its own."""
    text = "\0".join((code, source, *(cell.source for cell in notebook.cells)))
    kept = KEPT / f"{hashlib.sha256(text.encode()).hexdigest()}.ipynb"
    if kept.exists():
        return nbformat.read(kept, 4)
    own = {
        **os.environ,
        **ENVIRONMENT,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }
    begin = new_code_cell(f"import sys\nsys.argv = [{str(ROOT / source)!r}]")
    whole = new_notebook(cells=[begin, *notebook.cells])
    with TemporaryDirectory() as folder:
        if source.startswith("examples/"):
            for data in (ROOT / "examples").glob("*.csv"):
                shutil.copy(data, folder)
        about = {"resources": {"metadata": {"path": folder}}, "extra_arguments": QUIET}
        client = NotebookClient(whole, timeout=None, **about)
        try:
            client.execute(env=own)
        except CellExecutionError as error:
            raise PluginError(f"{source}: a block failed\n{error}") from None
    whole.cells.remove(begin)
    KEPT.mkdir(parents=True, exist_ok=True)
    nbformat.write(whole, kept)
    return whole


def with_output(page: str, notebook: Any) -> str:
    """A page with the output of each of its blocks below it."""
    left = iter(notebook.cells)

    def add(match: re.Match[str]) -> str:
        return match.group() + (output(next(left)) if cell_of(*match.groups("")) else "")

    return FENCE.sub(add, page)


def output(cell: Any) -> str:
    """What a cell showed, in Markdown: what it printed, and its value as a table, a picture or
    text."""
    parts = []
    text = ""
    for each in cell.get("outputs", ()):
        data = each.get("data", {})
        if html := data.get("text/html"):
            parts.append(f'<div class="output">{html}</div>')
        elif png := data.get("image/png"):
            parts.append(
                f'<img class="output" alt="what it draws" src="data:image/png;base64,{png}">'
            )
        elif each.get("name") != "stderr" or cell.source.startswith("%%bash"):
            text += each.get("text") or data.get("text/plain", "") + "\n"
    lines = text.rstrip().splitlines()
    lines = [*lines[: LONGEST - 10], "...", *lines[-9:]] if len(lines) > LONGEST else lines
    if lines:
        parts.insert(0, "```{ .text .output }\n" + "\n".join(lines) + "\n```")
    return "".join(f"\n{part}\n" for part in parts)


def picture(notebook: Any) -> bytes | None:
    """The last picture of an example."""
    shown = "".join(output(cell) for cell in notebook.cells)
    found = re.findall(r"base64,([\w+/=]+)", shown)
    return base64.b64decode(found[-1]) if found else None
