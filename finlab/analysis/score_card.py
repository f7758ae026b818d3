"""Score card of a layout, for one glance, and what of it is computed in a millisecond."""

from collections.abc import Collection
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation import Allocator
from finlab.allocation.question import check_flow
from finlab.analysis.authority import (
    AXES,
    Authority,
    HeldAxes,
    Loss,
    MotionAxis,
    authority,
    held_axes,
    losses,
)
from finlab.analysis.card_text import card_blocks
from finlab.arrays import Array
from finlab.display import html, text
from finlab.display.pictures import ranges_picture
from finlab.forces.force_sets import MAX_CUT, force_sets, wide_arcs
from finlab.layout import Layout
from finlab.physics.objective import REACHED


def least_power(
    layout: Layout,
    wrenches: ArrayLike,
    *,
    lost: Collection[str] = (),
    flow: ArrayLike | None = None,
) -> Array:
    """Returns the least power [W] for each wrench (N, 6) [N, N m]: (N,), NaN where it is out of
    reach; `flow` as for an allocator. Raises LayoutError: there is no actuator of a name in
    `lost`."""
    wanted = np.asarray(wrenches, dtype=np.float64).reshape(-1, 6)
    if len(set(layout.indices(tuple(lost), "lost"))) == layout.n:
        return np.where((wanted == 0.0).all(-1), 0.0, np.nan)
    answer = Allocator(layout).allocate_batch(wanted, lost=tuple(lost), flow=flow)
    return np.where(answer.err_norm <= REACHED, answer.power, np.nan)


UNIT = (1.0, 1.0, 1.0, 0.1, 0.1, 0.1)  # wrench along each axis whose least power is given [N, N m]


@dataclass(frozen=True)
class ScoreCard:
    """What a layout's working actuators can do. Torques meet forces at the lever 0.2 m."""

    layout: str
    lost: tuple[str, ...]
    flow: tuple[float, ...] | None
    """Velocity of the body relative to the water (6,) [m/s, rad/s], body frame; None at rest."""
    n_actuators: int  # how many work
    counted: str  # the same by type, such as `8 thrusters`
    authority: Authority  # rank, conditioning, largest wrenches, weakest direction
    losses: tuple[Loss, ...]
    """What losing one more actuator costs, one by one; none when but one works."""
    unit_wrench: tuple[float, ...]
    """Size of the wrench along each axis whose least power follows (6,) [N, N m]."""
    unit_power: tuple[float | None, ...]
    """Least power [W] for it along each positive axis (6,), other axes zero; None where out of
    reach."""
    notes: tuple[str, ...]  # sentences on where these numbers are not exact; none when they are

    @property
    def worst_loss(self) -> Loss | None:
        """The loss that leaves least: the lowest rank, then the weakest direction, then the
        smallest shares."""
        return min(self.losses, key=_left, default=None)

    def __str__(self) -> str:
        return text(card_blocks(self))

    def _repr_html_(self) -> str:
        low = -np.array(self.authority.most_negative)
        high = np.array(self.authority.largest)
        title = f"{self.layout}: largest wrench along each axis"
        return html(card_blocks(self), lambda: ranges_picture(title, AXES, low, high))

    def to_dict(self) -> dict[str, Any]:
        """Returns the card as numbers, strings, lists and None, for JSON."""
        worst = None if self.worst_loss is None else self.worst_loss.actuator
        reachable = list(self.authority.reachable)
        return asdict(self) | {"axes": list(AXES), "reachable": reachable, "worst_loss": worst}


def score_card(
    layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None
) -> ScoreCard:
    """Returns the score card of a layout whose actuators called `lost` push nothing, in a flow as
    for `losses`. Raises LayoutError: there is no actuator of a name in `lost`; CommandError: `flow`
    is not six finite numbers."""
    water = check_flow(flow)
    held = authority(layout, lost, water)
    power = least_power(layout, np.diag(UNIT), lost=lost, flow=water)
    power = np.where(held.largest, power, np.nan)
    gone = set(lost)
    return ScoreCard(
        layout=layout.name,
        lost=tuple(name for name in layout.names if name in gone),
        flow=None if water is None else tuple(water.tolist()),
        n_actuators=layout.n - len(gone),
        counted=layout.without(gone).counted if len(gone) < layout.n else "0 actuators",
        authority=held,
        losses=losses(layout, lost, held, water),
        unit_wrench=UNIT,
        unit_power=tuple(None if np.isnan(value) else float(value) for value in power),
        notes=_notes(layout, lost, water),
    )


def _left(loss: Loss) -> tuple[float, ...]:
    """What is left after a loss, to compare losses by."""
    shares = [share for share in loss.share_left if share is not None]
    return loss.rank, round(loss.weakest, 6), len(loss.reachable), round(sum(shares), 6)


def _notes(layout: Layout, lost: Collection[str], flow: Array | None) -> tuple[str, ...]:
    sets = force_sets(layout, lost, flow)
    notes = []
    n_wide = len(wide_arcs(sets))
    if n_wide:
        what = "The weakest direction is"
        if n_wide > MAX_CUT:
            what = "Largest wrenches, the weakest direction and energies are"
        notes.append(
            f"{what} of the convex hull: some arcs are wider than half a turn but not full circles."
        )
    still = [name for name in layout.by_flow if name not in lost]
    if flow is not None and still:
        notes.append("Forces of the flow count with the convex hull of their lift and drag.")
    if flow is None and still:
        notes.append(
            f"At rest {', '.join(still)} give nothing; say how fast the robot moves (--flow)."
        )
    if any(fin.model.type == "table" for fin in layout.fins if fin.name not in lost):
        notes.append(
            "Fins that follow a table count with the largest thrust that was sampled from it."
        )
    if layout.interaction is not None:
        notes.append(
            "Reach and power are those of the actuators' laws: what their jets take is not in them."
        )
    return tuple(notes)


@dataclass(frozen=True)
class QuickCheck(HeldAxes):
    """Axes that the working actuators hold, and those that a loss costs."""

    lost: tuple[tuple[str, tuple[MotionAxis, ...]], ...]
    """Working actuators with the axes that the loss of each costs; those that cost none are left
    out."""


def quick_check(
    layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None
) -> QuickCheck:
    """Returns what the working actuators hold in a flow as of `score_card`, from singular values
    alone. Raises LayoutError: there is no actuator of a name in `lost`."""
    working = [name for name in layout.names if name not in lost]
    single = working if len(working) > 1 else []
    sets = force_sets(layout, lost, check_flow(flow)).tile(1 + len(single))
    for row, name in enumerate(single, start=1):
        sets.lose(row, layout.index(name))
    held, *left = held_axes(layout, sets)
    costs = {
        name: tuple(axis for axis in held.alone if axis not in after.alone)
        for name, after in zip(single, left, strict=True)
    }
    return QuickCheck(
        **vars(held), lost=tuple((name, axes) for name, axes in costs.items() if axes)
    )
