"""Designs in links: whole there and back, treated like any upload, refused when they are too
large."""

import base64
import re
import zlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh

from finlab.actuators.fin.force_table_file import write_table
from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.files import yaml_text
from finlab.layout import FinModelSpec, layout_to_dict, load_layout
from finlab.layout.load import MAX_BYTES
from finlab.physics import make_law
from finlab.swim.design_files import Opened, stored_table
from tests.webapp.stand_in import AtOnce
from webapp.session import Session, files
from webapp.session.looking import TWO_ROBOTS
from webapp.tasks.designs import Designs
from webapp.tasks.solver import Solver


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of caches for this test alone."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def link_of(text: str, kind: str = files.PLAIN) -> str:
    """A text as the end of a link."""
    return kind + base64.urlsafe_b64encode(zlib.compress(text.encode())).decode().rstrip("=")


@pytest.mark.parametrize("name", ["ucat", "octo", "mixed", "restricted"])
def test_a_design_comes_back_whole(name: str) -> None:
    layout = load_layout(shipped_layouts()[name])
    text = files.packed(layout)
    assert files.unpacked(text).layout == layout and len(text) < files.MAX_LINK
    assert text.replace("-", "a").replace("_", "a").isalnum(), (
        "nothing that an address would have to escape"
    )


def test_a_small_hull_and_table_travel_and_large_ones_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "fin.csv"
    turn = np.linspace(-np.pi, np.pi, 9)
    write_table(
        path, make_law(FinModelSpec("drag")), np.linspace(0, 0.6, 3), np.linspace(0, 2, 3), turn
    )
    model = stored_table(path.read_bytes(), files.table_folder())
    session = Session(load_layout("pair"))
    session.set_model([session.state.layout.names[0]], model=model)
    session.import_hull(
        files.stored_hull("hull.stl", trimesh.creation.box((0.4, 0.3, 0.2)).export(file_type="stl"))
    )
    opened = files.unpacked(files.packed(session.state.layout, 60_000))
    assert opened.layout.body is not None and opened.layout.body.hull is not None
    assert opened.layout.body.hull.mesh is not None and opened.missing == ()
    assert opened.layout.fins[0].model == model

    rough = trimesh.creation.icosphere(subdivisions=4, radius=0.2)
    rough.vertices *= 1 + 0.05 * np.random.default_rng(0).random((len(rough.vertices), 1))
    session.import_hull(files.stored_hull("hull.stl", rough.export(file_type="stl")))
    with pytest.raises(
        FinlabError, match=r"with its files needs [\d,]+ characters, .* share the ZIP"
    ):
        files.packed(session.state.layout)


GOOD_LINK = files.packed(load_layout("ucat"))
"""The end of a link that opens."""


@pytest.mark.parametrize(
    "text",
    [
        "",
        "y",
        "y!!!",
        "q" + "A" * 20,
        "yAAAA",
        files.ARCHIVE + "AAAA",
        "y" + "é" * 8,
        GOOD_LINK[:-9],
    ],
)
def test_what_is_no_design_is_refused_with_a_sentence(text: str) -> None:
    with pytest.raises(FinlabError) as told:
        files.unpacked(text)
    assert len(str(told.value)) < 300


def test_a_bomb_is_not_unpacked() -> None:
    bomb = link_of(" " * (200 * MAX_BYTES))
    assert len(bomb) < 50 * files.MAX_LINK
    with pytest.raises(FinlabError, match="is larger than"):
        files.unpacked(bomb)


@pytest.mark.parametrize("path", ["/etc/passwd", "../../etc/passwd", "/dev/zero", "forces.csv"])
def test_a_link_opens_no_file_of_the_server(path: str) -> None:
    values = layout_to_dict(load_layout("ucat"))
    values["actuators"][0]["model"] = {"type": "table", "path": path}
    with pytest.raises(FinlabError, match="did not come along"):
        files.unpacked(link_of(yaml_text(values)))


class Browser:
    """What a page is sent."""

    def __init__(self) -> None:
        self.sent: list[str] = []
        self.notes: list[str] = []
        self.saved: list[str] = []
        """Notes on what was saved."""


def designs_of(session: Session, browser: Browser) -> Designs:
    """The designs of a page, whose notes and downloads a stand-in keeps."""

    def notify(title: str, text: str, calm: bool = False) -> None:
        notes = browser.saved if title == "Saved" else browser.notes
        notes.append(text)

    def send(name: str, *_: object, **__: object) -> None:
        browser.sent.append(name)

    client: Any = SimpleNamespace(gui=None, send_file_download=send)
    return Designs(client, session, Solver(), AtOnce(), notify)


def test_a_new_design_is_whole_and_can_be_taken_back() -> None:
    session = Session(load_layout("ucat"))
    session.new_layout("fin")
    layout = session.state.layout
    assert layout.n_fins == 1 and layout.body is not None and session.selected == "left"
    session.mirror()
    assert session.state.layout.names == ("left", "right")
    session.undo()
    session.undo()
    assert session.state.layout.name == "ucat"


def test_saving_sends_the_design_and_notes_it() -> None:
    session = Session(load_layout("ucat"))
    browser = Browser()
    session.rename_robot("My turtle")
    designs_of(session, browser).save()
    assert browser.sent == ["My_turtle.yaml"] and session.saved == session.state.layout


def test_mirror_pairs_travel_in_files_and_links() -> None:
    mine = Session(load_layout("hexa"))
    mine.new_layout("thruster")
    mine.mirror()
    sent = mine.state.layout
    assert sent.mirror_pairs == (("left", "right"),)
    by_link = files.unpacked(files.packed(sent)).layout
    by_file = files.read_layout(*files.layout_file(sent))
    assert isinstance(by_file, Opened)
    for layout in (by_link, by_file.layout):
        assert layout == sent
        theirs = Session(load_layout("ucat"))
        theirs.open_layout(layout)
        theirs.end_drag("left", (0.1, 0.2, 0.0))
        assert theirs.state.layout.actuator("right").position == (0.1, -0.2, 0.0)
        theirs.undo()
        assert theirs.state.layout.mirror_pairs == sent.mirror_pairs


def test_a_link_carries_the_wrench_and_says_that_it_is_a_copy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mine = Session(load_layout("octo"))
    theirs = Session(load_layout("ucat"))
    browser = Browser()
    mine.set_target(4, -1.0 / 3.0)
    scripts: list[str] = []
    monkeypatch.setattr("webapp.tasks.designs.run_script", lambda _, script: scripts.append(script))
    designs_of(mine, browser).share()
    fragment = re.findall(rf'"({files.FRAGMENT}[^"]*)"', scripts[0])[0]
    assert files.FRAGMENT == "design="
    there = designs_of(theirs, browser)
    there.open_link(fragment)
    assert theirs.state.layout == mine.state.layout
    assert theirs.state.target == pytest.approx(mine.state.target, rel=1e-5)
    assert "is a copy" in browser.notes[0]
    state = theirs.state
    for wrench in ("1,2", "a,b,c,d,e,f", "nan,0,0,0,0,0", "1e13,0,0,0,0,0"):
        with pytest.raises(FinlabError, match="expected"):
            there.open_link(f"{fragment.partition('&')[0]}&wrench={wrench}")
        assert theirs.state.target == state.target


def test_a_link_of_two_shows_both_and_says_what_does_not_travel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mine = Session(load_layout("octo"))
    theirs = Session(load_layout("ucat"))
    browser = Browser()
    scripts: list[str] = []
    monkeypatch.setattr("webapp.tasks.designs.run_script", lambda _, script: scripts.append(script))
    designs = designs_of(mine, browser)
    with pytest.raises(FinlabError, match="open it first"):
        designs.share_pair()
    mine.set_target(2, -1.25)
    mine.toggle_loss(mine.state.layout.names[0])
    mine.two_robots.choose("right", "Shipped: bluerov2")
    mine.show_drawer(TWO_ROBOTS)
    designs.share_pair()
    assert "What is damaged does not travel" in scripts[0]
    fragment = re.findall(rf'"({files.FRAGMENT}[^"]*)"', scripts[0])[0]
    there = designs_of(theirs, browser)
    there.open_link(fragment)
    pair = theirs.two_robots.pair
    assert pair is not None and pair.left.is_this
    layouts = [standing.state.layout for standing in pair.both]
    assert layouts == [load_layout("octo"), load_layout("bluerov2")]
    assert theirs.state.target == mine.state.target
    assert theirs.undo() == "Open octo"
    state = theirs.state
    for broken in ("", "y", GOOD_LINK[:-9]):
        with pytest.raises(FinlabError, match="no whole design|no design"):
            there.open_link(f"{fragment.partition('&beside')[0]}&beside={broken or '?'}")
        assert theirs.state == state


def test_a_link_or_a_file_is_put_beside_this_robot() -> None:
    session = Session(load_layout("ucat"))
    designs = designs_of(session, Browser())
    state = session.state
    address = f"http://127.0.0.1:8080/?shared#{files.FRAGMENT}{GOOD_LINK}{files.WRENCH}1,0,0,0,0,0"
    designs.open_link_beside(f"  {address} ")
    designs.open_beside("octo.yaml", yaml_text(layout_to_dict(load_layout("octo"))).encode())
    assert session.state == state, "this robot and its wrench stay"
    pair = session.two_robots.pair
    assert pair is not None and pair.right.title == "File: octo.yaml"
    assert [source.title for source in session.two_robots.guests] == [
        "Link: ucat",
        "File: octo.yaml",
    ]
    with pytest.raises(FinlabError, match="no whole design"):
        designs.open_link_beside("https://example.org/")
