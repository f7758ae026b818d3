"""Damaged and hostile files of every kind: each is read, or refused in one sentence."""

import csv
import hashlib
import io
import json
import os
import re
import resource
import time
import traceback
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import trimesh

from finlab.actuators.fin.table_law import read_table
from finlab.allocation import Allocator
from finlab.bundle_files import CHECKSUM_FILE, ROBOT_FILE, checksums
from finlab.deploy.bundle import make_bundle
from finlab.deploy.deployed_robot import load_robot
from finlab.errors import FinlabError
from finlab.exchange import Exchange, convert, read_any
from finlab.fit.measurements import read_measurements
from finlab.layout import FinModelSpec, load_layout, save_layout
from finlab.physics import make_law, write_table
from finlab.research.networks.checkpoint import read_checkpoint
from finlab.swim.hull import Surface
from finlab.swim.identification.swim import read_swim
from finlab.swim.simulation import load_log
from finlab.swim.simulation.log import Tick, log_of_ticks
from finlab.swim.simulation.task import make_trajectory
from tests.fit.load_cell import columns_of, commands, measured, soft, write
from tests.swim.identification.swims import write_csv as write_swim
from webapp.session.files import packed as design
from webapp.session.files import read_layout, unpacked

ROOT = Path(__file__).parents[2]
PAIR = load_layout("pair")
"""The robot of the logs: two fins."""
INSERTED_BYTES = [b"\xff", b"\0", b"9" * 30, b"\n- ", b"&a *a", b"", b"\n", b" ", b"\r"]
"""What is put into a file, or in place of a part of it."""
INSERTED_BYTES += b"1e999 NaN -1 0 1e-300 1e300 1e6 1.5 65536 [ { \" ' null , - # <".split()
NUMBER = re.compile(rb"-?\d+(\.\d+)?")
"""A number in a file, in place of which others are written."""


def changed(rng: np.random.Generator, content: bytes) -> bytes:
    """Content with some bytes or numbers changed, cut, doubled, or something odd put in."""
    numbers = [match.span() for match in NUMBER.finditer(content[:20_000])]
    content = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        place = int(rng.integers(0, len(content) + 1))
        kind = rng.integers(6)
        if kind == 0 and place < len(content):
            content[place] = int(rng.integers(256))
        elif kind == 1:
            del content[place : place + int(rng.integers(1, 40))]
        elif kind == 2:
            content[place:place] = content[place : place + int(rng.integers(1, 200))]
        elif kind == 3:
            content[place:place] = INSERTED_BYTES[rng.integers(len(INSERTED_BYTES))]
        elif kind == 4 and numbers:
            begin, end = numbers[rng.integers(len(numbers))]
            content[begin:end] = INSERTED_BYTES[rng.integers(len(INSERTED_BYTES))]
        elif rng.random() < 0.2:
            del content[place:]
    return bytes(content)


def repacked(rng: np.random.Generator, content: bytes) -> bytes:
    """A zip archive, itself or one of its files damaged."""
    if rng.random() < 0.4:
        return changed(rng, content)
    parts = parts_of(content)
    name = sorted(parts)[rng.integers(len(parts))]
    parts[name] = changed(rng, parts[name])
    return packed(forged(parts) if rng.random() < 0.8 else parts)


def forged(parts: dict[str, bytes]) -> dict[str, bytes]:
    """The files of a bundle with checksums that fit again; other files as they are."""
    if ROBOT_FILE in parts:
        rest = {key: content for key, content in parts.items() if key != CHECKSUM_FILE}
        return {**rest, CHECKSUM_FILE: checksums(rest)}
    return parts


def parts_of(archive: bytes) -> dict[str, bytes]:
    """Files of a zip archive by their names."""
    with zipfile.ZipFile(io.BytesIO(archive)) as file:
        return {name: file.read(name) for name in file.namelist()}


def packed(parts: dict[str, bytes]) -> bytes:
    """A zip archive of files by their names."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in parts.items():
            file.writestr(name, content)
    return buffer.getvalue()


class Kind(NamedTuple):
    """A kind of file."""

    name: str
    content: bytes
    read: Callable[[Path], object]
    damage: Callable[[np.random.Generator, bytes], bytes] = changed


def swim_log(path: Path) -> Path:
    """A log of a swim of two fins, written to a path."""
    rng = np.random.default_rng(0)
    sizes = {"position": 3, "quaternion": 4, "motion": 6, "flow": 3, "measured": 12, "reference": 3}
    sizes |= {name: 6 for name in ("asked", "allocated", "delivered")}
    triples = ("command", "fin_motion", "force")

    def value(name: str, k: int) -> object:
        if name in ("time", "reference_surge", "solve_ms"):
            return 0.1 * k
        if name in sizes:
            return rng.random(sizes[name])
        return rng.random((2, 3)) if name in triples else rng.random(2)

    ticks = [Tick(**{name: value(name, k) for name in Tick._fields}) for k in range(320)]  # type: ignore[arg-type]
    about = dict.fromkeys(("method", "controller", "task", "water"), "x")
    log_of_ticks(ticks, layout="pair", names=PAIR.names, seed=0, **about).save(path)
    return path


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory, untrained_mdn: Path) -> list[Kind]:
    """A whole file of every kind that is read, and how it is read."""
    place = tmp_path_factory.mktemp("whole")
    os.environ["XDG_CACHE_HOME"] = str(tmp_path_factory.mktemp("cache"))
    grid = np.linspace(0.05, 0.6, 4), np.linspace(0.1, 2.1, 4), np.linspace(-np.pi, np.pi, 7)
    write_table(place / "fin.csv", make_law(FinModelSpec("soft")), *grid)
    table = FinModelSpec("table", (("path", str(place / "fin.csv")),))
    layout = load_layout("A").replace_actuator("front_right", model=table)
    save_layout(layout, place / "a.json")
    forms = {"robot.urdf": "urdf", "robot.sdf": "sdf", "rov.params": "px4", "rov.cpp": "ardusub"}
    forms |= {"factors.csv": "ardusub", "matrix.csv": "matrix", "matrix.yaml": "matrix"}
    for name, form in forms.items():
        convert("bluerov2_heavy", place / name, form, Exchange())
    rig = commands(60)
    write(place / "rig.csv", columns_of(rig, measured(soft(), rig)))
    rng = np.random.default_rng(1)
    write_swim(
        place / "swim.csv",
        PAIR,
        np.full((330, 2, 3), 0.5),
        rng.random((330, 12)).cumsum(axis=0) / 99,
    )
    with (place / "path.csv").open("w", newline="") as file:
        rows = [[0.1 * k, 0.1 * k, np.sin(k), -1.0] for k in range(60)]
        csv.writer(file).writerows([["t", "x", "y", "z"], *rows])
    bundle = make_bundle(Allocator(layout))
    box = trimesh.creation.icosphere(subdivisions=2, radius=0.2)
    names = [path.relative_to(untrained_mdn).as_posix() for path in untrained_mdn.iterdir()]
    checkpoint = packed({name: (untrained_mdn / name).read_bytes() for name in names})

    def from_parts(path: Path) -> object:
        folder = path.with_suffix("")
        folder.mkdir(exist_ok=True)
        for name, content in parts_of(path.read_bytes()).items():
            (folder / name).write_bytes(content)
        return read_checkpoint(folder)

    def signed(rng: np.random.Generator, content: bytes) -> bytes:
        parts = parts_of(content)
        name = ("config.json", "model.safetensors")[rng.integers(2)]
        parts[name] = changed(rng, parts[name])
        if name == "model.safetensors" and rng.random() < 0.8:
            config = json.loads(parts["config.json"])
            config["sha256"] = hashlib.sha256(parts[name]).hexdigest()
            parts["config.json"] = json.dumps(config).encode()
        return packed(parts)

    def link(damaged: Path) -> object:
        return unpacked(damaged.read_bytes().decode("latin-1"))

    def upload(damaged: Path) -> object:
        return read_layout(damaged.name, damaged.read_bytes())

    def mesh(damaged: Path) -> object:
        return Surface.of_file.__wrapped__(str(damaged), 1.0, (0.0, 0.0, 0.0))

    def export(kind: str) -> bytes:
        found = box.export(file_type=kind)
        return found if isinstance(found, bytes) else found.encode()

    yaml = (ROOT / "layouts/ucat.yaml").read_bytes()
    links = {name: design(robot, 60_000).encode() for name, robot in (("y", PAIR), ("t", layout))}
    fin_table = (place / "fin.csv").read_bytes()
    travelling = packed({"a.yaml": yaml, "tables/fin.csv": fin_table, "h.stl": export("stl")})
    shapes = {"binary.stl": "stl", "ascii.stl": "stl_ascii"} | {
        f"hull.{k}": k for k in ("obj", "ply", "glb")
    }
    return [
        Kind("layout.yaml", yaml, load_layout),
        Kind("layout.json", (place / "a.json").read_bytes(), load_layout),
        Kind("bundle.zip", bundle.zip_bytes(), load_robot, repacked),
        Kind("checkpoint.bin", checkpoint, from_parts, signed),
        *(
            Kind(name, (place / name).read_bytes(), lambda p: read_any(str(p), Exchange()))
            for name in forms
        ),
        Kind("table.csv", fin_table, read_table),
        Kind("rig.csv", (place / "rig.csv").read_bytes(), lambda path: read_measurements([path])),
        Kind("swim.csv", (place / "swim.csv").read_bytes(), lambda path: read_swim(path, PAIR)),
        Kind("log.npz", swim_log(place / "log.npz").read_bytes(), load_log, repacked),
        Kind(
            "swim.npz",
            (place / "log.npz").read_bytes(),
            lambda path: read_swim(path, PAIR),
            repacked,
        ),
        Kind("path.csv", (place / "path.csv").read_bytes(), make_trajectory),
        *(Kind(name, export(kind), mesh) for name, kind in shapes.items()),
        Kind("upload.zip", travelling, upload, repacked),
        Kind("plain.link", links["y"], link),
        Kind("tables.link", links["t"], link),
    ]


def wrong_in(kind: Kind, count: int, folder: Path) -> str:
    """What went wrong with damaged files of a kind, and how many there were."""
    rng = np.random.default_rng([count, *kind.name.encode()])
    path = folder / kind.name
    path.write_bytes(kind.content)
    kind.read(path)
    said: dict[str, int] = {}
    for k in range(count):
        path.write_bytes(kind.damage(rng, kind.content))
        start = time.thread_time()
        try:
            kind.read(path)
        except FinlabError as error:
            if not str(error) or "\n" in str(error) or len(str(error)) > 700:
                said[f"{kind.name}: no sentence: {str(error)[:200]}"] = k
        except BaseException as error:
            at = traceback.extract_tb(error.__traceback__)[-1]
            said[f"{kind.name}: {error!r:.80} at {at.filename}:{at.lineno}"] = k
        if time.thread_time() - start > 3.0:
            said[f"{kind.name}: takes {time.thread_time() - start:.1f} s"] = k
    return "\n".join(f"{text} (number {k})" for text, k in said.items())


@pytest.mark.parametrize("count", [8, pytest.param(2000, marks=pytest.mark.exhaustive)])
@pytest.mark.filterwarnings("ignore")
def test_damaged_files_are_read_or_refused(kinds: list[Kind], count: int, tmp_path: Path) -> None:
    wrong = [wrong_in(kind, count, tmp_path) for kind in kinds]
    assert not any(wrong), "\n".join(filter(None, wrong))


def test_what_is_no_file_is_refused_at_once(kinds: list[Kind], tmp_path: Path) -> None:
    """Pipes, devices, folders, and names that cannot be: nobody waits, and nothing fills the
    memory."""
    readers = {kind.read for kind in kinds if "link" not in kind.name and "upload" not in kind.name}
    os.mkfifo(tmp_path / "pipe")
    for kind in kinds:
        if kind.read not in readers or kind.name == "checkpoint.bin":
            continue
        suffix = Path(kind.name).suffix
        for target in ("/dev/zero", tmp_path / "pipe", "/dev/null", tmp_path, tmp_path / "nothing"):
            path = tmp_path / f"link{suffix}"
            path.symlink_to(target)
            with pytest.raises(FinlabError):
                kind.read(path)
            path.unlink()
        for name in ("x" * 300 + suffix, "a\0b" + suffix, ""):
            with pytest.raises(FinlabError):
                kind.read(Path(name))


def test_arrays_do_not_unpack_beyond_their_cap(kinds: list[Kind], tmp_path: Path) -> None:
    kind = next(kind for kind in kinds if kind.name == "log.npz")
    parts = parts_of(kind.content)
    header = parts["time.npy"][:128]
    huge = header.replace(b"(320,)", b"(26000000,)")[:128] + bytes(208_000_000)
    path = tmp_path / "log.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for part, content in {**parts, "time.npy": huge}.items():
            file.writestr(part, content)
    del huge
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(FinlabError, match="time.npy in it is larger than"):
        kind.read(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 150_000, "kB"


def test_a_large_force_table_is_read_in_time(tmp_path: Path) -> None:
    grid = np.meshgrid(
        np.linspace(0, 1.2, 69), np.linspace(0, 9, 70), np.linspace(-3, 3, 70), indexing="ij"
    )
    rows = np.stack([axis.ravel() for axis in grid] * 2, axis=-1) + 0.1234567890123
    np.savetxt(
        tmp_path / "t.csv", rows, fmt="%.9f", delimiter=",", header="A,f,phi,Fx,Fy,Fz", comments=""
    )
    assert (tmp_path / "t.csv").stat().st_size > 23_000_000
    start = time.thread_time()
    read_table(tmp_path / "t.csv")
    assert time.thread_time() - start < 3.0
