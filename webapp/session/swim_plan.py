"""What is to be swum: what the user has set so far, and the plan that comes of it when the swim starts."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.sim import PLANTS, SHIPPED, Trajectory
from webapp.session.state import COMPARED, State, chosen, number

ALONE = "nobody"
"""Rival of a robot that swims alone."""
OWN = "own path"
"""Name of a path from the user's file."""
SPEEDS = (0.1, 8.0)
"""Simulated time per time on the wall that may be asked for."""


@dataclass(frozen=True)
class SwimSettings:
    """What a session remembers of its swims; not part of undo."""

    path: str = "lissajous"
    """Name of a shipped trajectory, or `OWN`."""
    method: str = COMPARED[0]
    """Who allocates."""
    rival: str = ALONE
    """Who allocates for the robot beside it."""
    plant: str = next(iter(PLANTS))
    """How the fins' forces are simulated: one of `PLANTS`."""
    speed: float = 1.0
    """Simulated time per time on the wall."""
    announced: bool = True
    """Whether the allocator is told of fins that break and are mended; else the monitor has to find out."""

    def with_value(self, key: str, value: Any) -> "SwimSettings":
        """One field changed; the page may send anything.

        Raises:
            FinlabError: there is no such field, or not with this value.
        """
        if key == "speed":
            return replace(self, speed=number(value, "speed", *SPEEDS))
        if key == "announced":
            if not isinstance(value, bool):
                raise FinlabError(f"announced: expected true or false, got {value!r:.60}")
            return replace(self, announced=value)
        choices = {
            "path": (*SHIPPED, OWN),
            "method": COMPARED,
            "rival": (ALONE, *COMPARED),
            "plant": tuple(PLANTS),
        }
        if key not in choices:
            raise FinlabError(f"a swim has no setting {key!r:.40}")
        return replace(self, **{key: chosen(value, key, choices[key])})

    def without_own_path(self) -> "SwimSettings":
        """The same after a reload, when the user's file is not there any more."""
        return replace(self, path=SwimSettings.path) if self.path == OWN else self

    def plan(self, state: State, own: Trajectory | None) -> "Plan":
        """The plan for the robot as it is now, along the user's own path where that is wanted and known.

        Raises:
            FinlabError: there is no own path.
        """
        if self.path == OWN and own is None:
            raise FinlabError("there is no path of your own; open one under More, or choose another path")
        methods = (self.method,) if self.rival in (ALONE, self.method) else (self.method, self.rival)
        path = own if self.path == OWN and own is not None else self.path
        return Plan(state.able, state.failed, path, methods, self.plant, state.objective)


class Plan(NamedTuple):
    """One swim."""

    layout: Layout
    """The robot."""
    failed: tuple[str, ...]
    """Fins that are lost from the start."""
    path: str | Trajectory
    """Name of a shipped trajectory, or one of the user's own."""
    methods: tuple[str, ...]
    """Allocation methods, one robot each."""
    plant: str = "mean"
    """How the fins' forces are simulated: one of `PLANTS`."""
    objective: str = "power"
    """What the fins keep least."""
