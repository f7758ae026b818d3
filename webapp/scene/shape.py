"""A mesh node whose shape is computed again only when what it depends on has changed."""

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from webapp.handles import put
from webapp.scene.meshes.mesh import NOTHING, Mesh
from webapp.theme import Rgb


class Shape:
    """A node and the arguments that its present shape was made from."""

    def __init__(
        self, scene: viser.SceneApi, name: str, color: Rgb, mesh: Mesh = NOTHING, **options: Any
    ) -> None:
        """Add the node; `options` as viser's `add_mesh_simple` takes them.

        Shadows fall on the floor alone: on round shapes the map of shadows draws stripes.
        """
        self.node = scene.add_mesh_simple(
            name, mesh.vertices, mesh.faces, color=color, receive_shadow=False, **options
        )
        self._made_from: tuple[Any, ...] | None = None

    def show(self, make: Callable[..., Mesh], *arguments: Any) -> None:
        """Give the node the shape `make(*arguments)`; always called with the same function."""
        key = tuple(a.tobytes() if isinstance(a, np.ndarray) else a for a in arguments)
        if key == self._made_from:
            return
        self.become(make(*arguments))
        self._made_from = key

    def become(self, mesh: Mesh) -> None:
        """Give the node another shape."""
        self.node.vertices = mesh.vertices.astype(np.float32)
        put(self.node, faces=mesh.faces.astype(np.uint32))
