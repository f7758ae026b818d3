"""Intents about the question: what wrench is asked for, of which fins, answered how."""

from dataclasses import replace
from typing import Any

from finlab.allocation.policy import AXES
from finlab.errors import FinlabError
from webapp.session.core import Core
from webapp.session.state import LEAST, chosen
from webapp.session.targets import PRESETS


class Questions(Core):
    """Target wrench, failures and settings."""

    def set_target(self, axis: int, value: Any) -> None:
        """One component of the target wrench [N or N m]."""
        self._commit(f"Set {AXES[axis]}", self.state.with_target(axis, value), f"target{axis}")

    def set_preset(self, name: str) -> None:
        """The target wrench of a preset."""
        if name not in PRESETS:
            raise FinlabError(f"there is no preset {name!r:.40}")
        self._commit(f"Preset {name}", replace(self.state, target=PRESETS[name]))

    def set_setting(self, key: str, value: Any) -> None:
        """The temperature, the method or the policy; `key` is the field of `State`."""
        self._commit(f"Set {key.replace('_', ' ')}", self.state.with_setting(key, value), key)

    def keep_least(self, word: str) -> None:
        """Watts or effort, by the method that keeps them least."""
        self.set_setting("method", LEAST[chosen(word, "least", LEAST)])

    def toggle_failure(self, name: str) -> None:
        """A fin fails, or is repaired."""
        verb = "Repair" if name in self.state.failed else "Fail"
        self._commit(f"{verb} {name}", self.state.with_failure_toggled(name))

    def weaken(self, name: str, share: Any) -> None:
        """A fin keeps only a share of its largest amplitude and frequency; 1 makes it strong again."""
        self._commit(f"Weaken {name}", self.state.with_strength(name, share), f"weaken {name}")

    def jam(self, name: str, angle: Any) -> None:
        """A fin no longer turns from a zero direction [rad]; None frees it."""
        verb = "Free" if angle is None else "Jam"
        self._commit(f"{verb} {name}", self.state.with_stop(name, angle), f"jam {name}")

    def mend_all(self) -> None:
        """All fins are whole again."""
        self._commit("Mend all fins", replace(self.state, failed=(), weak=(), stuck=()))

    def mend(self, name: str) -> None:
        """A fin is whole again."""
        state = self.state.with_strength(name, 1.0).with_stop(name, None)
        self._commit(f"Mend {name}", state.with_failure_toggled(name) if name in state.failed else state)
