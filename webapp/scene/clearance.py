"""Fins that are in the way of each other or of the hull: what an analysis of forces does not see."""

from itertools import combinations

import numpy as np

from finlab.layout import Layout
from webapp.scene.meshes.fin import SPAN
from webapp.scene.meshes.hull import hull_of


def warnings(layout: Layout) -> tuple[str, ...]:
    """Sentences about fins that cannot beat where they stand; cheap enough for every step of a drag."""
    hull = hull_of(layout)
    sentences = []
    for a, b in combinations(layout.fins, 2):
        gap = float(np.linalg.norm(np.subtract(a.position, b.position)))
        if gap < SPAN:
            sentences.append(f"{a.name} and {b.name} are {100 * gap:.0f} cm apart and may touch.")
    for fin in layout.fins:
        shaft = np.array([np.cos(fin.mounting_angle), np.sin(fin.mounting_angle), 0.0])
        if hull.contains(np.array(fin.position) + 0.05 * shaft):
            sentences.append(f"{fin.name} beats inside the hull.")
    return tuple(sentences)
