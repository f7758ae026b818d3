"""A score card in words: its sentences, and the columns of its tables.

A `ScoreCard` prints itself by this module, so `finlab layout show` does, and the app's panel
(`webapp/markup/score_card.py`) shows the same sentences and columns.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from finlab.analysis.authority import AXES, Authority, HeldAxes, Loss
from finlab.axes import UNITS, MotionAxis
from finlab.display import (
    Block,
    Column,
    Table,
    percent,
    prefix_of,
    table_of,
    three_digits,
    with_unit,
)

ScoreCard = Any
"""`finlab.analysis.ScoreCard`, which shows itself by what is here."""
SMALL_COMPONENT = 0.05
"""Components of the weakest direction below this size are left out."""


class Remark(NamedTuple):
    """A sentence about a layout."""

    text: str
    is_warning: bool = False
    """Whether it says what the actuators cannot do; the app shows that in another colour."""


class AxisRow(NamedTuple):
    """What a card says of one axis that the robot commands."""

    axis: MotionAxis
    unit: str
    """Of a wrench along it."""
    largest: float
    """Largest wrench along it [N or N m]."""
    most_negative: float
    """The same the other way, as a size [N or N m]."""
    share_after_loss: float | None
    """Least share of these that the loss of one actuator leaves; None where none can be lost."""
    power: float | None
    """Least power of `UNIT_WRENCH` along it [W]; None where that is out of reach."""


LARGEST = Column(
    "largest",
    lambda row: range_words(row.largest, row.most_negative),
    hint="the largest wrench along this axis with the other five at zero",
)
"""The one column of an axis that the app shows of two cards beside each other."""
AXIS_COLUMNS = (
    Column("axis", lambda row: row.axis, is_text=True),
    Column("unit", lambda row: row.unit, is_text=True),
    LARGEST,
    Column(
        "one lost",
        lambda row: row.share_after_loss,
        digits=percent,
        hint="the least share of it that is left after the loss of one",
    ),
    Column("power at 1 N, 0.1 N m", lambda row: row.power, "W", hint="the least power for so much"),
)
"""Columns of the table of axes; a row is an `AxisRow`."""

WITHOUT = Column("without", lambda loss: loss.actuator, is_text=True)
WEAKEST_LEFT = Column("weakest", lambda loss: loss.weakest, "N")
AXES_LOST = Column("loses", lambda loss: ", ".join(loss.lost) or "nothing", is_text=True)


def _share_column(k: int, axis: MotionAxis) -> Column:
    """Share of the largest wrench along axis k that is left after a loss."""
    return Column(axis, lambda loss: loss.share_left[k], digits=percent)


LOSS_COLUMNS = (
    WITHOUT,
    Column("rank", lambda loss: loss.rank, digits=str),
    WEAKEST_LEFT,
    *(_share_column(k, axis) for k, axis in enumerate(AXES)),
    AXES_LOST,
)
"""Columns of the table of losses; a row is a `Loss`."""
CARD_COLUMNS = (
    Column("weakest direction", lambda card: card.authority.weakest, "N"),
    Column(
        "weakest after the worst loss",
        lambda card: None if card.worst_loss is None else card.worst_loss.weakest,
        "N",
    ),
)
"""Figures of a whole robot; a row is a `ScoreCard`."""


def card_blocks(card: ScoreCard) -> list[Block]:
    """Returns everything on a score card as sentences and tables."""
    remarks = held_remarks(card.authority, card.counted)
    lines = [remark.text for remark in remarks]
    if card.lost:
        lines.insert(1, f"Lost: {', '.join(card.lost)}.")
    blocks: list[Block] = [
        "\n".join(lines),
        table_of(AXIS_COLUMNS, [_prefixed(row) for row in axis_rows(card)]),
        _evenness(card.authority),
    ]
    if card.losses:
        blocks.append(_loss_table(card))
    if card.notes:
        blocks.append("\n".join(card.notes))
    return blocks


def held_remarks(held: HeldAxes, counted: str) -> list[Remark]:
    """Returns sentences on the axes along which actuators push, before any limit.

    Args:
        held: these axes.
        counted: the actuators that work, by type, such as `8 thrusters`.
    """
    is_single = counted.startswith("1 ") and " and " not in counted
    sentence = (
        f"{counted} {'pushes' if is_single else 'push'} in {held.rank} of {held.counted} "
        "independent directions"
    )
    if held.condition is not None:
        sentence += f", condition number {three_digits(held.condition)}"
    remarks = [Remark(f"{sentence}.")]
    if held.free:
        remarks.append(Remark(f"Not commanded, free: {', '.join(held.free)}."))
    if held.without_authority:
        axes = ", ".join(held.without_authority)
        remarks.append(Remark(f"Out of reach: {axes}.", is_warning=True))
    if held.coupled:
        axes = ", ".join(held.coupled)
        remarks.append(Remark(f"Only together with other axes: {axes}.", is_warning=True))
    return remarks


def axis_rows(card: ScoreCard) -> list[AxisRow]:
    """Returns a row for each axis that the robot commands."""
    authority = card.authority
    rows = []
    for k, axis in enumerate(AXES):
        if axis in authority.free:
            continue
        shares = []
        for loss in card.losses:
            if loss.share_left[k] is not None:
                shares.append(loss.share_left[k])
        row = AxisRow(
            axis=axis,
            unit=UNITS[k],
            largest=authority.largest[k],
            most_negative=authority.most_negative[k],
            share_after_loss=min(shares, default=None),
            power=card.unit_power[k],
        )
        rows.append(row)
    return rows


def _prefixed(row: AxisRow) -> AxisRow:
    """A row whose wrenches are in thousands or millions of their unit where they are large."""
    prefix = prefix_of(max(row.largest, row.most_negative))
    return row._replace(
        unit=f"{prefix.symbol}{row.unit}",
        largest=row.largest / prefix.factor,
        most_negative=row.most_negative / prefix.factor,
    )


def range_words(positive: float, negative: float) -> str:
    """Returns the largest wrench along an axis with either sign: `±2.32`, `+2.32 -1.10`, `none`.

    Args:
        positive: along the axis [N or N m].
        negative: against it, as a size.
    """
    if positive == negative == 0.0:
        return "none"
    forward = three_digits(positive)
    backward = three_digits(negative)
    return f"±{forward}" if forward == backward else f"+{forward} -{backward}"


def _evenness(authority: Authority) -> str:
    """Sentences on the weakest direction and the singular values."""
    components = []
    for value, axis in zip(authority.weakest_direction, AXES, strict=True):
        if abs(value) > SMALL_COMPONENT:
            components.append((value, axis))
    components.sort(key=lambda component: -abs(component[0]))
    direction = ", ".join(f"{axis} {value:+.2f}" for value, axis in components)
    prefix = prefix_of(max(authority.singular_values))
    values = " ".join(three_digits(value / prefix.factor) for value in authority.singular_values)
    weakest = with_unit(authority.weakest, "N")
    return (
        f"Weakest direction: {weakest} along {direction} (torques over "
        f"0.2 m).\nSingular values {values} {prefix.symbol}N."
    )


def _loss_table(card: ScoreCard) -> Table:
    """What is left after the loss of each actuator; the worst one has a star."""
    is_of_fins = card.counted.endswith(" fins") and " and " not in card.counted
    actuator = "fin" if is_of_fins else "actuator"
    title = (
        f"Share of the largest wrench that is left without one {actuator} (* the worst to lose):"
    )
    worst = card.worst_loss

    def name(loss: Loss) -> str:
        return f"{loss.actuator} *" if loss is worst else loss.actuator

    starred = Column(WITHOUT.name, name, is_text=True)
    return table_of((starred, *LOSS_COLUMNS[1:]), card.losses, title)
