"""Design a robot: linked pairs, hulls from files, limits with failures, a better layout, other methods."""

import time
from pathlib import Path
from typing import Any

import pytest
import trimesh

from finlab.analysis import Improvement, optimize_layout
from webapp.session.state import COMPARED
from webapp.tasks import improving


def test_linked_pair_follows_the_gizmo(page: Any) -> None:
    page.tab("Design")
    page.key("n")
    page.until(lambda: page.session.selected == "front_right")
    page.tab("Design")
    page.press("Mirror")
    page.until(lambda: page.session.state.links == (("front_right", "front_left"),))
    page.until(lambda: page.session.selected == "front_left")
    page.look_from_above()
    grip, further = page.pixel("/robot/fins/1", (0.168, 0, 0)), page.pixel("/robot/fins/1", (0.228, 0, 0))
    before = page.session.state.layout
    page.drag(grip, further)
    page.until(lambda: page.session.state.layout != before and page.view.scenery.robot.dragged is None)
    page.until(lambda: not page.view.busy)
    right, left = page.session.state.layout.fins[:2]
    assert left.position[0] == pytest.approx(before.fins[1].position[0] + 0.06, abs=0.02)
    assert right.position == pytest.approx((left.position[0], -left.position[1], left.position[2]))
    page.visible("/robot/ghost")
    page.press("Undo")
    page.until(lambda: page.session.state.layout == before)


def test_hull_from_a_file_and_by_numbers(page: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "hull.stl"
    path.write_bytes(trimesh.creation.capsule(height=400, radius=90).export(file_type="stl"))
    page.tab("Design")
    page.tab("Hull")  # opens the folder
    page.upload("Import a hull (STL, OBJ, GLB)", path)
    page.until(lambda: any("another unit" in note for note in page.notes()))
    page.choose("Unit of file", "mm")
    before = page.vertices("/robot/hull")
    page.upload("Import a hull (STL, OBJ, GLB)", path)
    page.until(lambda: page.session.state.layout.body.hull.mesh is not None)
    page.until(lambda: page.vertices("/robot/hull") != before)
    page.choose("Shape", "torpedo")
    page.until(lambda: page.session.state.layout.body.hull.shape == "torpedo")
    page.type("Centre of gravity [m]", "0.02", place=0)
    page.until(lambda: page.session.state.layout.body.hull.center_m[0] == -0.02)
    page.tab("Hull")


def test_failure_changes_graph_and_attainable_set(page: Any) -> None:
    page.unfold("Display", "Fin graph")
    page.row("Fin graph").first.click()
    page.visible("/robot/graph")
    graph = page.vertices("/robot/graph")
    page.tab("Reach")
    page.press("forces")
    page.page.wait_for_function(
        "() => window.__viserMutable.nodeRefFromName['/robot/attainable/now'].visible"
    )
    page.until(lambda: not page.view.analyst.busy)
    whole, card = page.vertices("/robot/attainable/now"), page.text(".score")
    page.key("x")
    page.until(lambda: page.session.state.failed == ("front_right",))
    page.until(lambda: len(page.vertices("/robot/graph")) < len(graph))
    page.until(lambda: page.vertices("/robot/attainable/now") != whole)
    page.page.wait_for_function(
        "() => window.__viserMutable.nodeRefFromName['/robot/attainable/whole'].visible"
    )
    page.until(lambda: page.text(".score") != card and "without" in page.text(".score"))
    page.press("none")
    page.visible("/robot/attainable/now", False)


def test_any_layout_stands_beside(page: Any) -> None:
    page.tab("Reach")
    page.choose("Beside", "pair")
    page.until(lambda: page.session.beside == "pair")
    page.until(lambda: not page.view.analyst.busy and "pair" in page.text(".score"))
    assert page.text(".score").count("axes independent") == 2, "in the sentence, and of both side by side"
    page.press("Pin this layout")
    page.until(lambda: page.session.beside == "pinned")
    page.choose("Beside", "saved state")
    page.until(lambda: page.session.beside is None)


def test_search_is_watched_and_accepted(page: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def patiently(*arguments: Any, progress: Any, **named: Any) -> Improvement:
        """Rounds so slow that the search never ends before Cancel is pressed, however quick the machine."""
        return optimize_layout(
            *arguments, progress=lambda told: (progress(told), time.sleep(0.5)), rounds=1000, **named
        )

    monkeypatch.setattr(improving, "optimize_layout", patiently)
    page.tab("Improve")
    before = page.session.state.layout
    page.choose("Goal", "power for a mission")
    page.until(lambda: page.session.draft.goal == "power for a mission")
    page.press("Add the present wrench")
    page.until(lambda: page.session.draft.mission != "")
    page.page.get_by_role("button", name="4", exact=True).locator("visible=true").last.click()
    page.until(lambda: page.session.draft.held == (before.names[3],))
    page.type("Reach ± [m]", "0.03", place=0)
    page.until(lambda: page.session.draft.way("all")[0] == 0.03)
    page.press("Search")
    page.until(lambda: page.view.improver.progress is not None)
    page.press("Cancel")
    page.until(lambda: page.view.improver.findings is not None)
    found = page.view.improver.findings
    assert found.goal == "mission_power" and found.cancelled
    accept = page.page.get_by_role("button", name="Accept")
    page.until(lambda: accept.count() == int(found.improved))
    if found.improved:
        page.press("Accept")
        page.until(lambda: page.session.state.layout == found.layout and page.view.improver.findings is None)
        page.press("Undo")
        page.until(lambda: page.session.state.layout == before)


def test_methods_side_by_side(page: Any) -> None:
    page.tab("Comparison")
    page.press("Compare the methods")
    page.until(lambda: page.view.comparison.state is not None and not page.view.comparison.running)
    page.until(lambda: page.page.locator("table.methods tr").count() == 1 + len(COMPARED))
    page.page.locator("table.methods tr.pick", has_text="analytic").click()
    page.until(lambda: page.session.overlay == "analytic")
    page.visible("/robot/overlay")
    page.until(lambda: "analytic" in page.text("table.methods tr.chosen"))
    page.press("none")
    page.until(lambda: page.session.overlay is None)


def test_wrench_is_dragged_in_the_view(page: Any) -> None:
    page.key("g")
    page.until(lambda: page.session.display.grips)
    page.visible("/robot/grip/force")
    page.look_from_above()
    before = page.session.state.target
    grip, further = (
        page.pixel("/robot/grip/force", (0.112, 0, 0)),
        page.pixel("/robot/grip/force", (0.192, 0, 0)),
    )
    page.drag(grip, further)
    page.until(lambda: page.session.state.target[0] > before[0] + 0.2)
    page.until(lambda: page.view.scenery.robot.grips.dragged is None)
    assert page.session.state.target[1:] == pytest.approx(before[1:], abs=0.02)
    page.until(lambda: not page.view.busy)
    assert page.session.history.undo_name == "Drag the force"
    page.key("Control+z")
    page.until(lambda: page.session.state.target == before)
