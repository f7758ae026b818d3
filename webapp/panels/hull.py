"""The hull: a shape and a size, a mesh file, and where the centre of gravity lies in it."""

from functools import partial
from typing import Any

import viser

from finlab.layout.body import HULL_SHAPES
from webapp.handles import hold_kind, on_user_change, put
from webapp.panels.host import Host
from webapp.scene.meshes.hull import hull_of
from webapp.scene.meshes.mesh_hull import UNITS
from webapp.session.hull_edits import center_of_gravity
from webapp.session.hull_files import stored_hull

MESH = "mesh file"
"""Entry of the list of shapes while the hull comes from a file."""


class HullPanel:
    """Widgets of one folder."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        with gui.add_folder("Hull", expand_by_default=False):
            self._shape = gui.add_dropdown("Shape", (*HULL_SHAPES, MESH), hint="For looks and for sticking.")
            on_user_change(self._shape, self._choose_shape)
            self._size = gui.add_vector3(
                "Size [m]",
                (0.5, 0.3, 0.2),
                min=(0.02,) * 3,
                max=(5.0,) * 3,
                step=0.01,
                hint="Length, width and height of a shape.",
            )
            on_user_change(self._size, self._resize)
            self._center = gui.add_vector3(
                "Gravity [m]",
                (0.0, 0.0, 0.0),
                step=0.005,
                hint="Centre of gravity as seen from the hull's middle. Torques are about it.",
            )
            on_user_change(
                self._center, lambda value: host.do(partial(host.session.set_center_of_gravity, value))
            )
            self._unit = gui.add_dropdown("Unit of file", tuple(UNITS), hint="What 1 means in the mesh file.")
            hold_kind(self._unit)
            self._upload = gui.add_upload_button(
                "Import a hull (STL, OBJ, GLB)",
                icon=viser.Icon.UPLOAD,
                mime_type=".stl,.obj,.glb,.ply",
                hint="Up to 20 MB and 60,000 triangles.",
            )

        @self._upload.on_upload
        async def _uploaded(event: Any) -> None:
            upload = event.target.value
            unit = self._unit.value
            host.do(lambda: host.session.import_hull(stored_hull(upload.name, upload.content, unit)))

    def _choose_shape(self, shape: str) -> None:
        if shape == MESH:
            self.refresh()
            return
        half = hull_of(self._host.session.state.layout).half
        size = (2 * half[0], 2 * half[1], 2 * half[2])
        self._host.do(partial(self._host.session.set_hull, shape, size))

    def _resize(self, size: tuple[float, float, float]) -> None:
        shape = hull_of(self._host.session.state.layout).shape
        if shape in HULL_SHAPES:
            self._host.do(partial(self._host.session.set_hull, shape, size))

    def refresh(self) -> None:
        """Write the hull."""
        layout = self._host.session.state.layout
        hull = hull_of(layout)
        put(self._shape, value=hull.shape if hull.shape in HULL_SHAPES else MESH)
        put(self._size, disabled=hull.shape not in HULL_SHAPES)
        put(self._size, value=tuple(round(2 * v, 4) for v in hull.half))
        put(self._center, value=tuple(round(v, 4) for v in center_of_gravity(layout)))
