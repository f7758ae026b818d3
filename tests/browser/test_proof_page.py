"""The checker of proofs in JavaScript, in a real browser beside the one in Python."""

import http.server
import json
import os
import random
import re
import shutil
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import finlab
from finlab.analysis import check_proof
from finlab.analysis.prove import prove
from tests.random_robots import load, random_robot

ROOT = Path(__file__).resolve().parents[2]
CHANGED_FILES = int(os.environ.get("FINLAB_PROOF_CHANGES", "40"))
"""Files with one digit changed; a thousand say more."""
VERDICTS_SCRIPT = """async (texts) => {
  const { check } = await import("./demo/check_proof.js");
  return texts.map((text) => { try { return check(text); } catch { return "refused"; } });
}"""
"""Script: the sentence of each text of a proof, or that it is refused."""


@pytest.fixture(scope="module")
def proof_page(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The page's part that checks a file, without the rest of it."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "demo").mkdir()
    for script in (ROOT / "docs" / "demo").glob("*.js"):
        shutil.copy(script, folder / "demo")
    text = (ROOT / "docs" / "howto" / "prove.md").read_text("utf-8")
    block = re.search(r'<div id="proof-check">.*?</script>', text, re.DOTALL)
    assert block is not None
    html = block.group().replace("../../demo", "demo")
    (folder / "index.html").write_text(f'<meta charset="utf-8"><body>{html}', "utf-8")
    handler = partial(http.server.SimpleHTTPRequestHandler, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        yield page
        page.close()
        server.shutdown()


@pytest.fixture(scope="module")
def files() -> list[str]:
    """Files with and without a budget, of lines, discs, arcs and small forces as means."""
    texts = []
    for robot, box, lost, power in (
        (finlab.load_layout("no_yaw"), [1, 1, 2, 0.1, 0.1, 0], 1, 150.0),
        (finlab.load_layout("no_yaw"), [1, 1, 20, 0.1, 0.1, 0], 1, None),
        (finlab.load_layout("catamaran"), [10, 5, 0, 0, 0, 4], 1, 900.0),
        (finlab.load_layout("catamaran"), [10, 5, 0, 0, 0, 4], 1, 2.0),
        (load(random_robot("wide arcs", 14, 63)), [1e-3, 1e-3, 1e-3, 0, 0, 0], 0, None),
        (load(random_robot("wide arcs", 14, 63)), [0.1, 0.1, 0.1, 0.1, 0.1, 0.1], 1, None),
        (load(random_robot("holes", 13, 63)), [0.1, 0.1, 0.1, 0, 0, 0], 0, None),
    ):
        result = prove(robot, box, lost=lost, power=power)
        assert result.proof is not None, result.reason
        texts.append(json.dumps(result.proof))
    return texts


def verdict(text: str) -> str:
    """The sentence of the checker in Python, or that it refuses."""
    try:
        return check_proof.check(text)
    except (check_proof.WrongProof, LookupError, TypeError, ValueError, ArithmeticError):
        return "refused"


def test_both_checkers_say_the_same(proof_page: Any, files: list[str]) -> None:
    """Of true files, and of files with one digit changed."""
    rng = random.Random(64)
    texts = [*files]
    for number in range(CHANGED_FILES):
        text = files[number % len(files)]
        place = rng.choice([i for i, letter in enumerate(text) if letter.isdigit()])
        digit = rng.choice([d for d in "0123456789" if d != text[place]])
        texts.append(text[:place] + digit + text[place + 1 :])
    texts += [files[0].replace("2", "02", 1), files[0][:-1], "[]", "{}"]
    expected = [verdict(text) for text in texts]
    assert proof_page.evaluate(VERDICTS_SCRIPT, texts) == expected
    assert "refused" not in expected[: len(files)]
    assert expected.count("refused") > CHANGED_FILES // 4


def test_a_file_is_checked_in_the_page(proof_page: Any, files: list[str]) -> None:
    for text, words in ((files[0], "proved: any wrench of"), (files[0][:-1], "Refused: ")):
        buffer = text.encode()
        proof_page.set_input_files(
            "#proof-check input",
            {"name": "proof.json", "mimeType": "application/json", "buffer": buffer},
        )
        proof_page.wait_for_function(
            "words => document.querySelector('#proof-check .verdict').textContent.startsWith(words)",
            arg=words,
        )
