"""Links of a robot by any description: the joints that move them, and their masses together."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array

TURNING = ("revolute", "continuous")
"""Kinds of joints that turn."""


class Joint(NamedTuple):
    """A joint, in the frame of its description."""

    name: str
    kind: str
    """The type of the joint in URDF and SDF, such as `revolute`."""
    parent: str
    """The link that it is mounted on."""
    child: str
    """The link that it moves."""
    position: Array
    """(3,) [m]."""
    axis: Array
    """The axis (3,) that it turns about or slides along; of length 1 unless the joint is fixed."""
    limits: tuple[float, float]
    """Least and greatest angle [rad], infinite where nothing limits it."""


class LinkMass(NamedTuple):
    """The mass of one link, or of several together, in the axes of the description."""

    mass: float
    """[kg]."""
    center: Array
    """Its centre of gravity, (3,) [m]."""
    inertia: Array
    """(3, 3) about that centre [kg m^2]."""


def combined(links: Sequence[LinkMass]) -> LinkMass:
    """Returns the mass of all links together; inertias by the theorem of Huygens and Steiner."""
    total = sum(link.mass for link in links)
    center = np.zeros(3)
    inertia = np.zeros((3, 3))
    if total > 0.0:
        center = sum((link.mass * link.center for link in links), center) / total
        for link in links:
            arm = link.center - center
            shift = arm @ arm * np.eye(3) - np.outer(arm, arm)
            inertia += link.inertia + link.mass * shift
    return LinkMass(total, center, inertia)
