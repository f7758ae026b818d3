"""Designs in links: whole there and back, treated like any upload, refused when they are too large."""

import base64
import json
import zlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.files.plain_values import yaml_text
from finlab.layout import FinModelSpec, layout_to_dict, load_layout
from finlab.layout.load import MAX_BYTES
from finlab.physics import make_law
from finlab.physics.table_file import write_table
from tests.webapp.hands import move_fin
from tests.webapp.loops import ReadAtOnce
from webapp.session import Session
from webapp.session.companions import stored_table
from webapp.session.design_links import ARCHIVE, FRAGMENT, MAX_LINK, PLAIN, packed, unpacked
from webapp.session.files import stored_hull, table_folder
from webapp.tasks.designs import MOST, Designs


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def link_of(text: str, kind: str = PLAIN) -> str:
    return kind + base64.urlsafe_b64encode(zlib.compress(text.encode())).decode().rstrip("=")


@pytest.mark.parametrize("name", ["ucat", "octo", "mixed", "restricted"])
def test_a_design_comes_back_whole(name: str) -> None:
    layout = load_layout(shipped_layouts()[name])
    text = packed(layout)
    assert unpacked(text).layout == layout and len(text) < MAX_LINK
    assert text.replace("-", "a").replace("_", "a").isalnum(), "nothing that an address would have to escape"


def test_a_small_hull_and_table_travel_and_large_ones_are_refused(tmp_path: Path) -> None:
    session = Session(load_layout("pair"))
    session.import_hull(
        stored_hull("hull.stl", trimesh.creation.box((0.4, 0.3, 0.2)).export(file_type="stl"), "m")
    )
    opened = unpacked(packed(session.state.layout))
    assert opened.layout.body is not None and opened.layout.body.hull is not None
    assert opened.layout.body.hull.mesh is not None and opened.missing == ()

    rough = trimesh.creation.icosphere(subdivisions=4, radius=0.2)
    rough.vertices *= 1 + 0.05 * np.random.default_rng(0).random((len(rough.vertices), 1))
    session.import_hull(stored_hull("hull.stl", rough.export(file_type="stl"), "m"))
    with pytest.raises(FinlabError, match=r"with its files needs [\d,]+ characters, .* share the ZIP"):
        packed(session.state.layout)


WHOLE = packed(load_layout("ucat"))


@pytest.mark.parametrize(
    "text", ["", "y", "y!!!", "q" + "A" * 20, "yAAAA", ARCHIVE + "AAAA", "y" + "é" * 8, WHOLE[:-9]]
)
def test_what_is_no_design_is_refused_with_a_sentence(text: str) -> None:
    with pytest.raises(FinlabError) as told:
        unpacked(text)
    assert len(str(told.value)) < 300


def test_a_bomb_is_not_unpacked() -> None:
    bomb = link_of(" " * (200 * MAX_BYTES))
    assert len(bomb) < 50 * MAX_LINK
    with pytest.raises(FinlabError, match="is larger than"):
        unpacked(bomb)


@pytest.mark.parametrize("path", ["/etc/passwd", "../../etc/passwd", "/dev/zero", "forces.csv"])
def test_a_link_opens_no_file_of_the_server(path: str) -> None:
    values = layout_to_dict(load_layout("ucat"))
    values["fins"][0]["model"] = {"type": "table", "path": path}
    with pytest.raises(FinlabError, match="did not come along"):
        unpacked(link_of(yaml_text(values)))


class Browser:
    """What a page keeps and is sent."""

    def __init__(self) -> None:
        self.kept: dict[str, str] = {}
        self.sent: list[str] = []
        self.heard: dict[str, Any] = {}


def designs_of(session: Session, browser: Browser) -> Designs:
    store = SimpleNamespace(set_item=browser.kept.__setitem__)
    context: Any = SimpleNamespace(
        session=session,
        client=SimpleNamespace(local_storage=store, gui=None),
        notify=lambda *_: None,
        reading=ReadAtOnce(lambda act: act()),
    )
    exports: Any = SimpleNamespace(download=lambda name, _: browser.sent.append(name))
    hear = browser.heard.__setitem__
    editables: Any = SimpleNamespace(on=hear, on_press=hear)
    return Designs(context, exports, editables)


def test_a_new_design_is_whole_and_can_be_taken_back() -> None:
    session = Session(load_layout("ucat"))
    session.new_layout()
    layout = session.state.layout
    assert layout.n_fins == 1 and layout.body is not None and session.selected == "left"
    session.mirror_fin()
    assert session.state.layout.names == ("left", "right")
    session.undo()
    session.undo()
    assert session.state.layout.name == "ucat"
    session.duplicate_layout()
    assert session.state.layout.name == "ucat copy" and session.state.layout.fins == load_layout("ucat").fins


def test_designs_that_made_room_are_kept_newest_first_and_opened_again() -> None:
    session, browser = Session(load_layout("ucat")), Browser()
    designs = designs_of(session, browser)
    for k in range(MOST + 2):
        session.new_layout()
        session.rename_robot(f"robot {k}")
        move_fin(session, "left", (0.01 * k, 0.2, 0.0))
        designs.note()
    assert [one.name for one in designs.recent] == [f"robot {k}" for k in range(MOST, 0, -1)]
    again = designs_of(session, browser)
    browser.heard["designs-kept"]("", browser.kept["finlab-designs"])
    assert again.recent == designs.recent
    again.open_recent("2")
    assert session.state.layout.name == "robot 6" and session.state.layout.fins[0].position[0] == 0.06
    with pytest.raises(FinlabError, match="not kept any more"):
        again.open_recent("99")


def test_saving_under_another_name_renames_and_keeps() -> None:
    session, browser = Session(load_layout("ucat")), Browser()
    designs = designs_of(session, browser)
    designs.save_as("My turtle")
    assert browser.sent == ["My_turtle.yaml"] and session.saved == session.state.layout
    assert session.state.layout.name == "My turtle" and designs.recent[0].name == "My turtle"
    with pytest.raises(FinlabError):
        designs.save_as("")
    assert browser.sent == ["My_turtle.yaml"]


@pytest.mark.parametrize("kept", ["", "{}", '[1, [], [1, 2, 3, 4], ["a", 1, "b", "c"]]', "[" * 5000])
def test_a_browsers_storage_may_hold_anything(kept: str) -> None:
    browser = Browser()
    designs = designs_of(Session(load_layout("ucat")), browser)
    browser.heard["designs-kept"]("", kept)
    assert designs.recent == []
    browser.heard["designs-kept"]("", json.dumps([["x", 4, 0, "yrubbish"]]))
    with pytest.raises(FinlabError):
        designs.open_recent("0")


def test_a_measured_fin_travels_with_its_table(tmp_path: Path) -> None:
    path = tmp_path / "fin.csv"
    turn = np.linspace(-np.pi, np.pi, 9)
    write_table(path, make_law(FinModelSpec("drag")), np.linspace(0, 0.6, 3), np.linspace(0, 2, 3), turn)
    session = Session(load_layout("pair"))
    session.set_model([session.state.layout.names[0]], stored_table(path.read_bytes(), table_folder()))
    opened = unpacked(packed(session.state.layout, 60_000))
    assert opened.layout.fins[0].model == session.state.layout.fins[0].model
    assert FRAGMENT == "design="
