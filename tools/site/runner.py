"""Run the blocks of a page, or the cells of an example, in one process and one folder, as a reader would.

From JSON on standard input, [{"language", "title", "text"}], to JSON on standard output: what each block
showed, {"text", "html", "pictures"}, pictures as PNG in base64. A block with a title is written to the file
of that name instead. A block that fails ends everything with its traceback.
"""

import ast
import base64
import io
import json
import os
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path
from types import ModuleType
from typing import Any


def main(source: str) -> None:
    """Run the blocks on standard input, which stand in the file `source`."""
    real = os.dup(1)
    os.dup2(2, 1)  # what is printed past Python, too, must not mix with the JSON
    sys.path[0] = ""
    sys.argv, sys.modules["__main__"] = [source], ModuleType("__main__")
    shown = [show(block, vars(sys.modules["__main__"])) for block in json.load(sys.stdin)]
    os.write(real, json.dumps(shown).encode())


def show(block: dict[str, str], names: dict[str, Any]) -> dict[str, Any]:
    """Run one block with the names that those before it left; what it showed."""
    language, title, text = block["language"], block["title"], block["text"]
    if title:
        Path(title).parent.mkdir(parents=True, exist_ok=True)
        Path(title).write_text(text, encoding="utf-8")
        return {"text": "", "html": None, "pictures": []}
    if language == "python":
        out = io.StringIO()
        with redirect_stdout(out):
            value = run(text, names)
        html = value._repr_html_() if hasattr(value, "_repr_html_") else None
        said = "" if value is None or html or hasattr(value, "savefig") else f"{value}\n"
        return {"text": out.getvalue() + said, "html": html, "pictures": pictures(value)}
    if language == "markdown":
        return {"text": "", "html": None, "pictures": []}
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", text], stdout=-1, stderr=-2, text=True)
    if done.returncode:
        sys.exit(f"{text}\n{done.stdout}\nthis block ended with code {done.returncode}")
    return {"text": done.stdout, "html": None, "pictures": []}


def run(text: str, names: dict[str, Any]) -> Any:
    """Run Python code; the value of its last expression, as in a notebook, None without one."""
    tree, place = ast.parse(text), f"<{sys.argv[0]}>"
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, place, "exec"), names)
    return eval(compile(ast.Expression(last.value), place, "eval"), names) if last else None


def pictures(value: Any) -> list[str]:
    """A value that is a figure of matplotlib, and the figures that are open, which are closed then."""
    plots = sys.modules.get("matplotlib.pyplot")
    figures = [plots.figure(number) for number in plots.get_fignums()] if plots else []
    made = []
    for figure in dict.fromkeys([*figures, *([value] if hasattr(value, "savefig") else [])]):
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=110, bbox_inches="tight")
        made.append(base64.b64encode(file.getvalue()).decode())
    if plots:
        plots.close("all")
    return made


if __name__ == "__main__":
    main(sys.argv[1])
