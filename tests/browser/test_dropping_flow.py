"""Files dropped on the page: opened as by the button, each for whom it is, or a sentence."""

import base64
from pathlib import Path
from typing import Any

import trimesh

from finlab.files.plain_values import yaml_text
from finlab.layout import FinModelSpec, layout_to_dict, load_layout
from finlab.physics import make_law
from finlab.physics.table_file import write_table

CARRIED = """files => {
  const carried = new DataTransfer();
  for (const [name, content] of files)
    carried.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], name));
  return carried;
}"""


def drop(page: Any, place: str, files: dict[str, bytes]) -> None:
    """Drag files over an element of the page, see what the page says to that, and let them go there."""
    coded = [[name, base64.b64encode(content).decode()] for name, content in files.items()]
    carried = page.page.evaluate_handle(CARRIED, coded)
    target, card = page.page.locator(place).first, page.page.locator(".fl-drop")
    target.dispatch_event("dragover", {"dataTransfer": carried})
    card.wait_for()
    target.dispatch_event("drop", {"dataTransfer": carried})
    card.wait_for(state="hidden")


def test_what_is_dropped_is_opened(page: Any, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    state = page.session.state
    drop(page, ".fl-status", {"notes.docx": b"Dear all"})
    page.until(
        lambda: any("'notes.docx' cannot be opened; expected a design" in text for text in page.notes())
    )
    grid = [[0.05, 0.3, 0.6], [0.1, 1.0, 2.1], [-3.0, -1.5, 0.0, 1.5]]
    write_table(tmp_path / "soft.csv", make_law(FinModelSpec("soft")), *grid)  # type: ignore[arg-type]
    table = (tmp_path / "soft.csv").read_bytes()
    drop(page, "canvas[data-engine]", {"cell.csv": table})
    page.until(lambda: any("no fin is selected" in text for text in page.notes()))
    assert page.session.state == state

    values = layout_to_dict(load_layout("ucat")) | {"name": "dropped"}
    values["fins"][0]["model"] = {"type": "table", "path": "tables/soft.csv"}
    drop(page, "canvas[data-engine]", {"robot.yaml": yaml_text(values).encode(), "soft.csv": table})
    page.until(lambda: page.session.state.layout.name == "dropped")
    assert page.session.state.layout.fins[0].model.type == "table"

    page.tab("Design")
    drop(page, ".fin-list [data-fin=back_left]", {"cell.csv": table})
    page.until(lambda: page.session.state.layout.fins[2].model.type == "table")
    assert page.session.selected == "back_left", "the fin on whose row it was dropped"

    hull = trimesh.creation.box((0.4, 0.3, 0.2)).export(file_type="stl")
    page.tab("Export")
    drop(page, "body", {"box.STL": hull})
    page.until(lambda: page.session.history.undo_name == "Import hull" and page.session.task == "Design")
    drop(page, "body", {"way.csv": b"t,x,y,z\n0,0,0,0\n10,1,0,0\n"})
    page.until(lambda: page.session.task == "Simulate" and page.view.swimming.own_path is not None)
    assert page.page.get_by_text("File uploaded").locator("visible=true").count() == 0, "its opener says it"
    assert page.problems == []
