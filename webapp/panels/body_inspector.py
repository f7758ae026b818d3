"""Inspector of the robot as a whole: its name, its description, its mass, damping and buoyancy."""

from collections.abc import Callable
from functools import partial
from math import isfinite, nan
from typing import Any

from finlab.layout import Body, Layout
from finlab.swim.hull import contradicts, displaced, lift_of
from finlab.swim.vehicle.fossen import GRAVITY
from webapp.markup.words import html, three_digits
from webapp.page import Page

KNOWN = {
    "mass_kg": "mass",
    "inertia_kgm2": "inertia",
    "added_mass": "added mass",
    "linear_damping": "linear damping",
    "quadratic_damping": "quadratic damping",
}
NUMBERS = {
    "mass_kg": ("Mass [kg]", 0.5, "From the hull: of the water that it displaces."),
    "buoyancy_n": ("Buoyancy [N]", 1.0, "As much as the robot weighs where nothing is said."),
}
PARTS: dict[str, tuple[tuple[str, int, str], ...]] = {
    "inertia_kgm2": (
        ("Inertia [kg m²]", 0, "About x, y, z. From the hull: a solid of one density."),
    ),
    "added_mass": (
        ("Added mass [kg]", 0, "Along x, y, z. From the hull: its ellipsoid after Lamb, art. 114."),
        ("turning [kg m²]", 3, "About x, y, z. From the hull: its ellipsoid after Lamb, art. 115."),
    ),
    "linear_damping": (
        ("Drag ∝ v [N s/m]", 0, "Along x, y, z. From the hull: Blasius' friction at 0.2 m/s."),
        ("turning [N m s]", 3, "About x, y, z. From the hull: by the same friction."),
    ),
    "quadratic_damping": (
        (
            "Drag ∝ v² [N s²/m²]",
            0,
            "Along x, y, z. From the hull: ½ ρ A 0.44 d/l, Hoerner's blunt bodies.",
        ),
        (
            "turning [N m s²]",
            3,
            "About x, y, z. From the hull: strips in cross-flow but for the round core.",
        ),
    ),
    "center_of_buoyancy_m": (
        ("Buoyancy at [m]", 0, "Its centre, from that of gravity; above it, it rights the robot."),
    ),
}
"""Fields of `Body` with several numbers: their rows of three, the first number of each, what they
are."""


def add_body(page: Page) -> None:
    """Widgets about the robot."""
    session = page.session
    gui = page.gui

    def put_in(key: str, first: int, values: tuple[Any, ...]) -> None:
        full = list(_whole(_body(session.state.layout), key))
        full[first : first + 3] = values
        known = [value for value in full if isfinite(value)]
        # They are typed box by box; of inertias none may be zero.
        rest = max(known, default=0.0) if key == "inertia_kgm2" else 0.0
        session.set_dynamics(key, tuple(value if isfinite(value) else rest for value in full))

    def forget() -> None:
        text = (
            "Nothing is said of mass, inertia, damping and buoyancy from then on; undo brings it "
            "back."
        )
        page.ask("Forget the body?", text, {"Forget": session.forget_dynamics})

    def one(key: str) -> Callable[[Layout], float]:
        return lambda layout: (
            nan if getattr(_body(layout), key) is None else getattr(_body(layout), key)
        )

    def three(key: str, first: int) -> Callable[[Layout], tuple[float, ...]]:
        return lambda layout: _whole(_body(layout), key)[first : first + 3]

    page.add_html(_facts)
    page.bind(gui.add_text("Name", ""), session.rename_robot, lambda layout: layout.name)
    text = gui.add_text("About", "", multiline=True)
    page.bind(text, session.describe_robot, lambda layout: layout.description)
    acts = {"Estimate": session.estimate, "Forget": forget}
    page.add_buttons(
        "From the hull",
        acts,
        hint="Of the bare hull: fins, wires and ports come on top; each box says how.",
    )
    for key, (label, step, hint) in NUMBERS.items():
        box = gui.add_number(label, 0.0, step=step, hint=hint)
        page.bind_number(box, partial(session.set_dynamics, key), one(key))
    for key, rows in PARTS.items():
        for label, first, hint in rows:
            boxes = gui.add_vector3(label, (0.0, 0.0, 0.0), step=0.1, hint=hint)
            page.bind_number(boxes, partial(put_in, key, first), three(key, first))


def _body(layout: Layout) -> Body:
    return layout.body or Body()


def _whole(body: Body, key: str) -> tuple[float, ...]:
    known: tuple[float, ...] | None = getattr(body, key)
    return known or (nan,) * 3 * len(PARTS[key])


def _facts(layout: Layout) -> str:
    """The hull in figures, and what a swim would miss."""
    body = _body(layout)
    water = displaced(layout)
    lines = [f"The hull encloses {three_digits(water)} kg of water."]
    if body.mass_kg is not None:
        lift = lift_of(body)
        over = lift / GRAVITY - body.mass_kg
        if contradicts(layout):
            reason = "it is flooded in part" if lift < GRAVITY * water else "other parts lift, too"
            sentence = f" The body's buoyancy is that of {three_digits(lift / GRAVITY)} kg"
            lines[0] += f"{sentence}: {reason}, or estimate anew."
        rises = f"{'rises' if over > 0 else 'sinks'} with {three_digits(abs(over))} kg"
        lines.append(
            "By mass and buoyancy below it "
            f"{'is neutral' if abs(over) < 5e-4 * body.mass_kg else rises}."
        )
    missing = [word for key, word in KNOWN.items() if getattr(body, key) is None]
    if missing:
        lines.append(f"Not said: {', '.join(missing)}.")
    return html("<div class='fl head'><div class='dim'>{}</div></div>", " ".join(lines))
