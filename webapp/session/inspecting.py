"""Intents about what a layout says of its actuators: of one, or of all that are selected at once."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from finlab.hull import estimated
from finlab.layout import Actuator, Layout
from finlab.layout.directions import Vector, part_of, replaced, turned_about
from webapp.session import actuator_edits, layout_edits
from webapp.session.editing import Editing, which
from webapp.session.links import followed, partner

UNITS = ("kg", "kgm2", "m", "n")


class Inspecting(Editing):
    """Names, places, directions, limits and models of actuators; several in one step."""

    def rename(self, name: str, wanted: str) -> None:
        """An actuator with another name; whatever is known of it goes on under that."""
        if wanted.strip() != name:
            renamed = actuator_edits.checked_name(self.state.layout, name, wanted)
            self._commit(f"Rename {name} to {renamed}", self.state.with_renamed(name, renamed))

    def place_selected(self, position: Vector) -> None:
        """The selected actuator at another place [m]; others that are selected take what has changed."""
        names = self._selected_names()
        before = part_of(self.state.layout, names[-1]).position
        changed = [abs(new - old) > layout_edits.UNTOUCHED for new, old in zip(position, before, strict=True)]

        def placed(layout: Layout, name: str) -> Layout:
            own = part_of(layout, name).position
            x, y, z = (new if c else old for new, old, c in zip(position, own, changed, strict=True))
            return layout_edits.moved(layout, name, (x, y, z))

        self._for_each("Move", names, placed, f"move {names}")

    def turn_selected(self, angle: float) -> None:
        """All selected fins with one mounting angle [rad]; actuators without one stay."""
        names = tuple(
            name
            for name in self._selected_names()
            if getattr(part_of(self.state.layout, name), "mounting_angle", None) is not None
        )
        turned = partial(layout_edits.turned, angle=angle)
        self._for_each("Turn", names, turned, f"turn {names}")

    def point_selected(self, direction: Vector) -> None:
        """All selected actuators along one direction of any length, see `point`."""
        names = self._selected_names()
        pointed = partial(layout_edits.pointed, direction=direction)
        self._for_each("Point", names, pointed, f"point {names}")

    def turn_about(self, direction: Vector) -> None:
        """Another second axis of all selected actuators that have one, see `turned_about`."""
        self._change("Turn", lambda part: turned_about(part, direction))

    def set_value(self, key: str, value: Any) -> None:
        """A field of all selected actuators that have it, see `with_value`, in SI units and radians."""
        self._change(
            f"{actuator_edits.words(key)} of", lambda part: actuator_edits.with_value(part, key, value)
        )

    def choose_model(self, kind: str) -> None:
        """Another kind of model for all selected actuators that may have it."""
        self._change(f"Model {kind} for", lambda part: actuator_edits.modelled(part, kind))

    def set_model(self, names: Sequence[str], **found: Any) -> None:
        """Another model for some actuators, and what else was found with it."""
        layout = self.state.layout
        for name in names:
            layout = layout.replace_actuator(name, **found)
        self._edit(f"Fit {which(names)}", layout)

    def rename_robot(self, wanted: str) -> None:
        """Another name of the robot."""
        named = replace(self.state.layout, name=wanted.strip())
        self._edit(f"Rename the robot to {named.name}", named)

    def describe_robot(self, text: str) -> None:
        """Another description of the robot."""
        self._edit("Describe the robot", replace(self.state.layout, description=text.strip()))

    def set_dynamics(self, key: str, value: Any) -> None:
        """Another field of the body, one of `DYNAMICS`; None forgets it."""
        changed = layout_edits.with_dynamics(self.state.layout, **{key: value})
        word = actuator_edits.words(key.rsplit("_", 1)[0] if key.rsplit("_", 1)[-1] in UNITS else key)
        self._edit(f"{word} of the robot", changed)

    def forget_dynamics(self) -> None:
        """Nothing is said of mass, damping and buoyancy."""
        nothing: dict[str, Any] = dict.fromkeys(layout_edits.DYNAMICS)
        self._edit("Forget mass and damping", layout_edits.with_dynamics(self.state.layout, **nothing))

    def estimate(self, anew: bool = False) -> None:
        """What the hull says of the body; a mass that is known stays, unless all is estimated `anew`."""
        layout = self.state.layout
        known = layout_edits.with_dynamics(layout, mass_kg=None) if anew else layout
        self._edit("Estimate mass and damping from the hull", estimated(known))

    def _selected_names(self) -> tuple[str, ...]:
        """The selected actuators, in the order in which they were chosen."""
        self._selected_name()
        return self._chosen

    def _change(self, what: str, change: Callable[[Actuator], Actuator]) -> None:
        def changed(layout: Layout, name: str) -> Layout:
            return replaced(layout, change(part_of(layout, name)))

        self._for_each(what, self._selected_names(), changed, None)

    def _for_each(
        self,
        what: str,
        names: tuple[str, ...],
        change: Callable[[Layout, str], Layout],
        merge_key: str | None,
    ) -> None:
        """One step for several actuators; twins follow unless they are among them already."""
        before, links = self.state.layout, self.state.links
        layout, done = before, set[str]()
        for name in reversed(names):  # the one that was chosen last leads its twin
            twin = partner(links, name)
            if twin in done:
                continue
            layout = followed(before, change(layout, name), links, name)
            done.add(name)
        self._edit(f"{what} {which(names)}", layout, merge_key)
