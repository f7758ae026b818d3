"""Changes of a session's layout: place, turn, copy, remove and describe actuators, shape the hull.

Panels and the view call these intents; the changes themselves are functions in `layout_edits.py`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from finlab.axes import Vector3
from finlab.errors import FinlabError
from finlab.interaction.jets import Jets
from finlab.layout import Actuator, Layout
from finlab.layout.body import Hull
from finlab.layout.damage import Damage
from finlab.swim.hull import estimated
from webapp.session import layout_edits
from webapp.session.base import BaseSession
from webapp.session.granted import Granted, SourceFile
from webapp.session.key_words import key_words
from webapp.session.layout_edits import linked, partner, unlinked, with_twin
from webapp.session.lessons import Guide
from webapp.session.looking import Display
from webapp.session.state import FIRST_POLICY, State, method_for
from webapp.session.two_robots import TwoRobots

UNITS = ("kg", "kgm2", "m", "n")
"""Ends of the names of a body's fields that say a unit, and are no part of what undo calls them."""


class Session(BaseSession):
    """What one browser has made so far."""

    def __init__(self, layout: Layout, display: Display | None = None) -> None:
        super().__init__(layout, display)
        self.guide = Guide(self)
        self.two_robots = TwoRobots(self)

    def start_over(self) -> None:
        """Everything as at first sight, outside of tour and lessons; the way here can be undone.
        What is looked at, and how, stays."""
        self.guide.end()  # the work before it can be undone to
        self._commit("Start over", self._first)
        self.saved = self._first.layout
        self.selection_order = ()
        self.mode = 0

    # Robots.

    def open_layout(
        self,
        layout: Layout,
        step: str = "",
        lost: tuple[str, ...] = (),
        granted: tuple[Granted, ...] = (),
        source: SourceFile | None = None,
    ) -> None:
        """Another layout; the target stays, damage is forgotten. The method stays where
        it takes the robot, else `dual` answers; the policy is `closest` again.

        Args:
            layout: the robot.
            step: what undo calls it; "Open" and its name where there is none.
            lost: names of its lost actuators.
            granted: what was taken for granted of its file.
            source: that file; None where it says all.
        """
        method = method_for(layout, self.state.method)
        state = replace(
            self.state,
            layout=layout,
            damage=Damage(lost),
            method=method,
            policy=FIRST_POLICY,
            granted=granted,
            source=source,
        )
        self._open(step or f"Open {layout.name}", state)

    def open_example(
        self, layout: Layout, target: tuple[float, float, float, float, float, float], speed: float
    ) -> None:
        """A robot with a wrench (6,) [N, N m] and a speed ahead [m/s] that suit it."""
        self._open(f"Open {layout.name}", State(layout, target=target, speed=speed))

    def _open(self, step: str, state: State) -> None:
        """Another robot, none of whose actuators is selected: not even one in the place of that
        which was."""
        self._commit(step, state)
        self.selection_order = ()
        self.given_loads = None
        self.saved = state.layout

    def new_layout(self, kind: str) -> None:
        """A robot to begin with: one hull and one actuator of a type."""
        self.open_layout(layout_edits.blank(kind), "New design")
        self.selection_order = self.state.layout.names

    def accept_layout(self, layout: Layout) -> None:
        """A better layout that was found for this one."""
        self._edit("Improve the layout", layout)

    def confirm(self, row: Granted) -> None:
        """A row of what was taken for granted is right, or not sure after all."""
        rows = []
        for other in self.state.granted:
            is_confirmed = other.is_confirmed != (other is row)
            rows.append(replace(other, is_confirmed=is_confirmed))
        word = "Doubt" if row.is_confirmed else "Confirm"
        self._commit(f"{word}: {row.sentence:.40}", replace(self.state, granted=tuple(rows)))

    def rename_robot(self, new_name: str) -> None:
        """Another name of the robot."""
        named = replace(self.state.layout, name=new_name.strip())
        self._edit(f"Rename the robot to {named.name}", named)

    def describe_robot(self, text: str) -> None:
        """Another description of the robot."""
        self._edit("Describe the robot", replace(self.state.layout, description=text.strip()))

    def set_power(self, watts: float | None) -> None:
        """Another power budget of all actuators together [W]; None for no limit."""
        layout = layout_edits.with_power(self.state.layout, watts)
        self._edit("Power budget" if watts is not None else "No power budget", layout)

    def set_bus_power(self, place: int, watts: float | None) -> None:
        """Another power budget of a bus [W], by its place among those of the layout; without a
        limit (None) there is no such bus any more."""
        layout = self.state.layout
        if place >= len(layout.buses):
            raise FinlabError("that bus is gone")
        name = layout.buses[place].name
        step = f"Power of bus {name}" if watts is not None else f"No limit of bus {name}"
        self._edit(step, layout_edits.with_bus_power(layout, name, watts))

    def set_hull(self, shape: str, size: Vector3) -> None:
        """A parametric hull of a size [m]."""
        self._edit(
            f"Hull {shape}", layout_edits.shaped(self.state.layout, shape, size), f"hull {shape}"
        )

    def import_hull(self, hull: Hull, name: str = "Import hull") -> None:
        """A hull from a mesh file; `name` is that of the step."""
        self._edit(name, layout_edits.with_hull(self.state.layout, hull))

    def set_center_of_gravity(self, center: Vector3) -> None:
        """The centre of gravity at another place in the hull [m]."""
        self._edit(
            "Move the centre of gravity", layout_edits.balanced(self.state.layout, center), "center"
        )

    def set_dynamics(self, key: str, value: Any) -> None:
        """Another field of the body, one of `DYNAMICS`; None forgets it."""
        changed = layout_edits.with_dynamics(self.state.layout, **{key: value})
        stem, _, unit = key.rpartition("_")
        word = key_words(stem if unit in UNITS else key)
        self._edit(f"{word} of the robot", changed)

    def forget_dynamics(self) -> None:
        """Nothing is said of mass, damping and buoyancy."""
        nothing: dict[str, Any] = dict.fromkeys(layout_edits.DYNAMICS)
        self._edit(
            "Forget mass and damping", layout_edits.with_dynamics(self.state.layout, **nothing)
        )

    def estimate(self, with_mass: bool = False) -> None:
        """What the hull says of the body; a mass that is known stays, unless it is estimated as
        well."""
        layout = self.state.layout
        if with_mass:
            layout = layout_edits.with_dynamics(layout, mass_kg=None)
        self._edit("Estimate mass and damping from the hull", estimated(layout))

    def set_jets(self, on: Any) -> None:
        """Whether jets count: by the robot's own interaction where it was opened or saved with one,
        else by the usual constants."""
        layout = self.state.layout
        saved = self.saved
        saved_interaction = saved.interaction if saved.names == layout.names else None
        interaction = (layout.interaction or saved_interaction or Jets()) if on else None
        changed = self.state.with_layout(replace(layout, interaction=interaction))
        self._commit("Count jets" if on else "Leave jets out", changed)

    # One actuator.

    def drag(self, name: str, position: Vector3) -> None:
        """An actuator on its way in the user's hand: one step of undo for the drag from end to
        end."""
        layout = layout_edits.moved(self.state.layout, name, position)
        self._follow(f"Move {name}", name, layout, f"drag {name}", timed=False)

    def end_drag(self, name: str, position: Vector3) -> None:
        """A drag is over: the next change is a step of its own."""
        self.drag(name, position)
        self.history.end_merge()

    def point(self, name: str, direction: Vector3, held: bool = False) -> None:
        """Another direction of an actuator: a thruster's axis, zero of an azimuth, the shaft of a
        fin or rudder. `direction` may have any length; while it is `held` in the user's hand all is
        one step, until `history.end_merge`."""
        layout = layout_edits.pointed(self.state.layout, name, direction)
        self._follow(f"Point {name}", name, layout, f"point {name}", timed=not held)

    def rename(self, name: str, new_name: str) -> None:
        """An actuator with another name; its damage, and its link, go on under that."""
        new_name = new_name.strip()
        if new_name == name:
            return
        layout = self.state.layout
        if new_name in layout.names:
            raise FinlabError(f"there is an actuator {new_name!r:.70} already; give another name")
        renamed = layout.replace_actuator(name, name=new_name)
        state = self.state.with_layout(renamed, {name: new_name})
        self._commit(f"Rename {name} to {new_name}", state)

    def add(self, kind: str) -> None:
        """One more actuator of a type; it is selected."""
        layout, name = layout_edits.added(self.state.layout, kind)
        self._edit(f"Add {name}", layout)
        self.selection_order = (name,)

    def duplicate(self) -> None:
        """A copy of the selected actuator; it is selected."""
        source = self._chosen()[-1]
        layout, name = layout_edits.duplicated(self.state.layout, source)
        self._edit(f"Duplicate {source}", layout)
        self.selection_order = (name,)

    def mirror(self) -> None:
        """The selected actuator's image on the other side, which is selected; they move
        together."""
        source = self._chosen()[-1]
        layout, name = layout_edits.mirrored(self.state.layout, source)
        state = self.state.with_layout(linked(layout, source, name))
        self._commit(f"Mirror {source}", state)
        self.selection_order = (name,)

    def unlink(self) -> None:
        """The selected actuator and its mirror image go their own ways."""
        name = self._chosen()[-1]
        layout = self.state.layout
        if partner(layout, name) is None:
            raise FinlabError(f"{name} is not linked to another one; Mirror links it to its image")
        self._commit(f"Unlink {name}", self.state.with_layout(unlinked(layout, name)))

    def ring(self, count: int, around: str = "z") -> None:
        """Copies of the selected actuator, so that `count` stand evenly around a body axis."""
        name = self._chosen()[-1]
        self._edit(
            f"{count} copies of {name}", layout_edits.ring(self.state.layout, name, count, around)
        )

    # All selected actuators.

    def delete(self) -> None:
        """The selected actuators go."""
        names = self._chosen() and self.selection
        self._edit(f"Delete {_words(names)}", layout_edits.deleted(self.state.layout, names))

    def place_selected(self, position: Vector3) -> None:
        """The selected actuator at another position [m]; others that are selected take the
        coordinates that have changed."""
        names = self._chosen()
        old_position = self.state.layout.actuator(names[-1]).position
        has_changed = [
            abs(new - old) > layout_edits.UNTOUCHED
            for new, old in zip(position, old_position, strict=True)
        ]

        def placed(layout: Layout, name: str) -> Layout:
            coordinates = list(layout.actuator(name).position)
            for axis in range(3):
                if has_changed[axis]:
                    coordinates[axis] = position[axis]
            x, y, z = coordinates
            return layout_edits.moved(layout, name, (x, y, z))

        self._for_each("Move", names, placed, f"move {names}")

    def nudge(self, offset: Vector3, held: bool = False) -> None:
        """The selected actuators go by an offset [m], each from where it is.

        Args:
            offset: in the body frame (3,) [m].
            held: whether the key is held: the step of undo is that of the nudge before.
        """
        names = self._chosen()
        if not held:
            self.history.end_merge()

        def shifted(layout: Layout, name: str) -> Layout:
            x, y, z = layout.actuator(name).position
            dx, dy, dz = offset
            # To a tenth of a micrometre: 0.1 + 0.2 is 0.3.
            return layout_edits.moved(
                layout, name, (round(x + dx, 7), round(y + dy, 7), round(z + dz, 7))
            )

        self._for_each("Move", names, shifted, f"nudge {names}", timed=False)

    def turn_selected(self, angle: float) -> None:
        """All selected fins with one mounting angle [rad]; actuators without one stay."""
        layout = self.state.layout
        names = tuple(
            [
                name
                for name in self._chosen()
                if getattr(layout.actuator(name), "mounting_angle", None) is not None
            ]
        )
        turned = partial(layout_edits.with_mounting_angle, angle=angle)
        self._for_each("Turn", names, turned, f"turn {names}")

    def point_selected(self, direction: Vector3) -> None:
        """All selected actuators along one direction of any length, see `point`."""
        names = self._chosen()
        pointed = partial(layout_edits.pointed, direction=direction)
        self._for_each("Point", names, pointed, f"point {names}")

    def turn_about(self, direction: Vector3) -> None:
        """Another second axis of all selected actuators that have one, see
        `Actuator.turned_about`."""
        self._change("Turn", lambda actuator: actuator.turned_about(direction))

    def set_value(self, key: str, value: Any) -> None:
        """A field of all selected actuators that have it, see `with_value`, in SI units and
        radians."""
        verb = f"{key_words(key)} of"
        self._change(verb, lambda actuator: actuator.with_value(key, value))

    def choose_model(self, kind: str) -> None:
        """Another kind of model for all selected actuators that may have it."""
        self._change(f"Model {kind} for", lambda actuator: layout_edits.modelled(actuator, kind))

    def set_model(self, names: Sequence[str], **fields: Any) -> None:
        """Another model for some actuators, and other fields that came with it."""
        layout = self.state.layout
        for name in names:
            layout = layout.replace_actuator(name, **fields)
        self._edit(f"Fit {_words(names)}", layout)

    # What these share.

    def _chosen(self) -> tuple[str, ...]:
        """The selected actuators, the one that was chosen last at the end."""
        if not self.selection_order:
            raise FinlabError("no actuator is selected; click one, or choose it in the list")
        return self.selection_order

    def _edit(
        self, name: str, layout: Layout, merge_key: str | None = None, timed: bool = True
    ) -> None:
        """Another layout, with the hull that was drawn before; arguments as `_commit` has them."""
        layout = layout_edits.keeping_hull(self.state.layout, layout)
        self._commit(name, self.state.with_layout(layout), merge_key, timed)

    def _follow(self, step: str, name: str, layout: Layout, merge_key: str, timed: bool) -> None:
        """A layout in which one actuator has moved; its twin moves along."""
        layout = with_twin(self.state.layout, layout, name)
        self._edit(step, layout, merge_key, timed)

    def _change(self, verb: str, change: Callable[[Actuator], Actuator]) -> None:
        """One step that changes all selected actuators alike; twins follow."""

        def changed(layout: Layout, name: str) -> Layout:
            return layout.with_actuator(change(layout.actuator(name)))

        self._for_each(verb, self._chosen(), changed)

    def _for_each(
        self,
        verb: str,
        names: tuple[str, ...],
        change: Callable[[Layout, str], Layout],
        merge_key: str | None = None,
        timed: bool = True,
    ) -> None:
        """One step for several actuators; twins follow unless they are among them already.

        Args:
            verb: what undo calls the step, before the names.
            names: of the actuators, the one that was chosen last at the end: it leads its twin.
            change: makes the layout with one of them changed.
            merge_key: steps with the same one soon after each other are one step of undo.
            timed: whether such steps are apart after a while; without it, after `end_merge`.
        """
        old_layout = self.state.layout
        layout = old_layout
        done = set[str]()
        for name in reversed(names):
            if partner(old_layout, name) not in done:
                layout = with_twin(old_layout, change(layout, name), name)
                done.add(name)
        self._edit(f"{verb} {_words(names)}", layout, merge_key, timed)


def _words(names: Sequence[str]) -> str:
    """The name of a single actuator, else how many there are."""
    return names[0] if len(names) == 1 else f"{len(names)} actuators"
