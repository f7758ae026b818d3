"""The hull: a shape with a size, or a mesh file that is looked at, turned."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import viser
from markupsafe import Markup
from scipy.spatial.transform import Rotation

from finlab.errors import FinlabError
from finlab.layout.body import HULL_SHAPES, MESH_SUFFIXES, Hull
from webapp.handles import put
from webapp.markup.html import html
from webapp.page import Page
from webapp.scene.meshes.hull import hull_of
from webapp.scene.meshes.mesh import Mesh
from webapp.scene.meshes.mesh_file import (
    MAX_BYTES,
    MAX_FACES,
    turned,
)
from webapp.scene.meshes.mesh_hull import UNITS, MeshHull
from webapp.session.files import reshaped_hull, stored_hull
from webapp.session.layout_edits import center_of_gravity, with_hull
from webapp.session.state import chosen

MESH = "mesh file"
"""Entry of the list of shapes while the hull comes from a file."""
MESHES = ",".join(MESH_SUFFIXES)
"""How the names of files of hulls end."""
TURNS = ("x", "y", "z")
"""Axes that a hull from a file can be turned about."""


class HullPanel:
    """Widgets about the hull."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        shapes = gui.add_dropdown("Shape", (*HULL_SHAPES, MESH), hint="For the picture, and for To hull.")
        page.bind(shapes, self._choose_shape, lambda: self._shape or MESH)
        ends: dict[str, Any] = {"min": (0.02,) * 3, "max": (5.0,) * 3, "step": 0.01}
        sides = "Length, width and height of a shape."
        self._size = page.bind_number(
            gui.add_vector3("Size [m]", (0.5, 0.3, 0.2), **ends, hint=sides),
            self._resize,
            lambda: tuple(2 * v for v in hull_of(page.session.state.layout).half),
        )
        about = "Centre of gravity as seen from the hull's middle. Torques are about it."
        page.bind_number(
            gui.add_vector3("Centre of gravity [m]", (0.0, 0.0, 0.0), step=0.005, hint=about),
            page.session.set_center_of_gravity,
            lambda: center_of_gravity(page.session.state.layout),
        )
        hint = "What 1 means in the mesh file; of one that is here, too."
        self._unit = page.bind(
            gui.add_dropdown("Unit of file", tuple(UNITS), hint=hint), self._choose_unit, self._unit_now
        )
        page.opening.add(MESHES, self._import)
        page.add_upload(
            "Import a hull (STL, OBJ, GLB)",
            self._import,
            icon=viser.Icon.UPLOAD,
            mime_type=MESHES,
            hint=f"Up to {MAX_BYTES // 1_000_000} MB; more than {MAX_FACES:,} triangles are simplified.",
        )
        self._report = gui.add_html("")
        turns = {axis: partial(self._turn, axis) for axis in TURNS}
        hint = "A quarter turn about the body's axis, by the right-hand rule."
        self._turns = page.add_buttons("Turn by 90°", turns, hint=hint)

    def _import(self, name: str, content: bytes) -> None:
        read = partial(stored_hull, name, content, self._page.session.mesh_unit)
        self._page.reading.read(read, self._take, self._drawn)

    def _drawn(self, hull: Hull) -> Hull:
        """The same hull, whose drawing is known from now on: that takes its time. Not on the event loop."""
        hull_of(with_hull(self._page.session.state.layout, hull))
        return hull

    def _take(self, hull: Hull) -> None:
        session = self._page.session
        session.import_hull(hull)
        session.show_task("Design")
        session.select(None)  # so that the report is seen, wherever the file was dropped

    def _choose_unit(self, unit: str) -> None:
        """Another unit, for the next file and for the one that is here; a reshaped one is in metres."""
        session, hull = self._page.session, self._hull
        session.mesh_unit = chosen(unit, "unit", UNITS)
        if hull is not None and hull.mesh is not None:
            session.import_hull(replace(hull, scale=UNITS[unit]), "Unit of the hull")

    def _unit_now(self) -> str:
        """The unit of the mesh that is here, else the one for the next."""
        hull = self._hull
        scale = None if hull is None or hull.mesh is None else hull.scale
        return next((unit for unit, factor in UNITS.items() if factor == scale), self._page.session.mesh_unit)

    @property
    def _hull(self) -> Hull | None:
        """The hull as the layout describes it."""
        body = self._page.session.state.layout.body
        return None if body is None else body.hull

    def _reshape(self, name: str, change: Callable[[Mesh], Mesh]) -> None:
        hull = self._hull
        if hull is None:
            raise FinlabError("the hull is drawn from a shape; import a mesh first")
        self._page.reading.make(
            lambda: self._drawn(reshaped_hull(hull, change)), partial(self._put_on, name, hull)
        )

    def _put_on(self, name: str, before: Hull, hull: Hull) -> None:
        if self._hull != before:
            raise FinlabError("the hull has been changed in the meantime; do it again")
        self._page.session.import_hull(hull, name)
        self._page.session.mesh_unit = "m"

    def _turn(self, axis: str) -> None:
        rotation = Rotation.from_euler(axis, 90.0, degrees=True).as_matrix()
        self._reshape(f"Turn the hull about {axis}", lambda mesh: turned(mesh, rotation))

    @property
    def _shape(self) -> str | None:
        """The hull's parametric shape; None where it comes from a file."""
        shape = hull_of(self._page.session.state.layout).shape
        return shape if shape in HULL_SHAPES else None

    def _choose_shape(self, shape: str) -> None:
        if shape != MESH:
            x, y, z = hull_of(self._page.session.state.layout).half
            self._page.session.set_hull(shape, (2 * x, 2 * y, 2 * z))

    def _resize(self, size: tuple[float, float, float]) -> None:
        if self._shape is not None:
            self._page.session.set_hull(self._shape, size)

    def refresh(self) -> None:
        is_mesh = self._shape is None
        put(self._size, disabled=is_mesh)
        put(self._turns, visible=is_mesh)
        drawn = hull_of(self._page.session.state.layout)
        text = _report(drawn) if isinstance(drawn, MeshHull) else ""
        put(self._report, content=text, visible=bool(text))


def _report(hull: MeshHull) -> str:
    """What was found in the hull's file, and mended."""
    report = hull.report
    size = " × ".join(f"{2.0 * half:.3g}" for half in hull.half)
    closed = "watertight" if report.is_watertight else Markup("<span class='missing'>not quite closed</span>")
    mended = f" Mended: {'; '.join(report.mended)}." if report.mended else " Nothing had to be mended."
    return html("<div class='fl'>{} m, {:,} triangles, {}.{}</div>", size, report.triangles, closed, mended)
