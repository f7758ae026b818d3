"""Layouts that a browser sends may name any path: no file of the server is opened for them."""

import io
import os
import stat
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.actuators.fin.force_table_file import write_table
from finlab.allocation import Allocator
from finlab.errors import DataError, FinlabError, LayoutError
from finlab.exchange import Exchange
from finlab.exchange.convert import WRITERS
from finlab.files import yaml_text
from finlab.layout import FinModelSpec, layout_to_dict, load_layout
from finlab.physics import make_law
from finlab.swim.design_files import Opened, Unanswered
from finlab.swim.hull import hull_of
from webapp.session import files

SECRET = "root:x:0:0"
"""Start of a file of the server that must not be shown."""
opened: list[str] = []
"""Every path that this process has opened since the list was emptied."""


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    """Audit hook of Python: keep the paths that are opened."""
    if event == "open" and isinstance(arguments[0], (str, bytes, os.PathLike)):
        opened.append(os.fsdecode(arguments[0]))


sys.addaudithook(_hear)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of caches for this test alone."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    yield tmp_path / "cache" / "finlab"


@pytest.fixture
def table(tmp_path: Path) -> bytes:
    """A force table that can be read."""
    grid = [[0.05, 0.3, 0.6], [0.1, 1.0, 2.1], [-3.0, -1.5, 0.0, 1.5]]
    write_table(tmp_path / "table.csv", make_law(FinModelSpec("soft")), *grid)  # type: ignore[arg-type]
    return (tmp_path / "table.csv").read_bytes()


def layout_file(table: str = "", mesh: str = "") -> bytes:
    """A layout file with a table of forces or a mesh at some path."""
    values = layout_to_dict(load_layout("ucat")) | {"name": "robot"}
    if table:
        values["actuators"][0]["model"] = {"type": "table", "path": table}
    values["body"] = {"hull": {"mesh": mesh}} if mesh else {}
    return yaml_text(values).encode()


def packed(parts: dict[str, bytes], link: str = "") -> bytes:
    """A zip archive, with a link to another file if one is given."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
        if link:
            entry = zipfile.ZipInfo("table.csv")
            entry.external_attr = (stat.S_IFLNK | 0o777) << 16
            archive.writestr(entry, link)
    return buffer.getvalue()


def secrets_of(tmp_path: Path, table: bytes) -> tuple[str, ...]:
    """Paths to something on this machine, each in another way."""
    place = tmp_path / "private"
    place.mkdir(exist_ok=True)
    (place / "table.csv").write_bytes(table)
    link = place / "link.csv"
    link.unlink(missing_ok=True)
    link.symlink_to(place / "table.csv")
    climbing = os.path.relpath(place / "table.csv")
    return (
        "/etc/passwd",
        "/dev/zero",
        "/dev/stdin",
        "/proc/self/environ",
        str(place / "table.csv"),
        str(link),
        climbing,
        f"{'../' * 20}{place / 'table.csv'}",
        f"tables/../{climbing}",
        "~/.ssh/id_rsa",
        "table.csv",
        "",
        "a\0b",
        "x" * 5000,
    )


def refusal_of(name: str, content: bytes) -> str:
    """What the app says when it refuses a file, with a list of paths begun anew."""
    opened.clear()
    with pytest.raises(FinlabError) as error:
        files.read_layout(name, content)
    return str(error.value)


def seen_of(tmp_path: Path) -> list[str]:
    """What was opened of this machine, beside Python's own files and what the upload was unpacked
    to."""
    places = ("private", "passwd", "zero", "stdin", "environ", "id_rsa")
    return [path for path in opened if any(place in path for place in places)]


def test_no_path_of_a_layout_is_opened(tmp_path: Path, table: bytes, cache: Path) -> None:
    for path in secrets_of(tmp_path, table):
        text = layout_file(path or "x.csv")
        for name, content in (("robot.yaml", text), ("robot.zip", packed({"robot.yaml": text}))):
            sentence = refusal_of(name, content)
            assert "did not come along" in sentence or "model" in sentence, sentence
            assert SECRET not in sentence and seen_of(tmp_path) == [], path
    assert not cache.exists()


def test_links_and_climbing_names_in_an_archive_are_data(tmp_path: Path, table: bytes) -> None:
    (path, *_) = secrets_of(tmp_path, table)
    text = layout_file("table.csv")
    sentence = refusal_of("robot.zip", packed({"robot.yaml": text}, link=path))
    assert "column A is missing" in sentence and seen_of(tmp_path) == []
    for name in ("../table.csv", "/table.csv", "a/../../table.csv", "..\\table.csv", "C:table.csv"):
        assert "holds" in refusal_of("robot.zip", packed({"robot.yaml": text, name: table}))
    assert not (tmp_path / "table.csv").is_symlink()


def test_no_mesh_of_the_server_is_opened(tmp_path: Path) -> None:
    place = tmp_path / "private"
    place.mkdir()
    (place / "hull.stl").write_bytes(cube_stl())
    for path in (str(place / "hull.stl"), os.path.relpath(place / "hull.stl"), "/dev/zero.stl"):
        text = layout_file(mesh=path)
        for name, content in (("robot.yaml", text), ("robot.zip", packed({"robot.yaml": text}))):
            opened.clear()
            found = files.read_layout(name, content)
            assert found.missing == (Path(path).name,) and found.layout.body is not None
            assert found.layout.body.hull is None and hull_of(found.layout).file is None
            assert seen_of(tmp_path) == []


def cube_stl() -> bytes:
    """A mesh file."""
    import trimesh

    return bytes(trimesh.creation.box((0.4, 0.2, 0.1)).export(file_type="stl"))


def test_what_comes_along_is_kept_and_goes_along(tmp_path: Path, table: bytes, cache: Path) -> None:
    text = layout_file("forces/soft.csv", "shapes/hull.stl")
    parts = {"a/robot.yaml": text, "a/forces/soft.csv": table, "a/shapes/hull.stl": cube_stl()}
    found = files.read_layout("robot.zip", packed(parts))
    assert found.missing == () and hull_of(found.layout).file is not None
    path = str(found.layout.fins[0].model.values()["path"])
    assert Path(path).parent == cache / "tables" and Path(path).read_bytes() == table
    name, content = files.layout_file(found.layout)
    assert name == "robot.zip" and str(tmp_path).encode() not in zipfile.ZipFile(
        io.BytesIO(content)
    ).read("robot.yaml")
    assert files.read_layout(name, content).layout == found.layout
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(tmp_path / "elsewhere")
    assert hull_of(load_layout(tmp_path / "elsewhere" / "robot.yaml")).file is not None


def test_a_bundle_names_only_what_is_in_it(tmp_path: Path, table: bytes) -> None:
    import json

    from finlab.bundle_files import CHECKSUM_FILE, ROBOT_FILE, checksums
    from finlab.deploy.bundle import make_bundle

    bundle = make_bundle(Allocator(load_layout("ucat"))).zip_bytes()
    with zipfile.ZipFile(io.BytesIO(bundle)) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    for path in secrets_of(tmp_path, table)[:9]:
        robot = json.loads(parts[ROBOT_FILE])
        robot["layout"]["actuators"][0]["model"] = {"type": "table", "path": path}
        forged = {**parts, ROBOT_FILE: json.dumps(robot).encode()}
        del forged[CHECKSUM_FILE]
        forged[CHECKSUM_FILE] = checksums(forged)
        assert "not in the bundle" in refusal_of("robot.zip", packed(forged))
        assert seen_of(tmp_path) == [], path


def test_a_mesh_that_names_other_files_reads_none(tmp_path: Path) -> None:
    lines = (
        "mtllib /etc/passwd,usemtl a,v 0 0 0,v 1 0 0,v 0 1 0,v 0 0 1,f 1 3 2,f 1 2 4,f 2 3 4,f 1 "
        "4 3,"
    )
    wavefront = lines.replace(",", "\n").encode()
    opened.clear()
    files.stored_hull("hull.obj", wavefront)
    assert seen_of(tmp_path) == []


@pytest.mark.parametrize(
    "content", [b"\xff\xfe", b"", b"[" * 100_000, b"a: &a [*a]", b"!!python/object:os.system x"]
)
def test_any_bytes_are_refused_in_a_sentence(content: bytes) -> None:
    for name in ("a.yaml", "a.json", "a.zip", "../../etc/passwd.yaml"):
        with pytest.raises((LayoutError, DataError)) as error:
            files.read_layout(name, content)
        assert "/etc" not in str(error.value).replace("passwd.yaml", "")


def test_descriptions_of_others_are_opened_and_what_they_lack_is_said() -> None:
    text = (Path(__file__).parents[1] / "exchange" / "bluerov2_heavy.urdf").read_bytes()
    opened = files.read_layout("bluerov2_heavy.urdf", text)
    known = load_layout("bluerov2_heavy")
    assert isinstance(opened, Opened)
    assert opened.layout.name == "bluerov2_heavy" and "power" in " ".join(map(str, opened.notes))
    assert np.allclose(opened.layout.position[:4], known.position[:4], atol=1e-9)
    rotors = WRITERS["px4"](known, Exchange(), ".params").encode()
    assert files.read_layout("rov.params", rotors).layout.n == 8
    model = WRITERS["mjcf"](known, Exchange(), ".xml").encode()
    assert files.read_layout("rov.xml", model).layout.names == known.names
    team = b'[[thrusters]]\nname = "bow"\npos_mm = [100, 0, 0]\nheading_pitch_deg = [0, 0]'
    asked = files.read_layout("rov.toml", team)
    assert isinstance(asked, Unanswered)
    assert [question.option for question in asked.questions] == ["frame", "missing_force"]
    answers = {question.option: question.default for question in asked.questions}
    answered = files.read_layout("rov.toml", team, answers)
    assert isinstance(answered, Opened) and answered.layout.position[0, 0] == 0.1
    with pytest.raises(FinlabError, match=r"rov\.xml: includes '/etc/passwd', which did not come"):
        files.read_layout("rov.xml", b'<mujoco><include file="/etc/passwd"/></mujoco>')
    for bad in (
        text.replace(b"<robot", b"<!DOCTYPE a []><robot", 1),
        b"<a/>",
        b"\xff\xfe",
        b"nothing",
    ):
        with pytest.raises(FinlabError, match=r"rov\.sdf"):
            files.read_layout("rov.sdf", bad)
