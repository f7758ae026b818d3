"""What the user should know of a robot's fins before trusting any answer, whatever the method."""

from functools import lru_cache

import numpy as np

from finlab.layout import Layout
from finlab.physics import TableLaw, make_law
from finlab.physics.fin_model import file_stamp
from finlab.physics.plant import plant_of

RESTLESS = 0.05
"""Share of its largest force below which a fin counts as able to rest."""
STEPS = (5, 5, 16)
"""Amplitudes, frequencies and zero directions at which a fin is asked for its smallest and largest force."""
BEYOND = 1e-6
"""By how much [rad, Hz] limits may exceed a table unnoticed."""


def fin_notes(layout: Layout) -> tuple[str, ...]:
    """Returns a sentence for each fin that cannot rest, and for each that may leave its table.

    Neither is an error: a servo may be stuck, or a fin may have been damaged so that it runs on.
    """
    return _made(layout, tuple(file_stamp(fin.model) for fin in layout.fins))


@lru_cache(maxsize=256)
def _made(layout: Layout, stamps: tuple[tuple[int, int] | None, ...]) -> tuple[str, ...]:
    return (*_restless(layout), *_beyond_tables(layout))


def _restless(layout: Layout) -> list[str]:
    plant = plant_of(layout)
    grid = np.meshgrid(*(np.linspace(0.0, 1.0, count) for count in STEPS), indexing="ij")
    share = np.stack(grid, axis=-1).reshape(-1, 1, 3)
    size = np.linalg.norm(plant.force(plant.lower + share * plant.width), axis=-1)
    least, most = size.min(axis=0), size.max(axis=0)
    return [
        f"fin {name} cannot rest: within its limits it always pushes with at least {least[i]:.3g} N of at "
        f"most {most[i]:.3g} N; wrenches that need less of it are out of reach"
        for i, name in enumerate(layout.names)
        if least[i] > RESTLESS * most[i]
    ]


def _beyond_tables(layout: Layout) -> list[str]:
    notes = []
    for fin in layout.fins:
        law = make_law(fin.model)
        if not isinstance(law, TableLaw):
            continue
        for name, unit, limits, covered in zip(
            ("half amplitudes", "frequencies"),
            ("rad", "Hz"),
            (fin.limits.amplitude, fin.limits.frequency),
            law.covers,
            strict=False,
        ):
            if limits[0] < covered[0] - BEYOND or limits[1] > covered[1] + BEYOND:
                notes.append(
                    f"fin {fin.name} may be asked for {name} of {limits[0]:.3g} to {limits[1]:.3g} {unit}, "
                    f"its table holds {covered[0]:.3g} to {covered[1]:.3g}: beyond, its edge is taken"
                )
    return notes
