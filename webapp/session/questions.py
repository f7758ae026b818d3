"""Intents about the question: what wrench is asked for, of which actuators, answered how.

Undo is of the robot and its damage; wrench, method and policy stay as they are.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from finlab.allocation.policy import AXES
from finlab.errors import FinlabError
from finlab.layout.damage import FAULTS
from finlab.layout.directions import part_of
from webapp.session.core import Core
from webapp.session.state import LEAST, MAX_SPEED, chosen, number
from webapp.session.targets import PRESETS

FAULT_VERBS = {"weak": "Weaken", "thrust": "Tear", "stuck": "Jam", "running": "Let run"}


class Questions(Core):
    """Target wrench, failures and settings."""

    def set_target(self, axis: int, value: Any) -> None:
        """One component of the target wrench [N or N m]."""
        self._commit("", self.state.with_target(axis, value))

    def ask_for(self, values: Sequence[str]) -> None:
        """All six components, as text that may be anything."""
        state = self.state
        try:
            for axis, value in zip(range(len(AXES)), values, strict=True):
                state = state.with_target(axis, float(value))
        except ValueError:
            raise FinlabError(f"wrench: expected six numbers, got {','.join(values)!r:.60}") from None
        self._commit("", state)

    def set_speed(self, value: Any) -> None:
        """The speed ahead through the water [m/s]."""
        checked = number(value, "speed through the water [m/s]", 0.0, MAX_SPEED)
        self._commit("Set the speed", replace(self.state, speed=checked), "speed")

    def set_preset(self, name: str) -> None:
        """The target wrench of a preset."""
        self._commit("", replace(self.state, target=PRESETS[chosen(name, "preset", PRESETS)]))

    def set_setting(self, key: str, value: Any) -> None:
        """The temperature, the method, the policy or the network; `key` is the field of `State`."""
        self._commit("", self.state.with_setting(key, value))

    def keep_least(self, word: str) -> None:
        """Watts or effort, by the method that keeps them least."""
        self.set_setting("method", LEAST[chosen(word, "least", LEAST)])

    def toggle_axis(self, axis: int) -> None:
        """An axis of the wrench counts, or is free."""
        verb = "Free" if self.state.layout.commanded[axis] else "Command"
        self._commit(f"{verb} {AXES[axis]}", self.state.with_axis_toggled(axis))

    def toggle_failure(self, name: str) -> None:
        """An actuator fails, or is repaired."""
        verb = "Repair" if name in self.state.failed else "Fail"
        self._commit(f"{verb} {name}", self.state.with_failure_toggled(name))

    def damage(self, name: str, kind: str, value: Any) -> None:
        """An actuator has a fault of a kind, one of `Health`: a share, an angle [rad], a command; None mends
        that."""
        verb = "Mend" if value is None else FAULT_VERBS.get(kind, "Damage")
        self._commit(f"{verb} {name}", self.state.with_fault(name, kind, value), f"{kind} {name}")

    def mend_all(self) -> None:
        """All actuators are whole again."""
        self._commit("Mend all", replace(self.state, failed=(), health=None))

    def mend(self, name: str) -> None:
        """An actuator is whole again."""
        state = self.state
        for kind in FAULTS[part_of(state.layout, name).type]:
            state = state.with_fault(name, kind, None)
        self._commit(f"Mend {name}", state.with_failure_toggled(name) if name in state.failed else state)
