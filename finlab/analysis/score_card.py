"""The score card of a layout: authority, losses and powers; and a quick check without powers."""

import math
from collections.abc import Collection
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation import Allocator
from finlab.allocation.power_budget import budget_of
from finlab.allocation.question import check_flow
from finlab.analysis.authority import AXES, Authority, HeldAxes, Loss, authority, held_axes, losses
from finlab.analysis.card_text import card_blocks
from finlab.arrays import Array
from finlab.axes import MotionAxis
from finlab.display import html, text
from finlab.display.pictures import ranges_picture
from finlab.forces.force_sets import cut_actuators, force_sets, not_convex
from finlab.forces.within_budget import counts_budget
from finlab.layout import Layout
from finlab.physics.objective import REACHED


def least_power(
    layout: Layout,
    wrenches: ArrayLike,
    *,
    lost: Collection[str] = (),
    flow: ArrayLike | None = None,
) -> Array:
    """Returns the least power for each wrench, (N,) [W]; NaN where it is out of reach, or of the
    power budget of the layout where method `dual` keeps it.

    Args:
        layout: the layout.
        wrenches: wrenches (N, 6) [N, N m].
        lost: names of actuators that are lost.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.

    Raises:
        LayoutError: there is no actuator of a name in `lost`.
    """
    wrenches_asked = np.asarray(wrenches, dtype=np.float64).reshape(-1, 6)
    if len(set(layout.indices(tuple(lost), "lost"))) == layout.n:
        return np.where((wrenches_asked == 0.0).all(-1), 0.0, np.nan)
    power = math.inf if budget_of(layout) is not None and _refused_by_dual(layout) else None
    answer = Allocator(layout).allocate_batch(
        wrenches_asked, lost=tuple(lost), flow=flow, power=power
    )
    return np.where(answer.err_norm <= REACHED, answer.power, np.nan)


UNIT_WRENCH = (1.0, 1.0, 1.0, 0.1, 0.1, 0.1)
"""Wrench along each axis whose least power is on the card [N, N m]."""


@dataclass(frozen=True)
class ScoreCard:
    """Authority, losses and powers of a layout's working actuators. Torques meet forces at the
    lever 0.2 m."""

    layout: str
    """Name of the layout."""
    lost: tuple[str, ...]
    """Names of actuators that are lost."""
    flow: tuple[float, ...] | None
    """Velocity of the body relative to the water (6,) [m/s, rad/s], body frame; None at rest."""
    n_actuators: int
    """Number of working actuators."""
    counted: str
    """The same by type, such as `8 thrusters`."""
    authority: Authority
    """Rank, condition, largest wrenches and weakest direction."""
    losses: tuple[Loss, ...]
    """Cost of the loss of each working actuator; none when only one works."""
    unit_wrench: tuple[float, ...]
    """Size of the wrench along each axis whose least power follows (6,) [N, N m]."""
    unit_power: tuple[float | None, ...]
    """Least power [W] for it along each positive axis (6,), other axes zero; None where out of
    reach."""
    notes: tuple[str, ...]
    """Sentences on where these numbers are not exact; none when they are."""

    @property
    def worst_loss(self) -> Loss | None:
        """The loss that leaves least: the lowest rank, then the weakest direction, then the
        smallest shares."""
        return min(self.losses, key=_rank_of_loss, default=None)

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
    """Returns the score card of a layout.

    Args:
        layout: the layout.
        lost: names of actuators that are lost.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.

    Raises:
        LayoutError: there is no actuator of a name in `lost`.
        CommandError: `flow` is not six finite numbers.
    """
    water = check_flow(flow)
    present = authority(layout, lost, water)
    power = least_power(layout, np.diag(UNIT_WRENCH), lost=lost, flow=water)
    power = np.where(present.largest, power, np.nan)
    lost_names = set(lost)
    return ScoreCard(
        layout=layout.name,
        lost=tuple(name for name in layout.names if name in lost_names),
        flow=None if water is None else tuple(water.tolist()),
        n_actuators=layout.n - len(lost_names),
        counted=_counts_in_words(layout, lost_names),
        authority=present,
        losses=losses(layout, lost, present, water),
        unit_wrench=UNIT_WRENCH,
        unit_power=tuple(None if np.isnan(value) else float(value) for value in power),
        notes=_notes(layout, lost, water),
    )


def _counts_in_words(layout: Layout, lost: Collection[str]) -> str:
    """Number of actuators of each type that are not lost, such as `3 fins`."""
    if len(lost) == layout.n:
        return "0 actuators"
    return layout.without(lost).counts_in_words


def _rank_of_loss(loss: Loss) -> tuple[float, ...]:
    """A key that orders losses: the least is the worst."""
    shares = [share for share in loss.share_left if share is not None]
    return loss.rank, round(loss.weakest, 6), len(loss.reachable), round(sum(shares), 6)


def _notes(layout: Layout, lost: Collection[str], flow: Array | None) -> tuple[str, ...]:
    """Sentences on where the numbers of the card are not exact."""
    sets = force_sets(layout, lost, flow)
    notes = []
    n_split = len(not_convex(sets))
    if n_split:
        subject = "The weakest direction is"
        if n_split > len(cut_actuators(sets)):
            subject = "Largest wrenches, the weakest direction and energies are"
        reason = "some arcs are wider than half a turn but not full circles"
        if any(getattr(each, "barred", ()) for each in layout.actuators):
            reason = "some actuators have several arcs"
        notes.append(f"{subject} of the convex hull: {reason}.")
    if budget_of(layout) is not None:
        notes.append(_note_on_budget(layout, flow))
    pushed_by_flow = [name for name in layout.flow_driven if name not in lost]
    if flow is not None and pushed_by_flow:
        notes.append("Forces of the flow count with the convex hull of their lift and drag.")
    if flow is None and pushed_by_flow:
        notes.append(
            f"At rest {', '.join(pushed_by_flow)} give nothing; say how fast the robot moves "
            "(--flow)."
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


def _note_on_budget(layout: Layout, flow: Array | None) -> str:
    """What counts the power budget of a layout."""
    if not counts_budget(layout, flow):
        return (
            "The layout's power budget does not count: what actuators take that the flow drives is "
            "not the power of a force alone."
        )
    if _refused_by_dual(layout):
        return (
            "Largest wrenches and the weakest direction are within the layout's power budget, the "
            "powers are not: method dual keeps none for such a robot."
        )
    return (
        "Largest wrenches, the weakest direction and powers are within the layout's power budget."
    )


def _refused_by_dual(layout: Layout) -> bool:
    """Whether method `dual` keeps no power budget for a robot."""
    has_rudder = any(actuator.KIND.driven_by_flow for actuator in layout.actuators)
    return has_rudder or layout.interaction is not None


@dataclass(frozen=True)
class QuickCheck(HeldAxes):
    """Axes along which the working actuators can push, and those that a loss costs."""

    actuators: str
    """The working actuators by type, such as `8 thrusters`."""
    lost: tuple[tuple[str, tuple[MotionAxis, ...]], ...]
    """Working actuators with the axes that the loss of each costs; those that cost none are left
    out."""


def quick_check(
    layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None
) -> QuickCheck:
    """Returns the axes along which the working actuators can push, from singular values alone: in a
    millisecond.

    Args:
        layout: the layout.
        lost: names of actuators that are lost.
        flow: as for `score_card`.

    Raises:
        LayoutError: there is no actuator of a name in `lost`.
    """
    working = [name for name in layout.names if name not in lost]
    single_losses = working if len(working) > 1 else []
    sets = force_sets(layout, lost, check_flow(flow)).tile(1 + len(single_losses))
    for row, name in enumerate(single_losses, start=1):
        sets.lose(row, layout.index(name))
    present, *after_losses = held_axes(layout, sets)
    costs = {
        name: tuple(axis for axis in present.alone if axis not in after.alone)
        for name, after in zip(single_losses, after_losses, strict=True)
    }
    return QuickCheck(
        **vars(present),
        actuators=_counts_in_words(layout, set(lost)),
        lost=tuple((name, axes) for name, axes in costs.items() if axes),
    )
