"""The hull: a shape with a size, or a mesh file that is looked at, turned."""

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
from webapp.session.files import reshaped_hull, stored_hull
from webapp.session.layout_edits import center_of_gravity, with_hull

MESH = "mesh file"
MESHES = ",".join(MESH_SUFFIXES)
LEAST = 0.1
"""Length of a hull [m] below which another unit is meant."""


def add_hull(page: Page) -> None:
    """Widgets about the hull."""
    session = page.session
    gui = page.gui

    def load(name: str, content: bytes) -> None:
        page.deferred.make(
            lambda: _drawn(page, in_worker(stored_hull, name, content)), take, "hull"
        )

    def take(hull: Hull) -> None:
        """Mesh files do not say in which unit they are: where it need not be metres, the user says
        it."""
        side = 2.0 * max(hull_of(with_hull(session.state.layout, hull)).half) / hull.scale
        lengths = {
            word: side * scale
            for word, scale in UNITS.items()
            if LEAST <= side * scale <= LENGTH_MAX
        }
        if list(lengths) in (["m"], []):
            put_in(hull)
            return
        answers = {
            f"{word}: {length:.3g} m long": partial(put_in, replace(hull, scale=UNITS[word]))
            for word, length in lengths.items()
        }
        text = f"Its longest side is {side:.4g} of them."
        page.ask("In which unit is this file?", text, answers)

    def put_in(hull: Hull) -> None:
        session.import_hull(hull)
        session.show_task("Design")
        session.select(None)  # so that the report is seen, wherever the file was dropped
        layout = session.state.layout
        if layout.body is not None and contradicts(layout):
            said, water = (
                three_digits(v) for v in (lift_of(layout.body) / GRAVITY, displaced(layout))
            )
            text = (
                f"This hull encloses {water} kg of water, the body's buoyancy is that of {said} kg."
            )
            anew = {
                "All": partial(session.estimate, True),
                "All but the mass": partial(session.estimate),
            }
            page.ask("Estimate anew from the hull?", text, anew)

    def choose_shape(shape: str) -> None:
        if shape != MESH:
            session.set_hull(shape, _size(session.state.layout))

    def resize(size: tuple[float, float, float]) -> None:
        shape = _shape(session.state.layout)
        if shape != MESH:
            session.set_hull(shape, size)

    shapes = gui.add_dropdown(
        "Shape", (*HULL_SHAPES, MESH), hint="For the picture, and for estimates."
    )
    page.bind(shapes, choose_shape, _shape)
    ends: dict[str, Any] = {"min": (0.02,) * 3, "max": (5.0,) * 3, "step": 0.01}
    sides = gui.add_vector3(
        "Size [m]", (0.5, 0.3, 0.2), **ends, hint="Length, width and height of a shape."
    )
    page.board.show(
        page.bind_number(sides, resize, _size), disabled=lambda layout: _shape(layout) == MESH
    )
    about = "Centre of gravity as seen from the hull's middle. Torques are about it."
    center = gui.add_vector3("Centre of gravity [m]", (0.0, 0.0, 0.0), step=0.005, hint=about)
    page.bind_number(center, session.set_center_of_gravity, center_of_gravity)
    page.opening.add(MESHES, load)
    page.add_upload(
        "Import a hull (STL, OBJ, GLB)",
        load,
        icon=viser.Icon.UPLOAD,
        mime_type=MESHES,
        hint=f"Up to {MAX_BYTES // 1_000_000} MB; more than {MAX_FACES:,} triangles are "
        "simplified.",
    )
    page.add_html(_report, visible=lambda layout: bool(_report(layout)))
    _add_turns(page)


def _add_turns(page: Page) -> None:
    session = page.session

    def turn(axis: str) -> None:
        hull = _described(session.state.layout)
        rotation = Rotation.from_euler(axis, 90.0, degrees=True)
        if hull is None:
            raise FinlabError("the hull is drawn from a shape; import a mesh first")
        matrix = rotation.as_matrix()
        name = f"Turn the hull about {axis}"
        page.deferred.make(
            lambda: _drawn(page, reshaped_hull(hull, lambda mesh: turned(mesh, matrix))),
            partial(put_on, name, hull),
            "hull",
        )

    def put_on(name: str, before: Hull, hull: Hull) -> None:
        if _described(session.state.layout) != before:
            raise FinlabError("the hull has been changed in the meantime; do it again")
        session.import_hull(hull, name)

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
    return None if layout.body is None else layout.body.hull


def _shape(layout: Layout) -> str:
    """The hull's parametric shape; `MESH` where it comes from a file."""
    shape = hull_of(layout).shape
    return shape if shape in HULL_SHAPES else MESH


def _size(layout: Layout) -> tuple[float, float, float]:
    x, y, z = hull_of(layout).half
    return 2 * x, 2 * y, 2 * z


def _report(layout: Layout) -> str:
    """What was found in the hull's file, and mended; nothing where it is a shape."""
    hull = hull_of(layout)
    report = hull.report
    if report is None:
        return ""
    size = " × ".join(f"{2.0 * half:.3g}" for half in hull.half)
    closed = (
        "watertight"
        if report.is_watertight
        else Markup("<span class='missing'>not quite closed</span>")
    )
    mended = (
        f" Mended: {'; '.join(report.mended)}." if report.mended else " Nothing had to be mended."
    )
    return html(
        "<div class='fl'>{} m, {:,} triangles, {}.{}</div>", size, report.triangles, closed, mended
    )
