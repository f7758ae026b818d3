"""How the robot is shown; not part of undo."""

from dataclasses import dataclass, replace
from typing import Any

from finlab.errors import FinlabError
from finlab.forces.attainable import Kind
from webapp.session.state import chosen

DRAWN: dict[str, Kind | None] = {"none": None, "forces": "force", "torques": "torque"}
"""What set can be drawn, by the word on its button."""


@dataclass(frozen=True)
class Display:
    """Switches of one page."""

    frozen: bool = False
    """Fins hold still at their zero direction."""
    shadows: bool = True
    """Cast shadows; slow without a graphics card."""
    dark: bool = False
    drawn: str = "none"
    """Key of `DRAWN`: the attainable set that is shown."""

    def with_value(self, key: str, value: Any) -> "Display":
        """One field changed; the page may send anything.

        Raises:
            FinlabError: there is no such field, or not with this value.
        """
        now = getattr(self, key, None)
        if now is None:
            raise FinlabError(f"there is no switch {key!r:.40}")
        if key == "drawn":
            chosen(value, key, DRAWN)
        if isinstance(now, bool) and not isinstance(value, bool):
            raise FinlabError(f"{key}: expected on or off, got {value!r:.40}")
        return replace(self, **{key: value})
