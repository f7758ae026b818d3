"""Ten thousand files of strangers: each is read, or refused by an error of ours; nothing else may happen."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.assets import shipped_layouts
from finlab.bundle_files import ABOUT, CHECKSUMS, COMPILED, GRAPH, TABLES, checksums
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.deploy.graph_file import parse_graph
from finlab.deploy.robot import load_robot, parse_robot
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.layout.load import GraphText, checksum_of

WEIGHTS, CONFIG = "checkpoint/model.safetensors", "checkpoint/config.json"
WRENCH = [1, 0, 0.5, 0, 0, 0.1]
ODD = (b"\xff", b"\0", b"9" * 30, b"1e999", b"NaN", b"[", b"{", b'"', b"\n- ", b"&a *a", b"-1", b"null", b"")


def counts(most: int) -> pytest.MarkDecorator:
    """Runs of a tenth of the files each day, and of all where every case is asked for."""
    return pytest.mark.parametrize("count", [most // 10, pytest.param(most, marks=pytest.mark.exhaustive)])


@pytest.fixture(scope="module")
def small(untrained_mdn: Path) -> Bundle:
    """A bundle of a small network, so that many fit into a test."""
    allocator = finlab.load_allocator("mdn", checkpoint=untrained_mdn)
    return make_bundle(load_layout("A"), allocator)


def mutated(rng: np.random.Generator, content: bytes) -> bytes:
    """Content with some bytes changed, cut, doubled, or something odd put in."""
    changed = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        place, kind = int(rng.integers(0, len(changed) + 1)), rng.integers(5)
        if kind == 0 and place < len(changed):
            changed[place] = int(rng.integers(256))
        elif kind == 1:
            del changed[place : place + int(rng.integers(1, 40))]
        elif kind == 2:
            changed[place:place] = changed[place : place + int(rng.integers(1, 200))]
        elif kind == 3:
            changed[place:place] = ODD[rng.integers(len(ODD))]
        elif rng.random() < 0.2:
            del changed[place:]
    return bytes(changed)


def survive(read: Callable[[], object]) -> int:
    """1 for a success, 0 for an error of ours; any other error fails the test."""
    try:
        read()
    except FinlabError as error:
        assert str(error) and "\n" not in str(error)
        return 0
    return 1


@counts(3000)
def test_layout_files(count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    texts = [path.read_bytes() for path in shipped_layouts().values()]
    path = tmp_path / "x.yaml"
    good = 0
    for i in range(count):
        path.write_bytes(mutated(rng, texts[i % len(texts)]))
        good += survive(lambda: load_layout(path))
    assert 0 < good < count


@counts(3000)
def test_graph_files(count: int, small: Bundle) -> None:
    rng = np.random.default_rng(1)
    good = 0
    for i in range(count):
        text = mutated(rng, small.files[GRAPH]).decode("utf-8", "replace")
        if i % 2:  # a forger mends the checksum
            try:
                document = json.loads(text)
                document["checksum"] = checksum_of(document)
                text = json.dumps(document)
            except (ValueError, TypeError, RecursionError):
                pass
        good += survive(lambda text=text: parse_graph(GraphText(text)))  # type: ignore[misc]
    assert 0 < good < count


@counts(3200)
def test_bundles(count: int, small: Bundle) -> None:
    rng = np.random.default_rng(2)
    good = 0
    names = sorted(small.files)
    for i in range(count):
        name = (WEIGHTS, CONFIG, ABOUT, COMPILED, names[i % len(names)])[i % 5]
        files = {**small.files, name: mutated(rng, small.files[name])}
        if i % 3 and name == WEIGHTS:  # a forger mends this checksum too
            config = json.loads(files[CONFIG])
            config["sha256"] = hashlib.sha256(files[WEIGHTS]).hexdigest()
            files[CONFIG] = json.dumps(config).encode()
            graph = json.loads(files[GRAPH])
            graph["checkpoint"]["sha256"] = config["sha256"]
            graph["checksum"] = checksum_of(graph)
            files[GRAPH] = json.dumps(graph).encode()
        if i % 8 and name != CHECKSUMS:
            rest = {key: content for key, content in files.items() if key != CHECKSUMS}
            files[CHECKSUMS] = checksums(rest)

        def run(files: dict[str, bytes] = files) -> None:
            parse_robot(files)

        good += survive(run)
    assert 0 < good < count


@counts(500)
def test_archives(count: int, small: Bundle, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    path, content = tmp_path / "x.zip", small.zip_bytes()
    good = 0
    for _ in range(count):
        path.write_bytes(mutated(rng, content))
        good += survive(lambda: load_robot(path))
    assert 0 < good < count


def _flipped(rng: np.random.Generator, content: bytes) -> bytes:
    """Compiled fins with some numbers changed at random, the header left as it is."""
    start = 8 + int.from_bytes(content[:8], "little")
    numbers = np.frombuffer(content[start:], np.float64).copy()
    for _ in range(rng.integers(1, 50)):
        odd = (0.0, -1.0, 1e8, numbers[rng.integers(len(numbers))], rng.normal())
        numbers[rng.integers(len(numbers))] = odd[rng.integers(len(odd))]
    return content[:start] + numbers.tobytes()


@counts(300)
def test_answers_of_what_was_forged(count: int, measured_bundle: Bundle, tmp_path: Path) -> None:
    """Compiled fins, tables and settings whose checksums fit: an answer within the limits that the plant
    judges, or an error of ours."""
    rng = np.random.default_rng(4)
    path = tmp_path / "x.zip"
    table = next(name for name in measured_bundle.files if name.startswith(TABLES))
    good = 0
    for i in range(count):
        name = (COMPILED, table, ABOUT)[i % 3]
        change = _flipped if name == COMPILED else mutated
        files = {**measured_bundle.files, name: change(rng, measured_bundle.files[name])}
        rest = {key: content for key, content in files.items() if key != CHECKSUMS}
        Bundle({**rest, CHECKSUMS: checksums(rest)}).write_zip(path)

        def answer() -> None:
            robot = load_robot(path)
            layout = robot.layout
            found = robot.allocate(WRENCH)
            assert (found.command >= layout.lower).all() and (found.command <= layout.upper).all()
            assert found.judged_by == "plant" and np.isfinite([found.err_norm, found.power]).all()

        good += survive(answer)
    assert 0 < good < count
