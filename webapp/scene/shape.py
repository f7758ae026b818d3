"""A mesh node whose shape is computed again only when what it depends on has changed."""

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from webapp.scene.meshes.mesh import Mesh


class Shape:
    """A node and the arguments that its present shape was made from."""

    def __init__(self, node: viser.MeshHandle) -> None:
        """Take over a mesh node."""
        self.node = node
        self._made_from: tuple[Any, ...] | None = None

    def show(self, make: Callable[..., Mesh], *arguments: Any) -> None:
        """Give the node the shape `make(*arguments)`; always called with the same function."""
        key = tuple(a.tobytes() if isinstance(a, np.ndarray) else a for a in arguments)
        if key == self._made_from:
            return
        mesh = make(*arguments)
        self.node.vertices = mesh.vertices.astype(np.float32)
        if not np.array_equal(self.node.faces, mesh.faces):
            self.node.faces = mesh.faces.astype(np.uint32)
        self._made_from = key
