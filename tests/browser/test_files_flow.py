"""Files open, saved, dropped, exported; those of strangers open nothing and run nothing."""

import base64
import zipfile
from pathlib import Path
from typing import Any

import trimesh

import finlab
from finlab.actuators.fin.force_table_file import write_table
from finlab.cli import main
from finlab.files import yaml_text
from finlab.layout import FinModelSpec, layout_to_dict, load_layout
from finlab.physics import make_law
from tests.fit.load_cell import columns_of, commands, measured, soft, write

DROPPED_FILES_SCRIPT = """files => {
  const carried = new DataTransfer();
  for (const [name, content] of files)
    carried.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], name));
  return carried;
}"""
"""Script: files as a drag from the desktop carries them."""
HOSTILE_TEXT = "<img src=x onerror=window.pwned=1><script>window.pwned=2"
"""A name that would run as a script where it is not escaped."""


def measured_robot(folder: Path) -> tuple[dict[str, Any], bytes]:
    """A robot whose first fin is a table, and that table."""
    grid = [[0.05, 0.3, 0.6], [0.1, 1.0, 2.1], [-3.0, -1.5, 0.0, 1.5]]
    write_table(folder / "soft.csv", make_law(FinModelSpec("soft")), *grid)  # type: ignore[arg-type]
    values = layout_to_dict(load_layout("ucat")) | {"name": "measured"}
    values["actuators"][0]["model"] = {"type": "table", "path": "tables/soft.csv"}
    return values, (folder / "soft.csv").read_bytes()


def drop(page: Any, place: str, files: dict[str, bytes]) -> None:
    """Drag files over an element of the page, see what the page says to that, and let them go
    there."""
    coded = [[name, base64.b64encode(content).decode()] for name, content in files.items()]
    carried = page.page.evaluate_handle(DROPPED_FILES_SCRIPT, coded)
    target = page.page.locator(place).first
    said = page.page.locator("html.fl-dropping")
    target.dispatch_event("dragover", {"dataTransfer": carried})
    said.wait_for()
    target.dispatch_event("drop", {"dataTransfer": carried})
    said.wait_for(state="detached")


def test_what_is_dropped_is_opened(page: Any, tmp_path: Path) -> None:
    state = page.session.state
    session = page.session
    drop(page, ".fl-status", {"notes.docx": b"Dear all"})
    page.until(lambda: any("'notes.docx' cannot be opened" in text for text in page.notes()))
    values, table = measured_robot(tmp_path)
    drop(page, "canvas[data-engine]", {"cell.csv": table})
    page.until(lambda: any("no actuator is selected" in text for text in page.notes()))
    assert session.state == state
    drop(page, "canvas[data-engine]", {"robot.yaml": yaml_text(values).encode(), "soft.csv": table})
    page.until(lambda: any("into one ZIP archive" in text for text in page.notes()))
    assert session.state == state
    page.tab("Design")
    drop(page, ".fin-list [data-fin=back_left]", {"cell.csv": table})
    page.until(lambda: session.state.layout.fins[2].model.type == "table")
    assert session.selected == "back_left", "the fin on whose row it was dropped"
    page.tab("Export")
    drop(page, "body", {"box.STL": trimesh.creation.box((0.4, 0.3, 0.2)).export(file_type="stl")})
    page.until(lambda: session.history.undo_name == "Import hull" and session.desk.task == "Design")
    assert page.problems == []


def test_files_are_saved_and_opened_or_refused(page: Any, tmp_path: Path) -> None:
    page.tab("Export")
    text = page.download("Save", tmp_path / "saved.yaml").read_text()
    (tmp_path / "changed.yaml").write_text(text.replace("front_right", "bow"))
    page.upload("Open", tmp_path / "changed.yaml")
    page.until(lambda: page.session.state.layout.names[0] == "bow")
    (tmp_path / "broken.yaml").write_text(text.replace("version: 2", "version: 99"))
    page.upload("Open", tmp_path / "broken.yaml")
    page.until(lambda: any("broken.yaml" in note and "version" in note for note in page.notes()))
    assert page.session.state.layout.names[0] == "bow", "nothing is lost"
    values, _ = measured_robot(tmp_path)
    with zipfile.ZipFile(tmp_path / "robot.zip", "w") as archive:
        archive.writestr("robot.yaml", yaml_text(values))
        archive.write(tmp_path / "soft.csv", "tables/soft.csv")
    page.upload("Open", tmp_path / "robot.zip")
    page.until(lambda: "measured" in page.text(".fl-robot") and "Exact" in page.text(".fl-status"))
    names = zipfile.ZipFile(page.download("Save", tmp_path / "home.zip")).namelist()
    assert names[0] == "measured.yaml" and names[1].startswith("tables/") and len(names) == 2


def test_a_strangers_layout_opens_no_file_and_runs_nothing(page: Any, tmp_path: Path) -> None:
    before = page.session.state
    values = layout_to_dict(load_layout("ucat")) | {
        "name": HOSTILE_TEXT,
        "description": HOSTILE_TEXT,
    }
    values["actuators"][0] |= {
        "name": HOSTILE_TEXT[:60],
        "model": {"type": "table", "path": "/etc/passwd"},
    }
    (tmp_path / "robot.yaml").write_text(yaml_text(values))
    page.upload("Open", tmp_path / "robot.yaml")
    page.until(lambda: any("'passwd', which did not come along" in note for note in page.notes()))
    assert page.session.state == before and "root:" not in "".join(page.notes())
    values["actuators"][0]["model"] = {"type": "drag"}
    (tmp_path / "robot.yaml").write_text(yaml_text(values))
    page.upload("Open", tmp_path / "robot.yaml")
    page.until(lambda: page.session.state.layout.name == HOSTILE_TEXT and not page.view.busy)
    page.until(lambda: HOSTILE_TEXT[:20] in page.text(".fl-robot"))
    page.key("n")
    for tab in ("Design", "Simulate", "Export", "Allocate"):
        page.tab(tab)
    page.catch_up()
    assert (
        page.page.evaluate("window.pwned") is None and page.page.locator("img[src=x]").count() == 0
    )


def test_what_is_exported(page: Any, tmp_path: Path) -> None:
    page.tab("Export")
    lines = page.page.locator("pre.command:visible")
    page.until(
        lambda: "finlab allocate ucat.yaml --wrench 1.2 0 0 0 0 0.25" in lines.all_inner_texts()
    )
    assert "finlab-runtime check ucat_bundle.zip" in lines.all_inner_texts()
    assert load_layout(page.download("Save the design", tmp_path / "ucat.yaml")).name == "ucat"
    bundle = page.download("Export the bundle (ZIP)", tmp_path / "page.zip")
    page.until(lambda: any("ucat_bundle.zip, among the downloads" in note for note in page.notes()))
    assert main(["export", "ucat", "-o", str(tmp_path / "ucat"), "--zip"]) == 0
    assert bundle.read_bytes() == (tmp_path / "ucat.zip").read_bytes()
    state = page.session.state
    assert finlab.Allocator.from_bundle(bundle).allocate(state.target).err_norm < 1e-3


def test_a_noisy_file_becomes_a_fin(page: Any, tmp_path: Path) -> None:
    command = commands(120)
    session = page.session
    cell = write(tmp_path / "cell.csv", columns_of(command, measured(soft(k=4.0, d=0.1), command)))
    page.tab("Design")
    page.key("n")
    before = session.state
    page.until(
        lambda: "drag" in page.page.locator(".fl:has-text('stiff blade')").first.inner_text()
    )
    page.upload("Fit from measurements (CSV)", cell)
    page.until(lambda: session.state.layout.fins[0].model.type == "table" and not page.view.busy)
    page.page.get_by_text("May be trusted within what was measured.").wait_for()
    page.page.get_by_text("table, fitted to 120 samples").wait_for()
    assert (
        page.view.shown_allocation.layout.fins[0].model.type == "table"
        and page.view.shown_allocation.err_norm < 1e-3
    )
    page.press("On all like it")
    page.until(lambda: [fin.model.type for fin in session.state.layout.fins] == ["table"] * 4)
    page.page.get_by_text("Exact by the model, expected within").first.wait_for()

    page.press("Share")
    page.until(lambda: any("share the ZIP" in note for note in page.notes()))

    page.download("Save", tmp_path / "robot.zip")
    page.press("Undo")
    page.press("Undo")
    page.until(lambda: session.state == before)
    page.upload("Open", tmp_path / "robot.zip")
    page.until(lambda: [fin.model.type for fin in session.state.layout.fins] == ["table"] * 4)


def test_a_wrong_file_is_told_where_and_changes_nothing(page: Any, tmp_path: Path) -> None:
    page.key("n")
    page.tab("Design")
    before = page.session.state
    (tmp_path / "cell.csv").write_text("A,f,phi,Fx,Fy,Fz\n0.3,1.0,0.0,0,oops,0\n")
    page.upload("Fit from measurements (CSV)", tmp_path / "cell.csv")
    sentence = "cell.csv: line 2, column Fy, holds 'oops', which is not a number"
    page.until(lambda: any(sentence in note for note in page.notes()))
    page.page.locator(".fl .missing", has_text=sentence).wait_for()
    with (tmp_path / "huge.csv").open("wb") as file:
        file.truncate(160_000_000)  # sparse: it takes no room
    page.upload("Fit from measurements (CSV)", tmp_path / "huge.csv")
    page.until(lambda: any("huge.csv: has 160,000,000 bytes" in note for note in page.notes()))
    assert page.session.state == before and not page.view.jobs.fitting.busy


def test_a_robot_is_taken_home_in_a_format_of_others(page: Any, tmp_path: Path) -> None:
    page.tab("Export")
    px4 = page.page.locator(".fl-home button", has_text="PX4")
    px4.wait_for()
    assert px4.is_disabled() and "has no thruster" in page.text("#home-px4")
    model = page.download("MJCF", tmp_path / "ucat.xml").read_text()
    assert model.startswith("<mujoco")
    page.view.do(lambda: page.session.open_layout(load_layout("bluerov2_heavy")))
    page.until(lambda: px4.is_enabled())
    parameters = page.download("PX4", tmp_path / "robot.params").read_text()
    assert "CA_ROTOR_COUNT\t8" in parameters
    assert "load_layout('bluerov2_heavy')" in page.text("[data-fl~=Python] pre.command")
    page.press("Copy as Python")
    page.page.locator("[data-fl~=Python] .copy[data-done]").wait_for()
    assert page.problems == []
