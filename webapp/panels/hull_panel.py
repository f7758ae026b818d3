"""The panel of the hull: a shape with a size, or a mesh file that is imported and turned. A section
of the task Design, see `panels/arrangement.py`."""

from dataclasses import replace
from functools import partial
from typing import Any

import viser
from markupsafe import Markup
from scipy.spatial.transform import Rotation

from finlab.errors import FinlabError
from finlab.files.worker import in_worker
from finlab.layout import Layout
from finlab.layout.body import HULL_SHAPES, MESH_SUFFIXES, Hull
from finlab.swim.hull import contradicts, displaced, hull_of, lift_of
from finlab.swim.hull.mesh_file import LENGTH_MAX, MAX_BYTES, MAX_FACES, turned
from finlab.swim.hull.surface import UNITS
from finlab.swim.vehicle.fossen import GRAVITY
from webapp.markup.words import html, three_digits
from webapp.page import Page
from webapp.panels.pairs import telling_pairs
from webapp.session.files import reshaped_hull, stored_hull
from webapp.session.layout_edits import center_of_gravity, with_hull

MESH = "mesh file"
"""What the choice of a shape says where the hull comes from a file."""
MESHES = ",".join(MESH_SUFFIXES)
"""Endings of the files that are taken."""
SHORTEST = 0.1
"""Length of a hull [m] below which another unit is meant."""
SIDE_RANGE: dict[str, Any] = {"min": (0.02,) * 3, "max": (5.0,) * 3, "step": 0.01}
"""Limits and step of the sides of a shape [m]."""


def add_hull(page: Page) -> None:
    """Widgets about the hull: its shape and size, the centre of gravity, a file."""
    _add_shape(page)
    hint = "Centre of gravity as seen from the hull's middle. Torques are about it."
    center = page.gui.add_vector3("Centre of gravity [m]", (0.0, 0.0, 0.0), step=0.005, hint=hint)
    put = telling_pairs(page, page.session.set_center_of_gravity)
    page.bind_number(center, put, center_of_gravity)
    _add_import(page)
    page.add_html(_report, visible=lambda layout: bool(_report(layout)))
    _add_turns(page)


def _add_shape(page: Page) -> None:
    """A parametric shape, and its size."""
    session = page.session

    def choose_shape(shape: str) -> None:
        if shape != MESH:
            session.set_hull(shape, _size(session.state.layout))

    def resize(size: tuple[float, float, float]) -> None:
        shape = _shape(session.state.layout)
        if shape != MESH:
            session.set_hull(shape, size)

    shapes = page.gui.add_dropdown(
        "Shape", (*HULL_SHAPES, MESH), hint="For the picture, and for estimates."
    )
    page.bind(shapes, choose_shape, _shape)
    sides = page.gui.add_vector3(
        "Size [m]", (0.5, 0.3, 0.2), **SIDE_RANGE, hint="Length, width and height of a shape."
    )
    page.bind_number(sides, resize, _size)
    page.board.show(sides, disabled=lambda layout: _shape(layout) == MESH)


def _add_import(page: Page) -> None:
    """A button for a mesh file, which may be dropped on the page as well."""

    def load(name: str, content: bytes) -> None:
        def make() -> Hull:
            return _drawn(page, in_worker(stored_hull, name, content))

        page.deferred.make(make, partial(_ask_for_unit, page), "hull")

    page.opening.add(MESHES, load)
    page.add_upload(
        "Import a hull (STL, OBJ, GLB)",
        load,
        icon=viser.Icon.UPLOAD,
        mime_type=MESHES,
        hint=f"Up to {MAX_BYTES // 1_000_000} MB; more than {MAX_FACES:,} triangles are "
        "simplified.",
    )


def _ask_for_unit(page: Page, hull: Hull) -> None:
    """Take a hull whose file does not say in which unit it is: where it need not be metres, the
    user says it."""
    half = hull_of(with_hull(page.session.state.layout, hull)).half
    side = 2.0 * max(half) / hull.scale
    lengths = {}
    for word, scale in UNITS.items():
        if SHORTEST <= side * scale <= LENGTH_MAX:
            lengths[word] = side * scale
    if list(lengths) in (["m"], []):
        _import_hull(page, hull)
        return
    answers = {}
    for word, length in lengths.items():
        scaled = replace(hull, scale=UNITS[word])
        answers[f"{word}: {length:.3g} m long"] = partial(_import_hull, page, scaled)
    text = f"Its longest side is {side:.4g} of them."
    page.ask("In which unit is this file?", text, answers)


def _import_hull(page: Page, hull: Hull) -> None:
    """Put a hull on the robot, and offer other estimates where its buoyancy contradicts the
    body's."""
    session = page.session
    session.import_hull(hull)
    session.show_task("Design")
    session.select(None)  # so that the report is seen, wherever the file was dropped
    layout = session.state.layout
    if layout.body is None or not contradicts(layout):
        return
    water = three_digits(displaced(layout))
    buoyancy = three_digits(lift_of(layout.body) / GRAVITY)
    text = f"This hull encloses {water} kg of water, the body's buoyancy is that of {buoyancy} kg."
    answers = {
        "All": partial(session.estimate, True),
        "All but the mass": partial(session.estimate),
    }
    page.ask("Estimate anew from the hull?", text, answers)


def _add_turns(page: Page) -> None:
    """Buttons that turn a mesh."""
    session = page.session

    def turn(axis: str) -> None:
        hull = _described(session.state.layout)
        rotation = Rotation.from_euler(axis, 90.0, degrees=True)
        if hull is None:
            raise FinlabError("the hull is drawn from a shape; import a mesh first")
        matrix = rotation.as_matrix()
        name = f"Turn the hull about {axis}"

        def make() -> Hull:
            return _drawn(page, reshaped_hull(hull, lambda mesh: turned(mesh, matrix)))

        page.deferred.make(make, partial(replace_hull, name, hull), "hull")

    def replace_hull(name: str, old: Hull, new: Hull) -> None:
        if _described(session.state.layout) != old:
            raise FinlabError("the hull has been changed in the meantime; do it again")
        session.import_hull(new, name)

    turns = {axis: partial(turn, axis) for axis in ("x", "y", "z")}
    hint = "A quarter turn about the body's axis, by the right-hand rule."
    buttons = page.add_buttons("Turn by 90°", turns, hint=hint)
    page.board.show(buttons, visible=lambda layout: _shape(layout) == MESH)


def _drawn(page: Page, hull: Hull) -> Hull:
    """The same hull, whose drawing is known from now on: that takes its time. Not on the event
    loop."""
    hull_of(with_hull(page.session.state.layout, hull))
    return hull


def _described(layout: Layout) -> Hull | None:
    """The hull that the layout describes; None where one is drawn that fits the actuators."""
    return None if layout.body is None else layout.body.hull


def _shape(layout: Layout) -> str:
    """The hull's parametric shape; `MESH` where it comes from a file."""
    shape = hull_of(layout).shape
    return shape if shape in HULL_SHAPES else MESH


def _size(layout: Layout) -> tuple[float, float, float]:
    """Length, width and height of the hull [m]."""
    x, y, z = hull_of(layout).half
    return 2 * x, 2 * y, 2 * z


def _report(layout: Layout) -> str:
    """What was found in the hull's file, and mended; nothing where it is a shape."""
    hull = hull_of(layout)
    report = hull.report
    if report is None:
        return ""
    size = " × ".join(f"{2.0 * half:.3g}" for half in hull.half)
    closed: str = "watertight"
    if not report.is_watertight:
        closed = Markup("<span class='missing'>not quite closed</span>")
    mended = " Nothing had to be mended."
    if report.mended:
        mended = f" Mended: {'; '.join(report.mended)}."
    return html(
        "<div class='fl'>{} m, {:,} triangles, {}.{}</div>", size, report.triangles, closed, mended
    )
