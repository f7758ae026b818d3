"""Every example runs as a notebook, shows a picture or a table at its end, and says what there is
to see."""

import os
import runpy
import shutil
import time
from collections.abc import Iterator
from itertools import chain
from operator import attrgetter
from pathlib import Path
from typing import Any

import jupytext
import pytest
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell

from tests.sampled_cases import sampled

EXAMPLES = sorted((Path(__file__).resolve().parents[2] / "examples").glob("[0-9]*.py"))
"""Files of the examples, by their numbers."""
NOTEBOOKS = [path for path in EXAMPLES if "# %%" in path.read_text()]
"""`make docs` runs all of them."""
stem = attrgetter("stem")
"""Name of a test's case: that of the file without its ending."""
PATIENCE_S = 20.0
"""What a notebook may take."""


@pytest.fixture(scope="module")
def kernel() -> Iterator[NotebookClient]:
    """One kernel for all notebooks: to start one takes longer than most of them."""
    client = NotebookClient(
        jupytext.reads("", "py:percent"), timeout=PATIENCE_S, kernel_name="python3"
    )
    with client.setup_kernel():
        yield client


def test_there_are_examples() -> None:
    assert [path.name[:2] for path in EXAMPLES] == [f"{i:02d}" for i in range(1, len(EXAMPLES) + 1)]
    assert len(NOTEBOOKS) >= 12


@pytest.mark.parametrize("path", sampled(NOTEBOOKS, every=4), ids=stem)
def test_notebook_runs(path: Path, kernel: NotebookClient, tmp_path: Path) -> None:
    shutil.copy(path.with_name("soft_fin.csv"), tmp_path)
    notebook = jupytext.read(path)
    notebook.cells.insert(0, new_code_cell(f"%reset -f\n%cd -q {tmp_path}"))
    kernel.nb = notebook
    started = time.monotonic()
    for number, cell in enumerate(notebook.cells):
        kernel.execute_cell(cell, number)
    assert time.monotonic() - started < PATIENCE_S
    outputs = list(chain.from_iterable(cell.get("outputs", ()) for cell in notebook.cells))
    assert any(output.get("name") == "stdout" and output.text.strip() for output in outputs)
    assert not [output for output in outputs if output.get("name") == "stderr"]
    (*_, last) = [output for output in outputs if "data" in output]
    assert "image/png" in last.data or "<img" in last.data["text/html"]
    assert os.listdir(tmp_path) == ["soft_fin.csv"], "an example leaves nothing behind"


def test_the_script_says_how_it_is_called(
    monkeypatch: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in set(EXAMPLES) - set(NOTEBOOKS):
        monkeypatch.setattr("sys.argv", [str(path)])
        runpy.run_path(str(path), run_name="__main__")
        assert path.name in capsys.readouterr().out


@pytest.mark.parametrize("path", EXAMPLES, ids=stem)
def test_example_is_short_and_says_what_you_will_see(path: Path) -> None:
    text = path.read_text()
    assert len(text.splitlines()) < 100, "an example is read in a sitting"
    assert text.startswith(('"""', "# %% [markdown]\n# # ")) and "You will see" in text.replace(
        "\n#", ""
    )
