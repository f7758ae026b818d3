"""One browser's page with everything on it: panels, and commands by key or palette (Ctrl+K)."""

from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from webapp.page import Page, Panel
from webapp.panels.tabs import PANEL_WIDTH, build_panels
from webapp.session.state import AXIS_WORDS, OBJECTIVES
from webapp.session.targets import PRESETS


class View(Page):
    """Panels and scene of one client around its session."""

    def _build(self) -> tuple[list[Panel], list[Panel]]:
        gui = self.client.gui
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_WIDTH)
        gui.set_panel_label("finlab")
        add_commands(gui, self)
        return build_panels(gui, self)


def add_commands(gui: viser.GuiApi, page: Page) -> None:
    """Register the commands of one browser. The camera owns W A S D Q E and the arrow keys."""
    session = page.session

    def add(label: str, act: Callable[[], object], hotkey: Any = None, modifier: Any = None) -> None:
        command = gui.add_command(label, hotkey=hotkey, modifier=modifier)

        @command.on_trigger
        async def _triggered(_event: Any) -> None:
            page.do(act)

    def fail_selected() -> None:
        session.toggle_failure(session.selected or session.state.layout.names[0])

    def toggle(key: str) -> None:
        session.set_display(key, not getattr(session.display, key))

    add("Undo", session.undo, "Z", "cmd/ctrl")
    add("Redo", session.redo, "Z", "cmd/ctrl+shift")
    add("Select the next fin", session.select_next, "N")
    add("Select nothing", lambda: session.select(None), "X")
    add("Fail or repair the selected fin", fail_selected, "F")
    add("Mirror the selected fin", session.mirror_fin, "M")
    add("Unlink the selected fin from its mirror image", session.unlink_fin)
    add("Stick the selected fin to the hull", session.stick_fin)
    add("Duplicate the selected fin", session.duplicate_fin)
    add("Delete the selected fin", session.delete_fin)
    add("Add a fin", session.add_fin)
    add("Pin this layout to compare with", session.pin)
    for name in PRESETS:
        add(f"Ask for: {name}", partial(session.set_preset, name))
    for axis, word in enumerate(AXIS_WORDS):
        add(f"Ask for {word} alone", partial(session.set_only_axis, axis))
    for objective in OBJECTIVES:
        add(f"Keep least: {objective}", partial(session.set_setting, "objective", objective))
    add("Compare the methods", lambda: page.comparison.start(session.state))
    add("Play the refinement", page.answering.play)
    add("Stop the sweep", page.sweep.stop)
    add("Swim: pause or go on", lambda: page.swimming.set_running(not page.swimming.running), "B")
    add("Swim: keep it to compare others with", page.swimming.keep)
    add("Swim: back to the design", page.scenery.end_swim)
    add("Export the bundle for the robot", page.exports.bundle)
    add("Tour: start, or next stop", session.next_stop, "T")
    add("Start over", session.start_over)
    add("Freeze or move the fins", lambda: toggle("frozen"), "P")
    add("Drag the wrench in 3D, or stop it", lambda: toggle("grips"), "G")
    add("Show or hide the fin graph", lambda: toggle("graph"))
    add("Show or hide the centre of gravity", lambda: toggle("center"))
    add("Dark or light theme", lambda: toggle("dark"))
    for view, key in (("3D", "1"), ("Top", "2"), ("Side", "3"), ("Front", "4")):
        add(f"Camera: {view}", partial(page.scenery.robot.look_from, view), key)
