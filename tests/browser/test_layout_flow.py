"""Place a fin by gizmo and by numbers, mirror it, undo; open and save files."""

import zipfile
from pathlib import Path
from typing import Any

import pytest

from finlab.files.plain_values import yaml_text
from finlab.layout import FinModelSpec, layout_to_dict, load_layout
from finlab.physics import make_law
from finlab.physics.table_file import write_table


def test_gizmo_moves_a_fin(page: Any) -> None:
    page.tab("Design")
    page.key("n")
    page.until(lambda: page.session.selected == "front_right")
    page.look_from_above()
    start = page.session.state.layout.fins[0].position
    grip, further = page.pixel("/robot/fins/0", (0.168, 0, 0)), page.pixel("/robot/fins/0", (0.268, 0, 0))
    page.drag(grip, further)
    page.until(lambda: page.session.state.layout.fins[0].position != start)
    page.until(lambda: page.view.scenery.robot.dragged is None)
    page.until(lambda: not page.view.busy)
    end = page.session.state.layout.fins[0].position
    assert end[0] - start[0] == pytest.approx(0.1, abs=0.02)
    assert end[1:] == pytest.approx(start[1:], abs=1e-6)
    assert page.session.history.undo_name == "Move front_right"
    page.key("Control+z")
    page.until(lambda: page.session.state.layout.fins[0].position == start)
    page.until(lambda: page.pixel("/robot/fins/0", (0.168, 0, 0)) == pytest.approx(grip, abs=3))


def test_a_ghost_shows_where_a_held_fin_will_stick(page: Any) -> None:
    page.key("n")
    page.tab("Design")
    page.row("Stick to hull").first.click()
    page.until(lambda: page.session.display.stick)
    page.look_from_above()
    (x, y), (u, v) = page.pixel("/robot/fins/0", (0.168, 0, 0)), page.pixel("/robot/fins/0", (0.23, 0, 0))
    mouse = page.page.mouse
    mouse.move(x, y)
    page.page.wait_for_timeout(150)
    mouse.down()
    for k in range(1, 13):
        mouse.move(x + (u - x) * k / 12, y + (v - y) * k / 12)
        page.page.wait_for_timeout(30)
    page.visible("/robot/landing")
    mouse.up()
    page.visible("/robot/landing", False)
    page.until(lambda: page.session.history.undo_name == "Move front_right")
    stands = page.view.scenery.robot._fins[0].pose()[0]
    assert stands == pytest.approx(page.session.state.layout.fins[0].position, abs=1e-6)


def test_click_selects_and_numbers_move(page: Any) -> None:
    page.page.mouse.click(*page.pixel("/robot/fins/2/turn/shaft", (-0.02, 0, 0)))
    page.until(lambda: page.session.selected == "back_left")
    page.tab("Design")
    page.type("Position [m]", "-0.2", place=0)
    page.until(lambda: page.session.state.layout.fins[2].position[0] == -0.2)
    page.type("Shaft [°]", "90")
    page.until(lambda: abs(page.session.state.layout.fins[2].mounting_angle - 1.5708) < 1e-3)


def test_add_mirror_and_undo(page: Any) -> None:
    page.tab("Design")
    page.choose("Layout", "B")
    page.until(lambda: page.session.state.layout.name == "B")
    page.press("Add a fin")
    page.until(lambda: page.session.state.layout.n_fins == 5)
    page.type("Position [m]", "0.1", place=1)
    page.until(lambda: page.session.state.layout.fins[4].position[1] == 0.1)
    page.press("Mirror")
    page.until(lambda: page.session.state.layout.n_fins == 6)
    assert page.session.state.layout.fins[5].position[1] == -0.1
    page.node("/robot/fins/5/turn/blade")
    page.press("Undo")
    page.until(lambda: page.session.state.layout.n_fins == 5)
    page.press("Redo")
    page.until(lambda: page.session.state.layout.n_fins == 6)


def test_copies_stand_around_another_axis(page: Any) -> None:
    page.key("n")
    page.tab("Design")
    page.choose("Copies around", "x")
    page.until(lambda: page.row("Copies around").first.input_value().startswith("x"))
    page.press("4")
    page.until(lambda: page.session.state.layout.n_fins == 7)
    assert page.session.history.undo_name == "4 around x"
    page.node("/robot/fins/6/turn/blade")


def test_bad_number_is_refused_below_its_box(page: Any) -> None:
    page.key("n")
    page.tab("Design")
    before = page.session.state.layout
    page.type("Position [m]", "55", place=2)
    page.until(lambda: "z of front_right" in "".join(page.page.locator(".fl.note:visible").all_inner_texts()))
    assert page.session.state.layout == before


def test_page_picture_and_command_to_take_home(page: Any, tmp_path: Path) -> None:
    page.tab("Export")
    page.until(lambda: "finlab allocate ucat --wrench 1.2 0 0 0 0 0.25" in page.text("pre.command"))
    with page.page.expect_download() as download:
        page.press("3D view (HTML)")
    download.value.save_as(tmp_path / "robot.html")
    html = (tmp_path / "robot.html").read_text()
    assert "__VISER_EMBED_DATA__" in html and len(html) < 3_000_000
    with page.page.expect_download() as download:
        page.press("Picture (PNG)")
    download.value.save_as(tmp_path / "robot.png")
    assert (tmp_path / "robot.png").read_bytes().startswith(b"\x89PNG")


def test_save_open_and_a_bad_file(page: Any, tmp_path: Path) -> None:
    page.tab("Export")
    with page.page.expect_download() as download:
        page.press("Save")
    saved = tmp_path / "saved.yaml"
    download.value.save_as(saved)
    text = saved.read_text()
    changed = tmp_path / "changed.yaml"
    changed.write_text(text.replace("front_right", "bow"))
    with page.page.expect_file_chooser() as chooser:
        page.press("Open")
    chooser.value.set_files(changed)
    page.until(lambda: page.session.state.layout.names[0] == "bow")
    broken = tmp_path / "broken.yaml"
    broken.write_text(text.replace("version: 1", "version: 99"))
    with page.page.expect_file_chooser() as chooser:
        page.press("Open")
    chooser.value.set_files(broken)
    page.until(lambda: any("broken.yaml" in note and "version" in note for note in page.notes()))
    assert page.session.state.layout.names[0] == "bow", "nothing is lost"


EVIL = "<img src=x onerror=window.pwned=1><script>window.pwned=2"


def test_a_strangers_layout_opens_no_file_and_runs_nothing(page: Any, tmp_path: Path) -> None:
    before = page.session.state
    values = layout_to_dict(load_layout("ucat")) | {"name": EVIL, "description": EVIL}
    values["fins"][0] |= {"name": EVIL[:60], "model": {"type": "table", "path": "/etc/passwd"}}
    (tmp_path / "robot.yaml").write_text(yaml_text(values))
    page.tab("Export")
    page.upload("Open", tmp_path / "robot.yaml")
    page.until(lambda: any("'passwd', which did not come along" in note for note in page.notes()))
    assert page.session.state == before and "root:" not in "".join(page.notes())
    values["fins"][0]["model"] = {"type": "drag"}
    (tmp_path / "robot.yaml").write_text(yaml_text(values))
    page.upload("Open", tmp_path / "robot.yaml")
    page.until(lambda: page.session.state.layout.name == EVIL and not page.view.busy)
    page.until(lambda: EVIL[:20] in page.text(".fl-robot"))
    page.key("n")
    for tab in ("Design", "Reach", "Simulate", "Allocate"):
        page.tab(tab)
    page.catch_up()
    assert page.page.evaluate("window.pwned") is None and page.page.locator("img[src=x]").count() == 0


def test_a_layout_brings_its_table_along_and_takes_it_home(
    page: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    grid = [[0.05, 0.3, 0.6], [0.1, 1.0, 2.1], [-3.0, -1.5, 0.0, 1.5]]
    write_table(tmp_path / "soft.csv", make_law(FinModelSpec("soft")), *grid)  # type: ignore[arg-type]
    values = layout_to_dict(load_layout("ucat")) | {"name": "measured"}
    values["fins"][0]["model"] = {"type": "table", "path": "tables/soft.csv"}
    with zipfile.ZipFile(tmp_path / "robot.zip", "w") as archive:
        archive.writestr("robot.yaml", yaml_text(values))
        archive.write(tmp_path / "soft.csv", "tables/soft.csv")
    page.tab("Export")
    page.upload("Open", tmp_path / "robot.zip")
    page.until(lambda: page.session.state.layout.name == "measured" and not page.view.busy)
    page.until(lambda: "measured" in page.text(".fl-robot") and "Exact" in page.text(".fl-status"))
    with page.page.expect_download() as download:
        page.press("Save")
    download.value.save_as(tmp_path / "home.zip")
    names = zipfile.ZipFile(tmp_path / "home.zip").namelist()
    assert names[0] == "measured.yaml" and names[1].startswith("tables/") and len(names) == 2
