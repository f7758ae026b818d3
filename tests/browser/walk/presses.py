"""Buttons of groups: what each means to the model."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from random import Random
from typing import Any

from tests.browser.walk.boxes import (
    ANSWERED,
    BODY,
    CANDIDATES,
    COMPARED,
    DAMAGE,
    FINS,
    IMPROVE,
    LAYOUTS,
    REACH,
    WRENCH,
    Spot,
    always,
    selected,
)
from tests.browser.walk.model import Model
from webapp.panels.body_inspector import ESTIMATES
from webapp.panels.fin_list import RING_SIZES, RINGS
from webapp.session.display import DRAWN
from webapp.session.targets import PRESETS

Intent = Callable[[Model], object]
MOST_FINS = 8
"""Robots with more get no rings: each would double them, and the walk would wait for answers."""


@dataclass(frozen=True)
class Press:
    """A button of a group, by its place where its words change; without a label one that stands alone."""

    spot: Spot
    label: str
    button: str | Callable[[Model, Random], int]
    take: Callable[[Model, int], object]
    there: Callable[[Model], bool] = always
    folder: str = ""


def presses() -> list[Press]:
    """All buttons of groups."""

    def on(
        spot: Spot, label: str, acts: dict[str, Intent], there: Any = always, folder: str = ""
    ) -> Iterable[Press]:
        for button, intent in acts.items():
            yield Press(spot, label, button, lambda m, _, intent=intent: intent(m), there, folder)

    def one(act: Callable[[Any], object]) -> Intent:
        return lambda m: act(m.session)

    def any_fin(model: Model, random: Random) -> int:
        return random.randrange(model.session.state.layout.n_fins)

    def toggle(model: Model, k: int) -> None:
        model.session.toggle_failure(model.session.state.layout.names[k])

    def hold(model: Model, k: int) -> None:
        name = model.session.state.layout.names[k]
        model.session.set_draft(model.session.draft.with_held_toggled(name))

    def bare(model: Model) -> bool:
        return not selected(model)

    edits = {
        "Mirror": one(lambda s: s.mirror_fin()),
        "Mirror once": one(lambda s: s.mirror_fin(linked=False)),
        "Unlink": one(lambda s: s.unlink_fin()),
        "Duplicate": one(lambda s: s.duplicate_fin()),
        "To hull": one(lambda s: s.stick_fin()),
        "Up": one(lambda s: s.reorder(-1)),
        "Down": one(lambda s: s.reorder(1)),
        "Delete": one(lambda s: s.delete_fin()),
    }
    rings = {str(n): (lambda m, n=n: m.session.ring_of_fins(n, RINGS[m.ring])) for n in RING_SIZES}
    hulls = {w[0].upper() + w[1:]: one(lambda s, w=w: s.estimate(w)) for w in ESTIMATES}
    whole = {"This fin": lambda m: m.session.mend(m.damaged), "All fins": one(lambda s: s.mend_all())}
    axes = {
        axis: one(partial(lambda k, s: s.set_only_axis(k), k))
        for k, axis in enumerate(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"))
    }
    drawn = {word: one(lambda s, word=word: s.set_display("drawn", word)) for word in DRAWN}
    return [
        *on(FINS, "Selected fin", edits),
        *on(FINS, "How many", rings, lambda m: m.session.state.layout.n_fins <= MOST_FINS),
        *on(BODY, "From the hull", {**hulls, "Forget": one(lambda s: s.forget_dynamics())}, bare),
        *on(DAMAGE, "Repair", whole, folder=DAMAGE[1]),
        *on(WRENCH, "Preset", {name: one(lambda s, name=name: s.set_preset(name)) for name in PRESETS}),
        *on(WRENCH, "One axis", axes),
        *on(REACH, "Draw the set of", drawn),
        *on(REACH, "Put aside", {"Pin this layout": one(lambda s: s.pin())}),
        *on(
            COMPARED,
            "Overlay",
            {
                name: one(
                    lambda s, name=name: s.set_overlay(name if name not in ("none", s.overlay) else None)
                )
                for name in ("none", "analytic", "qp")
            },
        ),
        *on(FINS, "", {"Add a fin": one(lambda s: s.add_fin())}),
        *on(LAYOUTS, "", {"Duplicate the design": one(lambda s: s.duplicate_layout())}),
        *on(("Allocate", "File"), "", {"New": one(lambda s: s.new_layout())}),
        Press(ANSWERED, "Fail a fin", any_fin, toggle),
        Press(IMPROVE, "May move", any_fin, hold),
        Press(CANDIDATES, "Mode", lambda *_: 0, lambda m, k: m.session.show_mode(k)),
    ]
