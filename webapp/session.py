"""One browser's session: its state with undo, and how it is looked at. Knows nothing of pages and widgets.

Every method is an intent of the user. It either changes the session as a whole, or raises a `FinlabError`
with a sentence for the user and changes nothing.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from finlab.allocation.policy import AXES
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.body import Hull
from webapp import editing, hull_editing
from webapp.analyst import DRAWN
from webapp.arrow_scale import NEWTONS
from webapp.history import History
from webapp.links import followed, partner, unlinked
from webapp.state import State, number
from webapp.targets import FIRST, PRESETS
from webapp.tour import STEPS

POSITION_STEPS = {"off": 0.0, "5 mm": 0.005, "1 cm": 0.01, "5 cm": 0.05}
"""Grids [m] that a fin's position can snap to."""
ANGLE_STEPS = {"off": 0.0, "5°": 5.0, "15°": 15.0, "45°": 45.0}
"""Grids [deg] that a mounting angle can snap to."""


@dataclass(frozen=True)
class Display:
    """How the robot is shown. Not part of undo."""

    frozen: bool = False
    """Fins hold still at their zero direction."""
    speed: float = 0.5
    """Time of the animation per real time."""
    fans: bool = True
    """Show the sweep of each fin."""
    labels: bool = True
    """Show the numbers of the fins."""
    graph: bool = False
    """Show the edges of the graph that the network sees."""
    dimensions: bool = True
    """Show the selected fin's distance from the centre of gravity."""
    shadows: bool = True
    """Cast shadows; slow without a graphics card."""
    dark: bool = False
    """Dark theme."""
    newtons: float = 0.0
    """Force that an arrow of 0.1 m stands for [N]; 0 lets the app choose."""
    position_snap: str = "off"
    """Key of `POSITION_STEPS`."""
    angle_snap: str = "off"
    """Key of `ANGLE_STEPS`."""
    stick: bool = False
    """Fins slide on the hull, shafts along its normal."""
    ghost: bool = True
    """Show where moved fins stood when the layout was opened or saved."""
    grips: bool = False
    """Show handles on the arrows of the asked wrench."""
    drawn: str = "none"
    """Key of `webapp.analyst.DRAWN`: the attainable set that is shown."""
    alone: bool = True
    """Attainable forces without torques, torques without forces."""
    center: bool = False
    """Mark the centre of gravity."""


class Session:
    """What one browser has made so far."""

    def __init__(self, layout: Layout, display: Display | None = None) -> None:
        """Start with a layout, no failures, and a gentle wrench forward and to the left."""
        self._first = State(layout, target=FIRST)
        self.history: History[State] = History(self._first)
        self.display = display or Display()
        self.selected: str | None = None
        self.saved = layout
        """The layout as it was opened or saved last."""
        self.mode = 0
        """Which of the answer's modes is shown; 0 is the best one."""
        self.overlay: str | None = None
        """Method whose forces are shown beside those on the robot."""
        self.stop: int | None = None
        """Where the tour is, None while there is none."""
        self._before_tour: State | None = None
        self.revision = 0
        """Grows with every change of the state; an answer carries the revision it was made for."""

    def resume(self, state: State) -> None:
        """Go on from a state that was kept; what led there is not known any more."""
        self.history = History(state)
        self.saved = state.layout

    def twin(self) -> "Session":
        """A session with the same state and look, for work that must not see later changes."""
        other = Session(self.state.layout, self.display)
        other.history = History(self.state)
        return other

    @property
    def state(self) -> State:
        """The present state."""
        return self.history.state

    def _commit(self, name: str, state: State, merge_key: str | None = None, timed: bool = True) -> None:
        if state != self.state:
            self.history.commit(name, state, merge_key, timed)
            self._settled()

    def _settled(self) -> None:
        """After any change of the state: a choice of mode is void, a lost fin is not selected."""
        self.revision += 1
        self.mode = 0
        if self.selected not in self.state.layout.names:
            self.selected = None

    # The question.

    def set_target(self, axis: int, value: Any) -> None:
        """One component of the target wrench [N or N m]."""
        self._commit(f"Set {AXES[axis]}", self.state.with_target(axis, value), f"target{axis}")

    def drag_target(self, first: int, vector: Sequence[float], over: bool) -> None:
        """Force (`first` 0) or torque (3) of the target in the user's hand; one step of undo for the drag."""
        state, word = self.state, "force" if first == 0 else "torque"
        for axis, value in enumerate(vector, start=first):
            state = state.with_target(axis, round(float(value), 2 if first == 0 else 3))
        self._commit(f"Drag the {word}", state, f"drag {word}", timed=False)
        if over:
            self.history.end_merge()

    def set_preset(self, name: str) -> None:
        """The target wrench of a preset."""
        if name not in PRESETS:
            raise FinlabError(f"there is no preset {name!r:.40}")
        self._commit(f"Preset {name}", replace(self.state, target=PRESETS[name]))

    def set_setting(self, key: str, value: Any) -> None:
        """K, T, gamma or the method; `key` is the field of `State`."""
        self._commit(f"Set {key.replace('_', ' ')}", self.state.with_setting(key, value), key)

    def toggle_failure(self, name: str) -> None:
        """A fin fails, or is repaired."""
        verb = "Repair" if name in self.state.failed else "Fail"
        self._commit(f"{verb} {name}", self.state.with_failure_toggled(name))

    # The layout.

    def open_layout(self, layout: Layout) -> None:
        """Another layout; the target stays, failures and links are forgotten."""
        self._commit(f"Open {layout.name}", replace(self.state, layout=layout, failed=(), links=()))
        self.saved = layout

    def accept_layout(self, layout: Layout) -> None:
        """A better layout that was found for this one."""
        self._edit("Improve the layout", layout)

    def note_saved(self) -> None:
        """The layout has been saved as it is."""
        self.saved = self.state.layout

    def move_fin(self, name: str, position: tuple[float, float, float]) -> None:
        """A fin at another place [m], snapped."""
        self._place(f"Move {name}", editing.moved(self.state.layout, name, position, self._step_m), name)

    def turn_fin(self, name: str, angle: float) -> None:
        """A fin with another mounting angle [rad], snapped."""
        layout = editing.turned(self.state.layout, name, angle, self._step_rad)
        self._edit(f"Turn {name}", followed(layout, self.state.links, name), f"turn {name}")

    def drag_fin(self, name: str, position: tuple[float, float, float], angle: float) -> None:
        """A fin on its way in the user's hand: not snapped yet, and one step of undo for the whole drag."""
        layout = editing.turned(editing.moved(self.state.layout, name, position), name, angle)
        self._drag(name, layout)

    def end_drag(self, name: str, position: tuple[float, float, float], angle: float) -> None:
        """A drag is over: snap, and let the next change be a step of its own."""
        layout = editing.moved(self.state.layout, name, position, self._step_m)
        self._drag(name, editing.turned(layout, name, angle, self._step_rad))
        self.history.end_merge()

    def _drag(self, name: str, layout: Layout) -> None:
        if self.display.stick:
            layout = editing.stuck(layout, name)
        state = self.state.with_layout(followed(layout, self.state.links, name))
        self._commit(f"Move {name}", state, f"drag {name}", timed=False)

    def _place(self, step: str, layout: Layout, name: str) -> None:
        if self.display.stick:
            layout = editing.stuck(layout, name)
        self._edit(step, followed(layout, self.state.links, name), f"move {name}")

    @property
    def _step_m(self) -> float:
        return POSITION_STEPS[self.display.position_snap]

    @property
    def _step_rad(self) -> float:
        return math.radians(ANGLE_STEPS[self.display.angle_snap])

    def add_fin(self) -> None:
        """One more fin; it is selected."""
        layout, name = editing.added(self.state.layout)
        self._edit(f"Add {name}", layout)
        self.selected = name

    def duplicate_fin(self) -> None:
        """A copy of the selected fin; it is selected."""
        source = self._selected_name()
        layout, name = editing.duplicated(self.state.layout, source)
        self._edit(f"Duplicate {source}", layout)
        self.selected = name

    def mirror_fin(self) -> None:
        """The selected fin's image on the other side, linked to it; the image is selected."""
        source = self._selected_name()
        layout, name = editing.mirrored(self.state.layout, source)
        self._commit(f"Mirror {source}", self.state.with_layout(layout).with_link(source, name))
        self.selected = name

    def unlink_fin(self) -> None:
        """The selected fin and its mirror image go their own ways."""
        name = self._selected_name()
        if partner(self.state.links, name) is None:
            raise FinlabError(f"{name} is not linked to another fin; Mirror links it to its image")
        self._commit(f"Unlink {name}", replace(self.state, links=unlinked(self.state.links, name)))

    def ring_of_fins(self, count: int) -> None:
        """Copies of the selected fin, so that `count` stand evenly around the vertical axis."""
        name = self._selected_name()
        self._edit(f"{count} around the axis", editing.ring(self.state.layout, name, count))

    def stick_fin(self) -> None:
        """The selected fin onto the hull."""
        name = self._selected_name()
        layout = editing.stuck(self.state.layout, name)
        self._edit(f"Stick {name} to the hull", followed(layout, self.state.links, name))

    def set_hull(self, shape: str, size: tuple[float, float, float]) -> None:
        """A parametric hull of a size [m]."""
        self._edit(f"Hull {shape}", hull_editing.shaped(self.state.layout, shape, size), f"hull {shape}")

    def import_hull(self, hull: Hull) -> None:
        """A hull from a mesh file."""
        self._edit("Import hull", hull_editing.with_hull(self.state.layout, hull))

    def set_center_of_gravity(self, center: tuple[float, float, float]) -> None:
        """The centre of gravity at another place in the hull [m]."""
        self._edit("Move the centre of gravity", hull_editing.balanced(self.state.layout, center), "center")

    def delete_fin(self) -> None:
        """The selected fin goes."""
        name = self._selected_name()
        self._edit(f"Delete {name}", editing.deleted(self.state.layout, name))

    def _edit(self, name: str, layout: Layout, merge_key: str | None = None) -> None:
        self._commit(name, self.state.with_layout(layout), merge_key)

    def _selected_name(self) -> str:
        if self.selected is None:
            raise FinlabError("no fin is selected; click one, or choose it in the list")
        return self.selected

    def start_over(self) -> None:
        """Everything as at first sight; the way here can be undone."""
        self._commit("Start over", self._first)
        self.selected = None

    # The tour.

    def next_stop(self) -> None:
        """The tour's first stop, or the one after this; after the last one the tour is over."""
        if self.stop is None:
            self._before_tour = self.state
        stop = 0 if self.stop is None else self.stop + 1
        if stop == len(STEPS):
            self.end_tour()
        else:
            self._go(stop)

    def previous_stop(self) -> None:
        """The tour's stop before this one."""
        self._go(max((self.stop or 0) - 1, 0))

    def end_tour(self) -> None:
        """Back to what was there before the tour."""
        if self._before_tour is not None:
            self._commit("End the tour", self._before_tour)
        self.stop, self._before_tour = None, None

    def _go(self, stop: int) -> None:
        step = STEPS[stop]
        self._commit(f"Tour: {step.title}", step.state(self.state))
        self.stop, self.mode, self.selected = stop, step.mode, None
        self.display = replace(self.display, graph=step.graph)

    # Looking.

    def select(self, name: str | None) -> None:
        """Select a fin, or none."""
        if name is not None:
            self.state.layout.index(name)
        self.selected = name
        self.history.end_merge()

    def select_next(self) -> None:
        """Select the fin after the selected one."""
        names = self.state.layout.names
        self.select(names[(names.index(self.selected) + 1) % len(names)] if self.selected else names[0])

    def show_mode(self, index: int) -> None:
        """Show one of the answer's modes on the robot."""
        self.mode = max(0, int(index))

    def set_overlay(self, method: str | None) -> None:
        """Show the forces of a compared method, or of none."""
        self.overlay = method

    def set_display(self, key: str, value: Any) -> None:
        """One field of `Display`."""
        choices: dict[str, Any] = {
            "position_snap": POSITION_STEPS,
            "angle_snap": ANGLE_STEPS,
            "drawn": DRAWN,
        }
        if key in choices and value not in choices[key]:
            raise FinlabError(f"{key}: expected one of {', '.join(choices[key])}, got {value!r:.40}")
        if key == "newtons" and value not in (0.0, *NEWTONS):
            raise FinlabError(f"arrow scale: expected one of {NEWTONS} N per 0.1 m, got {value!r:.40}")
        if key == "speed":
            value = number(value, "speed of the animation", 0.02, 1.0)
        self.display = replace(self.display, **{key: value})

    def undo(self) -> str:
        """Take back the last step; returns its name."""
        return self._stepped(self.history.undo(), "undo")

    def redo(self) -> str:
        """Bring back the step taken back last; returns its name."""
        return self._stepped(self.history.redo(), "redo")

    def _stepped(self, name: str | None, verb: str) -> str:
        if name is None:
            raise FinlabError(f"there is nothing to {verb}")
        self._settled()
        return name
