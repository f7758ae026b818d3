"""Intents about the layout: place, turn, copy and remove actuators, shape the hull."""

from collections.abc import Sequence
from dataclasses import replace

from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.body import Hull
from finlab.layout.directions import Vector
from webapp.session import layout_edits
from webapp.session.core import Core
from webapp.session.links import followed, partner, unlinked
from webapp.session.state import method_for


class Editing(Core):
    """Changes of the layout."""

    def open_layout(self, layout: Layout, step: str = "", failed: tuple[str, ...] = ()) -> None:
        """Another layout, of which some may have failed; the target stays, damage and links are forgotten.
        `step` is what undo calls it."""
        method = method_for(layout, self.state.method)
        whole = replace(self.state, layout=layout, failed=failed, health=None, links=(), method=method)
        self._commit(step or f"Open {layout.name}", whole)
        self.saved = layout

    def new_layout(self) -> None:
        """A robot to begin with: one hull and one fin."""
        self.open_layout(layout_edits.blank(), "New design")
        self.selected = self.state.layout.names[0]

    def accept_layout(self, layout: Layout) -> None:
        """A better layout that was found for this one."""
        self._edit("Improve the layout", layout)

    def note_saved(self, layout: Layout) -> None:
        """A layout has been saved as it is."""
        self.saved = layout

    def drag(self, name: str, position: Vector) -> None:
        """An actuator on its way in the user's hand: one step of undo for the whole drag."""
        layout = layout_edits.moved(self.state.layout, name, position)
        self._follow(f"Move {name}", name, layout, f"drag {name}", timed=False)

    def end_drag(self, name: str, position: Vector) -> None:
        """A drag is over: the next change is a step of its own."""
        self.drag(name, position)
        self.history.end_merge()

    def point(self, name: str, direction: Vector, held: bool = False) -> None:
        """Another direction of an actuator: a thruster's axis, zero of an azimuth, the shaft of a fin or
        rudder. `direction` may have any length; while it is `held` in the user's hand all is one step, until
        `history.end_merge`."""
        layout = layout_edits.pointed(self.state.layout, name, direction)
        self._follow(f"Point {name}", name, layout, f"point {name}", timed=not held)

    def _follow(
        self, step: str, name: str, layout: Layout, merge_key: str | None = None, timed: bool = True
    ) -> None:
        """A layout in which one actuator has moved; its twin moves along."""
        layout = followed(self.state.layout, layout, self.state.links, name)
        self._edit(step, layout, merge_key, timed)

    def add(self, kind: str) -> None:
        """One more actuator of a type; it is selected."""
        layout, name = layout_edits.added(self.state.layout, kind)
        self._edit(f"Add {name}", layout)
        self.selected = name

    def duplicate(self) -> None:
        """A copy of the selected actuator; it is selected."""
        source = self._selected_name()
        layout, name = layout_edits.duplicated(self.state.layout, source)
        self._edit(f"Duplicate {source}", layout)
        self.selected = name

    def mirror(self) -> None:
        """The selected actuator's image on the other side, which is selected; they move together."""
        source = self._selected_name()
        layout, name = layout_edits.mirrored(self.state.layout, source)
        state = self.state.with_layout(layout)
        self._commit(f"Mirror {source}", state.with_link(source, name))
        self.selected = name

    def unlink(self) -> None:
        """The selected actuator and its mirror image go their own ways."""
        name = self._selected_name()
        if partner(self.state.links, name) is None:
            raise FinlabError(f"{name} is not linked to another one; Mirror links it to its image")
        self._commit(f"Unlink {name}", replace(self.state, links=unlinked(self.state.links, name)))

    def ring(self, count: int, around: str = "z") -> None:
        """Copies of the selected actuator, so that `count` stand evenly around a body axis."""
        name = self._selected_name()
        self._edit(f"{count} copies of {name}", layout_edits.ring(self.state.layout, name, count, around))

    def delete(self) -> None:
        """The selected actuators go."""
        self._selected_name()
        self._edit(f"Delete {which(self.selection)}", layout_edits.deleted(self.state.layout, self.selection))

    def set_hull(self, shape: str, size: Vector) -> None:
        """A parametric hull of a size [m]."""
        self._edit(f"Hull {shape}", layout_edits.shaped(self.state.layout, shape, size), f"hull {shape}")

    def import_hull(self, hull: Hull, name: str = "Import hull") -> None:
        """A hull from a mesh file; `name` is that of the step."""
        self._edit(name, layout_edits.with_hull(self.state.layout, hull))

    def set_center_of_gravity(self, center: Vector) -> None:
        """The centre of gravity at another place in the hull [m]."""
        self._edit("Move the centre of gravity", layout_edits.balanced(self.state.layout, center), "center")

    def _edit(self, name: str, layout: Layout, merge_key: str | None = None, timed: bool = True) -> None:
        whole = layout_edits.keeping_hull(self.state.layout, layout)
        self._commit(name, self.state.with_layout(whole), merge_key, timed)


def which(names: Sequence[str]) -> str:
    """Some actuators in a few words."""
    return names[0] if len(names) == 1 else f"{len(names)} actuators"
