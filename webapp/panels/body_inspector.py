"""Inspector of the robot as a whole: its name, its description, its mass, damping and buoyancy."""

from collections.abc import Callable
from functools import partial
from math import isfinite, nan
from typing import Any

from finlab.layout import Body, Layout
from finlab.swim.hull import contradicts, displaced, lift_of
from finlab.swim.vehicle.fossen import GRAVITY
from webapp.markup.words import html, three_digits, unsaid_of
from webapp.page import Page
from webapp.panels.body_boxes import NUMBERS, VECTORS

NEUTRAL_SHARE = 5e-4
"""Share of the mass by which a body that counts as neutral may be lighter or heavier."""


def add_body(page: Page) -> None:
    """Widgets about the robot as a whole."""
    session = page.session
    gui = page.gui

    def put_in(key: str, first: int, values: tuple[Any, ...]) -> None:
        """Three typed numbers into a field of `Body`, from an index on; NaN is an empty box."""
        numbers = list(_numbers(_body(session.state.layout), key))
        numbers[first : first + 3] = values
        typed = [value for value in numbers if isfinite(value)]
        # Boxes are typed one by one. An empty one counts as zero, but no inertia may be zero.
        default = max(typed, default=0.0) if key == "inertia_kgm2" else 0.0
        session.set_dynamics(key, tuple(value if isfinite(value) else default for value in numbers))

    def forget() -> None:
        text = (
            "Nothing is said of mass, inertia, damping and buoyancy from then on; undo brings it "
            "back."
        )
        page.ask("Forget the body?", text, {"Forget": session.forget_dynamics})

    page.add_html(hull_card)
    page.bind(gui.add_text("Name", ""), session.rename_robot, lambda layout: layout.name)
    text = gui.add_text("About", "", multiline=True)
    page.bind(text, session.describe_robot, lambda layout: layout.description)
    actions = {"Estimate": session.estimate, "Forget": forget}
    page.add_buttons(
        "From the hull",
        actions,
        hint="Of the bare hull: fins, wires and ports come on top; each box says how.",
    )
    for key, number_box in NUMBERS.items():
        box = gui.add_number(number_box.label, 0.0, step=number_box.step, hint=number_box.hint)
        page.bind_number(
            box, partial(session.set_dynamics, key), _number_of(key), may_be_empty=True
        )
    for key, rows in VECTORS.items():
        for row in rows:
            boxes = gui.add_vector3(row.label, (0.0, 0.0, 0.0), step=0.1, hint=row.hint)
            page.bind_number(boxes, partial(put_in, key, row.first), _vector_of(key, row.first))


def _body(layout: Layout) -> Body:
    """The body of a layout; an empty one where the layout has none."""
    return layout.body or Body()


def _number_of(key: str) -> Callable[[Layout], float]:
    """A function from a layout to a field of its body that is one number; NaN where it has none."""

    def number(layout: Layout) -> float:
        value: float | None = getattr(_body(layout), key)
        return nan if value is None else value

    return number


def _vector_of(key: str, first: int) -> Callable[[Layout], tuple[float, ...]]:
    """A function from a layout to three numbers of a field of its body, from an index on."""

    def vector(layout: Layout) -> tuple[float, ...]:
        return _numbers(_body(layout), key)[first : first + 3]

    return vector


def _numbers(body: Body, key: str) -> tuple[float, ...]:
    """All numbers of a field of a body; NaN where it has none."""
    numbers: tuple[float, ...] | None = getattr(body, key)
    return numbers or (nan,) * 3 * len(VECTORS[key])


def hull_card(layout: Layout) -> str:
    """How much water the hull encloses, and whether it is a made-up one; whether that fits the
    body, and what a swim would lack."""
    body = _body(layout)
    water_kg = displaced(layout)
    is_described = body.hull is not None
    sentences = [f"The hull encloses {three_digits(water_kg)} kg of water."]
    if not is_described:
        sentences = [
            "Of its hull nothing is said: the one that is drawn is made to fit its actuators, with "
            f"{three_digits(water_kg)} kg of water."
        ]
    if body.mass_kg is not None:
        lift_kg = lift_of(body) / GRAVITY
        if is_described and contradicts(layout):
            is_less = lift_of(body) < GRAVITY * water_kg
            reason = "it is flooded in part" if is_less else "other parts lift, too"
            sentences.append(
                f"The body's buoyancy is that of {three_digits(lift_kg)} kg: {reason}, or estimate "
                "anew."
            )
        excess_kg = lift_kg - body.mass_kg
        motion = "is neutral"
        if abs(excess_kg) >= NEUTRAL_SHARE * body.mass_kg:
            verb = "rises" if excess_kg > 0 else "sinks"
            motion = f"{verb} with {three_digits(abs(excess_kg))} kg"
        sentences.append(f"By mass and buoyancy below it {motion}.")
    unsaid = unsaid_of(layout)
    if unsaid:
        sentences.append(f"Not said: {', '.join(unsaid)}.")
    return html("<div class='fl head'><div class='dim'>{}</div></div>", " ".join(sentences))
