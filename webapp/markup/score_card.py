"""Markup of a layout's score card, and of the quick checks below the layout's editor.

Sentences and columns are those of `finlab/analysis/card_text.py`, which the command line prints.
`panels/limits_tab.py` shows the card, `panels/cards.py` the checks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from markupsafe import Markup

from finlab.analysis import ScoreCard
from finlab.analysis.card_text import (
    AXES_LOST,
    AXIS_COLUMNS,
    CARD_COLUMNS,
    WEAKEST_LEFT,
    WITHOUT,
    AxisRow,
    Remark,
    axis_rows,
    held_remarks,
)
from finlab.analysis.score_card import QuickCheck
from finlab.axes import MotionAxis
from finlab.display import Column
from finlab.layout import Layout
from finlab.swim.hull import hull_of
from webapp.markup.answer import swatch
from webapp.markup.tables import cell_text, head_row
from webapp.markup.words import DASH, html, in_app, row
from webapp.scene.actuator_shapes import SPAN

SAME = 1e-3
"""Relative difference of two figures up to which they count as equal."""
TIP = 0.05
"""How far out on its blade a fin is asked whether it beats inside the hull [m]."""


def score_table(layout: Layout, card: ScoreCard, old_card: ScoreCard | None) -> str:
    """A score card as tables: figures of the whole robot, of each axis, and of each loss.

    Args:
        layout: the robot.
        card: what it can do.
        old_card: what could be done before, which stands beside that; None where it is the same.
    """
    markup = [_summary(card, old_card), _axes(card, old_card), _losses(layout, card)]
    for note in card.notes:
        markup.append(html("<div class='said dim'>{}</div>", in_app(note)))
    return html("<div class='fl score'>{}</div>", markup)


def remarks_markup(remarks: Sequence[Remark]) -> str:
    """Sentences one after the other; warnings stand out."""
    sentences = []
    for remark in remarks:
        template = "<span class='missing'>{}</span> " if remark.is_warning else "{} "
        sentences.append(html(template, remark.text))
    return html("{}", sentences)


def _cards(card: ScoreCard, old_card: ScoreCard | None) -> list[ScoreCard]:
    """The cards in the order of their columns."""
    return [card] if old_card is None else [old_card, card]


def _summary(card: ScoreCard, old_card: ScoreCard | None) -> str:
    """Sentences on the rank, and a table of the figures of the whole robot."""
    cards = _cards(card, old_card)
    head = ""
    if old_card is not None:
        ranks = [f"{each.authority.rank} of {each.authority.counted}" for each in cards]
        head = html(
            "<tr><th></th><th>before</th><th>now</th><th></th></tr>{}",
            row("independent directions", *ranks, ""),
        )
    sentences = remarks_markup(held_remarks(card.authority, card.counted))
    rows = [_figure_row(column, cards) for column in CARD_COLUMNS]
    return html("<div class='said'>{}</div><table>{}{}</table>", sentences, head, rows)


def _figure_row(column: Column, cards: list[ScoreCard]) -> str:
    """A row of one card, or of two and a sign that says which is better; nothing where neither has
    the figure, as the worst loss of a single fin."""
    values = [column.value(card) for card in cards]
    if all(value is None for value in values):
        return ""
    texts: list[object] = [cell_text(column, card) for card in cards]
    if len(cards) > 1:
        texts.append(_trend(values[0], values[-1]))
    return row(column.heading, *texts)


def _trend(old: float | None, new: float | None) -> str:
    """A sign of how a figure has changed; a larger one is better."""
    if old is None or new is None:
        return ""
    if abs(new - old) < SAME * max(abs(new), abs(old), 1e-9):
        return Markup("<span class=''>=</span>")
    if new > old:
        return Markup("<span class='given'>▲</span>")
    return Markup("<span class='missing'>▼</span>")


def _axes(card: ScoreCard, old_card: ScoreCard | None) -> str:
    """A row for each commanded axis; its largest wrench is that of both cards."""
    name, unit, largest, *others = AXIS_COLUMNS
    rows_by_card = [
        {each.axis: each for each in axis_rows(each)} for each in _cards(card, old_card)
    ]
    rows = []
    for axis_row in axis_rows(card):
        ranges = []
        for rows_of_card in rows_by_card:
            # An axis that was free before has no row on that card.
            axis_before = rows_of_card.get(axis_row.axis)
            ranges.append(DASH if axis_before is None else cell_text(largest, axis_before))
        # The panel has no room for a column of units: they stand beside the names.
        if old_card is not None:
            ranges.append(
                _trend(*[_width(rows_of_card, axis_row.axis) for rows_of_card in rows_by_card])
            )
        words = html("{} <span class='dim'>{}</span>", name.cell(axis_row), unit.cell(axis_row))
        figures = [cell_text(column, axis_row) for column in others]
        rows.append(row(words, *ranges, *figures))
    range_heads: list[Column] = [largest]
    if old_card is not None:
        range_heads = [
            replace(largest, name="before"),
            replace(largest, name="now"),
            replace(largest, name="", hint="better ▲, the same =, or worse ▼"),
        ]
    axis_head = Column("on its own", name.value, is_text=True)
    heads = head_row([axis_head, *range_heads, *others])
    return html("<table>{}{}</table>", heads, rows)


def _width(rows: Mapping[MotionAxis, AxisRow], axis: MotionAxis) -> float | None:
    """What can be given along an axis, both ways together [N or N m]; None where it is free."""
    axis_row = rows.get(axis)
    return None if axis_row is None else axis_row.largest + axis_row.most_negative


def _losses(layout: Layout, card: ScoreCard) -> str:
    """A row for each actuator: what is left without it. The shares of all axes, which the command
    line prints, have no room here; the table of axes has the least of them."""
    if not card.losses:
        return ""
    columns = (WEAKEST_LEFT, AXES_LOST)
    rows = []
    for loss in card.losses:
        style = "missing" if loss.lost else "dim"
        badge = swatch(layout.index(loss.actuator))
        template = "{}<span class='name' title='{}'>{}</span>"
        name = html(template, badge, loss.actuator, loss.actuator)
        template = "<tr><td>{}</td><td>{}</td><td class='words {}'>{}</td></tr>"
        texts = [cell_text(column, loss) for column in columns]
        rows.append(html(template, name, texts[0], style, texts[1]))
    return html("<table class='losses'>{}{}</table>", head_row((WITHOUT, *columns)), rows)


def check_card(quick: QuickCheck, has_several: bool, warnings: tuple[str, ...]) -> str:
    """What there is to watch while a layout is edited.

    Args:
        quick: its axes, and what single failures cost.
        has_several: whether the robot has more actuators than one.
        warnings: sentences about fins in the way.
    """
    texts = [html("<div class='missing'>{}</div>", text) for text in warnings]
    remarks = held_remarks(quick, quick.actuators)
    if quick.lost:
        costs = "; ".join([f"{name}: {', '.join(axes)}" for name, axes in quick.lost])
        remarks.append(Remark(f"A failure costs axes: {costs}.", is_warning=True))
    elif has_several:
        remarks.append(Remark("No single failure costs an axis."))
    return html(
        "<div class='fl check'>{}<div class='said'>{}</div></div>", texts, remarks_markup(remarks)
    )


def warnings(layout: Layout) -> tuple[str, ...]:
    """Sentences about fins that cannot beat where they stand; cheap enough for every step of a
    drag."""
    hull = hull_of(layout)
    sentences = []
    for fin, neighbour in combinations(layout.fins, 2):
        gap = float(np.linalg.norm(np.subtract(fin.position, neighbour.position)))
        if gap < SPAN:
            sentences.append(
                f"{fin.name} and {neighbour.name} are {gap:.2f} m apart and may touch."
            )
    for fin in layout.fins:
        if hull.contains(np.array(fin.position) + TIP * np.array(fin.frame[0])):
            sentences.append(f"{fin.name} beats inside the hull.")
    return tuple(sentences)
