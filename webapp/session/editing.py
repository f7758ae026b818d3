"""Intents about the layout: place, turn, copy and remove fins, shape the hull."""

from collections.abc import Sequence
from dataclasses import replace

from finlab.errors import FinlabError
from finlab.layout import FinModelSpec, Layout
from finlab.layout.body import Hull
from webapp.session import layout_edits
from webapp.session.core import Core
from webapp.session.links import followed, partner, unlinked

Vector = tuple[float, float, float]


class Editing(Core):
    """Changes of the layout."""

    def open_layout(self, layout: Layout, step: str = "") -> None:
        """Another layout; the target stays, damage and links are forgotten. `step` is what undo calls it."""
        whole = replace(self.state, layout=layout, failed=(), weak=(), stuck=(), links=())
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

    def drag_fin(self, name: str, position: Vector, angle: float) -> None:
        """A fin on its way in the user's hand: one step of undo for the whole drag."""
        self._check_editable()
        layout = layout_edits.moved(self.state.layout, name, position)
        self._drag(name, layout_edits.turned(layout, name, angle))

    def end_drag(self, name: str, position: Vector, angle: float) -> None:
        """A drag is over: the next change is a step of its own."""
        self.drag_fin(name, position, angle)
        self.history.end_merge()

    def _drag(self, name: str, layout: Layout) -> None:
        whole = layout_edits.keeping_hull(self.state.layout, followed(layout, self.state.links, name))
        state = self.state.with_layout(whole)
        self._commit(f"Move {name}", state, f"drag {name}", timed=False)

    def add_fin(self) -> None:
        """One more fin; it is selected."""
        self._check_editable()
        layout, name = layout_edits.added(self.state.layout)
        self._edit(f"Add {name}", layout)
        self.selected = name

    def duplicate_fin(self) -> None:
        """A copy of the selected fin; it is selected."""
        source = self._selected_name()
        layout, name = layout_edits.duplicated(self.state.layout, source)
        self._edit(f"Duplicate {source}", layout)
        self.selected = name

    def mirror_fin(self) -> None:
        """The selected fin's image on the other side, which is selected; they move together."""
        source = self._selected_name()
        layout, name = layout_edits.mirrored(self.state.layout, source)
        state = self.state.with_layout(layout)
        self._commit(f"Mirror {source}", state.with_link(source, name))
        self.selected = name

    def unlink_fin(self) -> None:
        """The selected fin and its mirror image go their own ways."""
        name = self._selected_name()
        if partner(self.state.links, name) is None:
            raise FinlabError(f"{name} is not linked to another fin; Mirror links it to its image")
        self._commit(f"Unlink {name}", replace(self.state, links=unlinked(self.state.links, name)))

    def ring_of_fins(self, count: int) -> None:
        """Copies of the selected fin, so that `count` stand evenly around the vertical body axis."""
        name = self._selected_name()
        self._edit(f"{count} copies of {name}", layout_edits.ring(self.state.layout, name, count))

    def stick_fin(self) -> None:
        """The selected fin onto the hull."""
        name = self._selected_name()
        layout = layout_edits.stuck(self.state.layout, name)
        self._edit(f"Stick {name} to the hull", followed(layout, self.state.links, name))

    def delete_fin(self) -> None:
        """The selected fins go."""
        self._selected_name()
        names = self.selection
        which = names[0] if len(names) == 1 else f"{len(names)} fins"
        self._edit(f"Delete {which}", layout_edits.deleted(self.state.layout, names))

    def set_model(self, names: Sequence[str], model: FinModelSpec) -> None:
        """Another model for some fins."""
        which = names[0] if len(names) == 1 else f"{len(names)} fins"
        self._edit(f"Fit {which}", layout_edits.with_model(self.state.layout, names, model))

    def set_hull(self, shape: str, size: Vector) -> None:
        """A parametric hull of a size [m]."""
        self._edit(f"Hull {shape}", layout_edits.shaped(self.state.layout, shape, size), f"hull {shape}")

    def import_hull(self, hull: Hull, name: str = "Import hull") -> None:
        """A hull from a mesh file; `name` is that of the step."""
        self._edit(name, layout_edits.with_hull(self.state.layout, hull))

    def set_center_of_gravity(self, center: Vector) -> None:
        """The centre of gravity at another place in the hull [m]."""
        self._edit("Move the centre of gravity", layout_edits.balanced(self.state.layout, center), "center")

    def _edit(self, name: str, layout: Layout, merge_key: str | None = None) -> None:
        whole = layout_edits.keeping_hull(self.state.layout, layout)
        self._commit(name, self.state.with_layout(whole), merge_key)
