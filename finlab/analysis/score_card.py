"""What a layout can do, for one glance, and what of it is computed in a millisecond."""

from collections.abc import Collection
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from finlab.analysis.authority import (
    AXES,
    Authority,
    HeldAxes,
    Loss,
    authority,
    held_axes,
    losses,
)
from finlab.analysis.least_power import least_power
from finlab.forces.extent import singular_values
from finlab.forces.fin_sets import MAX_CUT, fin_sets, wide_fins
from finlab.layout import Layout

UNIT = (1.0, 1.0, 1.0, 0.1, 0.1, 0.1)
"""Wrench along each axis whose least power is given [N, N m]."""


@dataclass(frozen=True)
class ScoreCard:
    """What a layout's working fins can do. Torques meet forces at the lever 0.2 m."""

    layout: str
    failed: tuple[str, ...]
    n_fins: int
    authority: Authority
    """Rank, conditioning, largest wrenches, weakest direction."""
    losses: tuple[Loss, ...]
    """What losing one more fin costs, fin by fin; none when but one works."""
    unit_wrench: tuple[float, ...]
    """Size of the wrench along each axis whose least power follows (6,) [N, N m]."""
    unit_power: tuple[float | None, ...]
    """Least power [W] for it along each positive axis (6,), other axes zero; None where out of reach."""
    notes: tuple[str, ...]
    """Sentences on where these numbers are not exact; none when they are."""

    @property
    def worst_loss(self) -> Loss | None:
        """The loss that leaves least: the lowest rank, then the weakest direction, then the smallest
        shares."""
        return min(self.losses, key=_left, default=None)

    def to_dict(self) -> dict[str, Any]:
        """Returns the card as numbers, strings, lists and None, for JSON."""
        worst = None if self.worst_loss is None else self.worst_loss.fin
        reachable = list(self.authority.reachable)
        return asdict(self) | {"axes": list(AXES), "reachable": reachable, "worst_loss": worst}


def score_card(layout: Layout, failed: Collection[str] = ()) -> ScoreCard:
    """Returns the score card of a layout whose fins called `failed` push nothing.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    layout.only_fins("a score card")
    held = authority(layout, failed)
    power = least_power(layout, np.diag(UNIT), failed=failed)
    return ScoreCard(
        layout=layout.name,
        failed=tuple(name for name in layout.names if name in failed),
        n_fins=layout.n_fins - len(set(failed)),
        authority=held,
        losses=losses(layout, failed, held),
        unit_wrench=UNIT,
        unit_power=tuple(None if np.isnan(value) else float(value) for value in power),
        notes=_notes(layout, failed),
    )


def _left(loss: Loss) -> tuple[float, ...]:
    """What is left after a loss, to compare losses by."""
    shares = [share for share in loss.share_left if share is not None]
    return loss.rank, round(loss.weakest, 6), len(loss.reachable), round(sum(shares), 6)


def _notes(layout: Layout, failed: Collection[str]) -> tuple[str, ...]:
    """What is not exact."""
    sets = fin_sets(layout, failed)
    notes = []
    n_wide = len(wide_fins(sets))
    if n_wide:
        what = "Weakest direction and isotropy are"
        if n_wide > MAX_CUT:
            what = "Largest wrenches, weakest direction, isotropy and energies are"
        notes.append(
            f"{what} those of the convex hull: some arcs are wider than half a turn but not full circles."
        )
    if any(fin.model.type == "table" for fin in layout.fins if fin.name not in failed):
        notes.append("Fins that follow a table count with the largest thrust that was sampled from it.")
    return tuple(notes)


@dataclass(frozen=True)
class QuickCheck(HeldAxes):
    """Axes that the working fins hold, and those that a loss costs."""

    lost: tuple[tuple[str, tuple[str, ...]], ...]
    """Working fins with the axes that the loss of each costs; fins that cost none are left out."""


def quick_check(layout: Layout, failed: Collection[str] = ()) -> QuickCheck:
    """Returns what the working fins hold, from singular values alone.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    working = [name for name in layout.names if name not in failed]
    single = working if len(working) > 1 else []
    sets = fin_sets(layout, failed).tile(1 + len(single))
    for row, name in enumerate(single, start=1):
        sets.radius[row, layout.index(name)] = 0.0
    held, *left = (held_axes(*pair) for pair in zip(*singular_values(sets), strict=True))
    lost = {
        name: tuple(axis for axis in held.alone if axis not in after.alone)
        for name, after in zip(single, left, strict=True)
    }
    return QuickCheck(**vars(held), lost=tuple((name, axes) for name, axes in lost.items() if axes))
