"""State with undo, selection, question and looks of a session; changes of its layout are in
`editing.py`, whose `Session` is what the panels know."""

from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from finlab.axes import AXES, axes_in
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.damage import Damage
from webapp.session.given_loads import GivenLoads
from webapp.session.looking import (
    CANDIDATES,
    DRAWERS,
    MODE_DRAWERS,
    NULL_SPACE,
    TASKS,
    Desk,
    Display,
    SearchRequest,
)
from webapp.session.state import (
    LEAST,
    MAX_SPEED,
    MAX_TARGET,
    History,
    State,
    Step,
    Steps,
    is_same_robot,
    number,
    one_of,
)
from webapp.session.swim_plan import SwimSettings
from webapp.session.targets import FIRST_TARGET, PRESETS

FAULT_VERBS = {"weak": "Weaken", "torn": "Tear", "stuck": "Jam", "running": "Let run"}
"""Kind of fault -> what undo calls the step that brings it about."""


MOST_KEPT = 20
"""Layouts as they were opened or saved that a session remembers."""


class BaseSession:
    """All of a session but changes of its layout. Undo takes back what was done last to the robot,
    to the question asked of it, or along the null space of the answer."""

    def __init__(self, layout: Layout, display: Display | None = None) -> None:
        """Start with a layout, no damage, and a gentle wrench forward and to the left."""
        self._first = State(layout, target=FIRST_TARGET)
        self.history = History(self._first)
        self.display = display or Display()
        self.desk = Desk()
        self.selection_order: tuple[str, ...] = ()
        """The selected actuators, in the order in which they were chosen."""
        self.kept: tuple[Layout, ...] = (layout,)
        """Layouts as they were opened or saved, the newest last; undo may lead back to one."""
        self.draft = SearchRequest()
        """What the next search for a better layout is to do."""
        self.given_loads: GivenLoads | None = None
        """Loads that capability plots are about; None for a force from each heading."""
        self.swim = SwimSettings()
        self.mode = 0
        """Which of the answer's modes is shown; 0 is the best one."""
        self.step: int | None = None
        """How many steps of refinement the network's proposals have had that are shown; None for
        all."""
        self.shifts: tuple[float, ...] = ()
        """How far along the first directions of the answer's null space the forces are [N]."""
        self.loops = False
        """Whether the refinement begins anew at its end."""
        self.has_started = False
        """Whether something was chosen on the start page."""
        self.revision = 0
        """Grows with every change of the state; an answer carries the revision it was made for."""

    state: State = property(attrgetter("history.state"))  # type: ignore[assignment]
    """The present state."""

    @property
    def saved(self) -> Layout:
        """The layout as it was opened or saved last."""
        return self.kept[-1]

    @saved.setter
    def saved(self, layout: Layout) -> None:
        others = [kept for kept in self.kept if kept is not layout]
        self.kept = (*others, layout)[-MOST_KEPT:]

    # The state and its undo.

    def _commit(
        self, name: str, state: State, merge_key: str | None = None, timed: bool = True
    ) -> None:
        """Another state, and a step of undo.

        Args:
            name: what undo calls the step; empty where the change belongs to the step before.
            state: the other state.
            merge_key: steps with the same one soon after each other are one step of undo.
            timed: whether such steps are apart after a while; without it, after `end_merge`.
        """
        old_state = self.state
        if state == old_state:
            return
        if name:
            self.history.commit(name, state, merge_key, timed, self.shifts)
        else:
            self.history.replace(state)
        self.settle(old_state)

    def settle(self, old_state: State) -> None:
        """After any change of the state: a choice of mode is void, an actuator that is gone is not
        selected; one that is called otherwise now stays so."""
        self.revision += 1
        self.mode = 0
        self.step = None
        self.shifts = ()
        if not self.selection_order:
            return
        old_names = old_state.layout.names
        names = self.state.layout.names
        new_names: dict[str, str] = {}
        if len(old_names) == len(names):
            new_names = dict(zip(old_names, names, strict=True))
        selection = []
        for name in self.selection_order:
            new_name = name if name in names else new_names.get(name)
            if new_name is not None:
                selection.append(new_name)
        self.selection_order = tuple(selection)

    def accept_state(self, step: str, state: State) -> bool:
        """Another robot with its damage, and what is asked of it; whether that is a change.

        Args:
            step: what undo calls it.
            state: the robot and its question.
        """
        revision = self.revision
        self._commit(step, state)
        return self.revision != revision

    @property
    def before(self) -> State | None:
        """The state before the last change of this robot or of its damage; None where there was
        another robot, or none."""
        state = self.state
        for step in reversed(self.history.past):
            if not is_same_robot(step.state, state):
                return step.state if step.state.layout.name == state.layout.name else None
        return None

    def undo(self) -> str:
        """Take back the last step; returns its name."""
        return self._step("undo", self.history.past, self.history.future)

    def redo(self) -> str:
        """Bring back the step taken back last; returns its name."""
        return self._step("redo", self.history.future, self.history.past)

    def _step(self, verb: str, source: Steps, sink: Steps) -> str:
        if not source:
            raise FinlabError(f"there is nothing to {verb}")
        old_state = self.state
        name, state, shifts = source.pop()
        sink.append(Step(name, old_state, self.shifts))
        self.history.replace(state)
        if state is not old_state:
            self.settle(old_state)
        self._set_shifts(shifts)
        return name

    # The selection.

    @property
    def selected(self) -> str | None:
        """The selected actuator; of several the one that was chosen last."""
        return self.selection_order[-1] if self.selection_order else None

    @property
    def selection(self) -> tuple[str, ...]:
        """All selected actuators, in the order of the layout."""
        if not self.selection_order:
            return ()
        return tuple(name for name in self.state.layout.names if name in self.selection_order)

    def select(self, name: str | None) -> None:
        """Select an actuator, or none."""
        if name is not None:
            self.state.layout.index(name)
        self.selection_order = () if name is None else (name,)
        self.history.end_merge()

    def select_also(self, name: str) -> None:
        """One more actuator beside those that are selected; one of them is let go."""
        self.state.layout.index(name)
        others = tuple([selected for selected in self.selection_order if selected != name])
        self.selection_order = others if name in self.selection_order else (*others, name)
        self.history.end_merge()

    def select_next(self) -> None:
        """Select the actuator after the selected one."""
        names = self.state.layout.names
        index = (names.index(self.selected) + 1) % len(names) if self.selected else 0
        self.select(names[index])

    # The question: wrench, settings, damage.

    def set_target(self, axis: int, value: Any) -> None:
        """One component of the target wrench [N or N m]; a drag of its slider is one step, until
        `history.end_merge`."""
        self._ask(f"Ask for {AXES[axis]}", self.state.with_target(axis, value))

    def pull(self, target: Sequence[float], step: str = "Pull the wrench") -> None:
        """The target wrench on its way in the user's hand: one step of undo, until
        `history.end_merge`.

        Args:
            target: components (6,) [N, N m].
            step: what undo calls it.
        """
        state = self.state
        for axis, value in zip(range(len(AXES)), target, strict=True):
            if value != state.target[axis]:
                state = state.with_target(axis, value)
        self._ask(step, state)

    def _ask(self, name: str, state: State) -> None:
        """Another question by a step of undo: one for all of the same name, until
        `history.end_merge`."""
        self._commit(name, state, name, timed=False)

    def ask_for(self, values: Sequence[str], step: str = "") -> None:
        """All six components, as text that may be anything.

        Args:
            values: the components.
            step: what undo calls it; empty where they belong to the robot that was opened before.
        """
        state = self.state
        try:
            for axis, value in zip(range(len(AXES)), values, strict=True):
                state = state.with_target(axis, float(value))
        except ValueError:
            raise FinlabError(
                f"wrench: expected six numbers, got {','.join(values)!r:.60}"
            ) from None
        self._ask(step, state)

    def set_preset(self, name: str) -> None:
        """The target wrench of a preset."""
        target = PRESETS[one_of(name, "preset", PRESETS)]
        self._commit(f"Ask for: {name}", replace(self.state, target=target))

    def set_speed(self, value: Any) -> None:
        """The speed ahead through the water [m/s]."""
        checked = number(value, "speed through the water [m/s]", 0.0, MAX_SPEED)
        self._ask("Speed through the water", replace(self.state, speed=checked))

    def set_setting(self, key: str, value: Any) -> None:
        """The temperature, the method, the policy or the network; `key` is the field of `State`."""
        state = self.state.with_setting(key, value)
        step = key.capitalize() if key == "temperature" else f"{key.capitalize()} {value}"
        self._ask(step, state)

    def keep_least(self, word: str) -> None:
        """Watts or effort, by the method that keeps them least."""
        self.set_setting("method", LEAST[one_of(word, "least", LEAST)])

    def toggle_axis(self, axis: int) -> None:
        """An axis of the wrench counts, or is free."""
        layout = self.state.layout
        counts = layout.commanded ^ (np.arange(6) == axis)
        if not counts.any():
            raise FinlabError("a robot commands at least one axis; switch another one on first")
        state = replace(self.state, layout=replace(layout, axes=axes_in(counts)))
        self._commit(f"{'Command' if counts[axis] else 'Free'} {AXES[axis]}", state)

    def toggle_loss(self, name: str) -> None:
        """An actuator is lost, or repaired."""
        verb = "Repair" if name in self.state.lost else "Fail"
        self._commit(f"{verb} {name}", self.state.with_loss_toggled(name))

    def damage(self, name: str, kind: str, value: Any) -> None:
        """An actuator has a fault of a kind, see `Damage`: a share, an angle [rad], a command; None
        mends that."""
        verb = "Mend" if value is None else FAULT_VERBS.get(kind, "Damage")
        self._commit(f"{verb} {name}", self.state.with_fault(name, kind, value), f"{kind} {name}")

    def mend(self, name: str) -> None:
        """An actuator is whole again."""
        state = self.state
        for kind in state.layout.actuator(name).KIND.faults:
            state = state.with_fault(name, kind, None)
        if name in state.lost:
            state = state.with_loss_toggled(name)
        self._commit(f"Mend {name}", state)

    def mend_all(self) -> None:
        """All actuators are whole again."""
        self._commit("Mend all", replace(self.state, damage=Damage()))

    # What is looked at; none of it is part of undo.

    @property
    def drawer(self) -> str | None:
        """What of the drawer is seen; None where it is folded, or the task has none."""
        return None if self.desk.folded else self.opened or None

    @property
    def opened(self) -> str:
        """What lies uppermost in the drawer of the open task, folded or not; nothing where it has
        none."""
        opened = self.desk.opened[self.desk.task]
        return opened if opened != CANDIDATES or self.state.layout.is_of_fins else NULL_SPACE

    def show_task(self, name: str) -> None:
        """Open a task."""
        self.desk = replace(self.desk, task=one_of(name, "task", TASKS))
        self.step = None

    def show_drawer(self, name: str) -> None:
        """Open the drawer at one of its tabs, and the task to which it belongs."""
        task = next((task for task, names in DRAWERS.items() if name in names), self.desk.task)
        one_of(name, "drawer", DRAWERS[task])
        others = tuple([drawer for drawer in self.desk.drawers if drawer[0] != task])
        if name in MODE_DRAWERS and name != self.desk.opened[task]:
            self.mode = 0  # the modes of one drawer are not those of the other
        self.desk = Desk(task, (*others, (task, name)))
        self.step = None

    def fold_drawer(self) -> None:
        """Leave only the tabs of the drawer, or open it again."""
        self.desk = replace(self.desk, folded=not self.desk.folded)

    def show_mode(self, index: int) -> None:
        """Show one of the answer's modes on the robot."""
        self.mode = max(0, int(index))

    def shift(self, direction: int, value: Any) -> None:
        """Go along a direction of the null space [N]; the robot does what comes of it. A drag of a
        slider is one step, until `history.end_merge`."""
        shifts = list(self.shifts) + [0.0] * (direction + 1 - len(self.shifts))
        shifts[direction] = number(value, "way [N]", -MAX_TARGET, MAX_TARGET)
        step = f"Null space {direction + 1}"
        self.history.commit(step, self.state, step, False, self.shifts)
        self._set_shifts(tuple(shifts) if any(shifts) else ())

    def _set_shifts(self, shifts: tuple[float, ...]) -> None:
        """Show what comes of a way along the null space."""
        self.shifts = shifts
        self.mode = min(len(shifts), 1)

    def show_step(self, step: int, steps: int) -> None:
        """Show the network's proposals after some steps of their refinement, of as many as there
        are."""
        self.step = max(step, 0) if step < steps else None

    def set_loop(self, value: Any) -> None:
        """Whether the refinement begins anew at its end."""
        self.loops = bool(value)

    def set_display(self, key: str, value: Any) -> None:
        """One field of `Display`."""
        self.display = self.display.with_value(key, value)

    def follow_system(self, is_dark: bool) -> None:
        """The system's colour scheme, unless the user has chosen one."""
        if not self.display.has_own_theme:
            self.display = replace(self.display, dark=is_dark)

    def toggle(self, key: str) -> None:
        """Turn one switch of `Display` on or off."""
        self.set_display(key, not getattr(self.display, key))

    def set_swim(self, key: str, value: Any) -> None:
        """One field of `SwimSettings`."""
        self.swim = self.swim.with_value(key, value)
