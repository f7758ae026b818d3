"""Watch the robot swim: a path, a method or two, fins that break; plots of what happens."""

from functools import partial
from typing import Any

import viser

from finlab.sim import PLANTS, SHIPPED, Trajectory
from webapp.handles import on_user_change, put
from webapp.markup.swim_card import swim_card
from webapp.panels.fin_buttons import FinButtons
from webapp.panels.host import Host
from webapp.panels.swim_plots import SwimPlots
from webapp.session.state import COMPARED
from webapp.session.swim_plan import ALONE, OWN, SPEEDS
from webapp.session.trajectory_file import read_path


class SwimTab:
    """Widgets of one tab."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._own: Trajectory | None = None
        self._path = gui.add_dropdown(
            "Path", tuple(SHIPPED), initial_value="lissajous", hint="Where to swim."
        )
        self._method = gui.add_dropdown("Method", COMPARED, hint="Who allocates, ten times a second.")
        self._rival = gui.add_dropdown(
            "Beside", (ALONE, *COMPARED), hint="A second robot on the same path, with another method."
        )
        self._plant = gui.add_dropdown(
            "Fin forces", tuple(PLANTS), hint="Mean forces, forces with their ripple, or flexible fins."
        )
        for key, widget in (
            ("path", self._path),
            ("method", self._method),
            ("rival", self._rival),
            ("plant", self._plant),
        ):
            on_user_change(widget, partial(self._set, key))
        self._run = gui.add_button_group(
            "Run",
            ("Start", "Pause", "Step", "End"),
            hint="Step swims for 0.1 s; B pauses or goes on.",
        )
        on_user_change(self._run, self._press)
        self._speed = gui.add_slider(
            "Speed", *SPEEDS, 0.1, 1.0, hint="Simulated time per real time; a slow machine falls short of it."
        )
        on_user_change(self._speed, partial(self._set, "speed"))
        self._follow = gui.add_checkbox("Follow", False, hint="The camera goes along with the first robot.")
        on_user_change(self._follow, host.scenery.look_after_swim)
        self._fins = FinButtons(
            gui,
            "Break a fin",
            "Press a fin's number: break or mend it while it swims.",
            "fl-breaks",
            lambda name: host.do(partial(host.swimming.toggle, name)),
        )
        self._card = gui.add_html("")
        self._plots = SwimPlots(gui)
        with gui.add_folder("More", expand_by_default=False):
            self._upload = gui.add_upload_button(
                "Open a path (CSV)",
                icon=viser.Icon.ROUTE,
                mime_type=".csv",
                hint="A table with the columns t [s], x, y, z [m].",
            )
            self._axis = self._plots.add_axis_choice(gui)

        @self._upload.on_upload
        async def _uploaded(event: Any) -> None:
            upload = event.target.value
            host.do(lambda: self._take_path(upload.name, upload.content))

    def _take_path(self, name: str, content: bytes) -> None:
        self._own = read_path(name, content)
        self._host.session.set_swim("path", OWN)

    def _set(self, key: str, value: object) -> None:
        self._host.do(partial(self._host.session.set_swim, key, value))

    def _press(self, button: str) -> None:
        swimming = self._host.swimming
        if button == "Start":
            self._host.do(self._start)
        elif button == "Pause":
            self._host.do(lambda: swimming.set_running(not swimming.running))
        elif button == "Step":
            self._host.do(swimming.step)
        elif button == "End":
            self._host.do(self._host.scenery.end_swim)

    def _start(self) -> None:
        session = self._host.session
        self._host.swimming.start(session.swim.plan(session.state, self._own))

    def refresh(self) -> None:
        """Write how the swim goes."""
        swimming, settings = self._host.swimming, self._host.session.swim
        put(self._path, options=tuple(SHIPPED) if self._own is None else (*SHIPPED, OWN))
        put(self._path, value=settings.path)
        put(self._method, value=settings.method)
        put(self._rival, value=settings.rival)
        put(self._plant, value=settings.plant)
        put(self._speed, value=settings.speed)
        if swimming.pace.speed != settings.speed:
            swimming.pace.set_speed(settings.speed)
        swimmers = swimming.swimmers
        names = swimmers[0].fins if swimmers else self._host.session.state.layout.names
        failed = swimmers[0].failed if swimmers else self._host.session.state.failed
        paused = swimming.active and not swimming.running and not swimming.done
        put(self._run, options=("Start", "Go on" if paused else "Pause", "Step", "End"))
        self._fins.refresh(names, failed)
        put(self._card, content=swim_card(swimming))
        self._plots.refresh(swimming)
