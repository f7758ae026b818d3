"""Intents about what a layout says of its fins: for one of them, or for all that are selected at once."""

from collections.abc import Callable
from typing import Any

from finlab.layout import Fin, Layout
from webapp.session import body_edits, fin_edits, layout_edits
from webapp.session.editing import Editing, Vector
from webapp.session.links import followed, partner

UNITS = ("kg", "kgm2", "m", "n")


class Inspecting(Editing):
    """Names, limits, models and drives of fins; several fins in one step."""

    def rename_fin(self, name: str, wanted: str) -> None:
        """A fin with another name; whatever is known of it goes on under that."""
        if wanted.strip() != name:
            renamed = fin_edits.checked_name(self.state.layout, name, wanted)
            self._commit(f"Rename {name} to {renamed}", self.state.with_renamed(name, renamed))

    def place_selected(self, position: Vector) -> None:
        """The selected fin at another place [m]; others that are selected take what of it has changed."""
        names = self._selected_names()
        before = self.state.layout.fins[self.state.layout.index(names[-1])].position
        changed = [abs(new - old) > layout_edits.UNTOUCHED for new, old in zip(position, before, strict=True)]

        def placed(layout: Layout, name: str) -> Layout:
            own = layout.fins[layout.index(name)].position
            x, y, z = (new if c else old for new, old, c in zip(position, own, changed, strict=True))
            return layout_edits.moved(layout, name, (x, y, z))

        self._for_each("Move", names, placed, f"move {names}")

    def turn_selected(self, angle: float) -> None:
        """All selected fins with one mounting angle [rad]."""
        names = self._selected_names()

        def turned(layout: Layout, name: str) -> Layout:
            return layout_edits.turned(layout, name, angle)

        self._for_each("Turn", names, turned, f"turn {names}")

    def limit_selected(self, quantity: str, ends: tuple[float, float]) -> None:
        """Other limits of all selected fins; `quantity` is a field of `Limits`, in radians or hertz."""
        self._change("Limit", self._selected_names(), lambda fin: fin_edits.limited(fin, quantity, ends))

    def choose_model(self, kind: str) -> None:
        """Another kind of model for all selected fins."""
        self._change(f"Model {kind} for", self._selected_names(), lambda fin: fin_edits.modelled(fin, kind))

    def set_parameter(self, key: str, value: Any) -> None:
        """A number of the model of all selected fins whose model has it."""
        self._change(
            f"{fin_edits.words(key)} of",
            self._selected_names(),
            lambda fin: fin_edits.with_parameter(fin, key, value),
        )

    def rename_robot(self, wanted: str) -> None:
        """Another name of the robot."""
        layout = self.state.layout
        named = body_edits.described(layout, wanted, layout.description)
        self._edit(f"Rename the robot to {named.name}", named)

    def describe_robot(self, text: str) -> None:
        """Another description of the robot."""
        layout = self.state.layout
        self._edit("Describe the robot", body_edits.described(layout, layout.name, text))

    def set_dynamics(self, key: str, value: Any) -> None:
        """Another field of the body, one of `DYNAMICS`; None forgets it."""
        changed = body_edits.with_dynamics(self.state.layout, **{key: value})
        word = fin_edits.words(key.rsplit("_", 1)[0] if key.rsplit("_", 1)[-1] in UNITS else key)
        self._edit(f"{word} of the robot", changed)

    def forget_dynamics(self) -> None:
        """Nothing is said of mass, damping and buoyancy."""
        nothing: dict[str, Any] = dict.fromkeys(body_edits.DYNAMICS)
        self._edit("Forget mass and damping", body_edits.with_dynamics(self.state.layout, **nothing))

    def estimate(self) -> None:
        """What the hull says of the body; a mass that is known stays."""
        self._edit("Estimate mass and damping from the hull", body_edits.estimated(self.state.layout))

    def _selected_names(self) -> tuple[str, ...]:
        """The selected fins, in the order in which they were chosen."""
        self._selected_name()
        return self._chosen

    def _change(self, what: str, names: tuple[str, ...], change: Callable[[Fin], Fin]) -> None:
        def changed(layout: Layout, name: str) -> Layout:
            return fin_edits.with_fin(layout, name, change(layout.fins[layout.index(name)]))

        self._for_each(what, names, changed, None)

    def _for_each(
        self,
        what: str,
        names: tuple[str, ...],
        change: Callable[[Layout, str], Layout],
        merge_key: str | None,
    ) -> None:
        """One step for several fins; twins follow unless they are among them already."""
        layout, links = self.state.layout, self.state.links
        done: set[str] = set()
        for name in reversed(names):  # the one that was chosen last leads its twin
            twin = partner(links, name)
            if twin in done:
                continue
            layout = change(layout, name)
            done.add(name)
            layout = followed(layout, links, name)
        self._edit(f"{what} {_which(names)}", layout, merge_key)


def _which(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{len(names)} fins"
