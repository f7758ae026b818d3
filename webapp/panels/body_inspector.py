"""What a layout says of the robot as a whole: its name, what it is, its mass, damping and buoyancy."""

from functools import partial
from typing import Any

import viser

from finlab.layout import Body
from finlab.vehicle.body import GRAVITY
from webapp.handles import put
from webapp.markup.html import html
from webapp.markup.words import three_digits
from webapp.page import Page
from webapp.scene.meshes.hull import hull_of
from webapp.session.body_edits import solid_of, water_density

KNOWN = {
    "mass_kg": "mass",
    "inertia_kgm2": "inertia",
    "added_mass": "added mass",
    "linear_damping": "linear damping",
    "quadratic_damping": "quadratic damping",
}
"""What a swim wants to know, and what it is called."""
FORMULAS = (
    "Mass: of the water that the hull displaces. Inertia: one density. Added mass: the ellipsoid of its "
    "volume and proportions, after Lamb (1932). Damping: pressure after Hoerner (1965), about axes by "
    "strips; friction after Blasius at 0.2 m/s. All of the bare hull: fins, wires and ports come on top."
)
PARTS: dict[str, tuple[tuple[str, int, str], ...]] = {
    "inertia_kgm2": (("Inertia [kg m²]", 0, "About x, y, z. From the hull: a solid of one density."),),
    "added_mass": (
        ("Added mass [kg]", 0, "Along x, y, z. From the hull: its ellipsoid after Lamb, art. 114."),
        ("turning [kg m²]", 3, "About x, y, z. From the hull: its ellipsoid after Lamb, art. 115."),
    ),
    "linear_damping": (
        ("Drag ∝ v [N s/m]", 0, "Along x, y, z. From the hull: Blasius' friction at 0.2 m/s."),
        ("turning [N m s]", 3, "About x, y, z. From the hull: by the same friction."),
    ),
    "quadratic_damping": (
        ("Drag ∝ v² [N s²/m²]", 0, "Along x, y, z. From the hull: ½ ρ A 0.44 d/l, Hoerner's blunt bodies."),
        ("turning [N m s²]", 3, "About x, y, z. From the hull: strips in cross-flow but for the round core."),
    ),
    "center_of_buoyancy_m": (("Lift at [m]", 0, "Centre of buoyancy, from the centre of gravity."),),
}
"""Fields of `Body` with several numbers: their rows of three, the first number of each, what they are."""


class BodyInspector:
    """Widgets about the robot."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, session = page, page.session
        self._head = gui.add_html("")
        page.bind(gui.add_text("Name", ""), session.rename_robot, lambda: session.state.layout.name)
        text = gui.add_text("About", "", multiline=True)
        page.bind(text, session.describe_robot, lambda: session.state.layout.description)
        acts = {"Estimate": session.estimate, "Forget": session.forget_dynamics}
        page.add_buttons("From the hull", acts, hint=FORMULAS)
        page.bind_number(
            gui.add_number("Mass [kg]", 0.0, step=0.5, hint="From the hull: of the water that it displaces."),
            partial(session.set_dynamics, "mass_kg"),
            lambda: self._body.mass_kg or 0.0,
        )
        about = "As much as the robot weighs where nothing is said."
        page.bind_number(
            gui.add_number("Buoyancy [N]", 0.0, step=1.0, hint=about),
            partial(session.set_dynamics, "buoyancy_n"),
            self._lift,
        )
        for key, rows in PARTS.items():
            for label, first, hint in rows:
                page.bind_number(
                    gui.add_vector3(label, (0.0, 0.0, 0.0), step=0.1, hint=hint),
                    partial(self._set, key, first),
                    partial(self._three, key, first),
                )

    @property
    def _body(self) -> Body:
        return self._page.session.state.layout.body or Body()

    def _lift(self) -> float:
        """The buoyant force [N]; that of a neutral robot where none is given."""
        body = self._body
        return (body.mass_kg or 0.0) * GRAVITY if body.buoyancy_n is None else body.buoyancy_n

    def _whole(self, key: str) -> tuple[float, ...]:
        given: tuple[float, ...] | None = getattr(self._body, key)
        return given or (0.0,) * 3 * len(PARTS[key])

    def _three(self, key: str, first: int) -> tuple[float, ...]:
        return self._whole(key)[first : first + 3]

    def _set(self, key: str, first: int, values: tuple[Any, ...]) -> None:
        whole = list(self._whole(key))
        whole[first : first + 3] = values
        if key == "inertia_kgm2" and self._body.inertia_kgm2 is None:
            whole = [value or max(whole) for value in whole]  # typed box by box, and none may be zero
        self._page.session.set_dynamics(key, tuple(whole))

    def refresh(self) -> None:
        put(self._head, content=html("<div class='fl head'>{}</div>", self._facts()))

    def _facts(self) -> str:
        """The hull in figures, and what a swim would miss."""
        layout, body = self._page.session.state.layout, self._body
        volume = solid_of(hull_of(layout)).volume
        water = three_digits(water_density(layout) * volume)
        lines = [f"The hull encloses {three_digits(1000 * volume)} L, {water} kg of water."]
        if body.mass_kg is not None:
            over = self._lift() / GRAVITY - body.mass_kg
            rises = f"{'rises' if over > 0 else 'sinks'} with {three_digits(abs(over))} kg"
            lines.append(
                f"By mass and buoyancy below it {'is neutral' if abs(over) < 5e-4 * body.mass_kg else rises}."
            )
        missing = [word for key, word in KNOWN.items() if getattr(body, key) is None]
        if missing:
            lines.append(f"Not said: {', '.join(missing)}.")
        return html("<div class='dim'>{}</div>", " ".join(lines))
