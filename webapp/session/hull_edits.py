"""Changes of the hull: another shape or size, and where the centre of gravity lies in it."""

from dataclasses import replace

import numpy as np

from finlab.errors import FinlabError
from finlab.layout import Body, Layout
from finlab.layout.body import HULL_SHAPES, Hull
from webapp.scene.meshes.hull import hull_of
from webapp.session.state import number

Vector = tuple[float, float, float]


def shaped(layout: Layout, shape: str, size: Vector) -> Layout:
    """The layout with a parametric hull of a size [m]; its centre stays where it is."""
    if shape not in HULL_SHAPES:
        raise FinlabError(f"hull: expected one of {', '.join(HULL_SHAPES)}, got {shape!r:.40}")
    checked = tuple(
        number(v, f"{word} of the hull [m]", 0.02, 5.0)
        for v, word in zip(size, ("length", "width", "height"), strict=True)
    )
    return with_hull(layout, Hull(shape=shape, size_m=checked, center_m=hull_of(layout).center))


def with_hull(layout: Layout, hull: Hull) -> Layout:
    """The layout with a hull; everything else about its body stays."""
    return replace(layout, body=replace(layout.body or Body(), hull=hull))


def center_of_gravity(layout: Layout) -> Vector:
    """Where the centre of gravity lies as seen from the hull's middle [m]."""
    x, y, z = hull_of(layout).center
    return -x + 0.0, -y + 0.0, -z + 0.0


def balanced(layout: Layout, center: Vector) -> Layout:
    """The layout with the centre of gravity at a place in the hull [m].

    The body frame has its origin there, so hull, fins and the centre of buoyancy move the other way.
    """
    checked = [
        number(v, f"{axis} of the centre of gravity [m]", -2.0, 2.0)
        for v, axis in zip(center, "xyz", strict=True)
    ]
    x, y, z = np.subtract(center_of_gravity(layout), checked).tolist()

    def moved(point: tuple[float, ...]) -> Vector:
        return point[0] + x, point[1] + y, point[2] + z

    drawn = hull_of(layout)
    body = layout.body or Body()
    described = body.hull or Hull(shape=drawn.shape, size_m=tuple(2 * v for v in drawn.half))
    hull = replace(described, center_m=moved(drawn.center))
    buoyancy = body.center_of_buoyancy_m
    body = replace(body, hull=hull, center_of_buoyancy_m=None if buoyancy is None else moved(buoyancy))
    fins = tuple(replace(fin, position=moved(fin.position)) for fin in layout.fins)
    return replace(layout, fins=fins, body=body)
