"""Markup of two robots beside each other: their figures in one table, what each loses with one
actuator, and the status of both."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from finlab.analysis import ScoreCard
from finlab.analysis.card_text import (
    AXES_LOST,
    CARD_COLUMNS,
    LARGEST,
    WEAKEST_LEFT,
    WITHOUT,
    AxisRow,
    axis_rows,
)
from finlab.arrays import Array
from finlab.axes import MOTIONS, UNITS, MotionAxis
from finlab.display import Column, listed
from finlab.physics.objective import REACHED
from webapp.markup.answer import swatch
from webapp.markup.tables import cell_text
from webapp.markup.verdict import COLORS, WORKING, verdict_of
from webapp.markup.words import DASH, error_digits, html, three_digits
from webapp.session.two_robots import PLACES, Pair, Standing
from webapp.tasks.solver import Reply
from webapp.theme import DEAD, css

SAME = 1e-3
"""Relative difference of two figures up to which none is the better one."""
LEVER = 0.2
"""Lever over which torques count as forces [m], as for the weakest direction."""
MOST_NAMED = 2
"""Actuators that cost axes and are named; of more their number is told."""
BETTER = Markup("<span class='better-sign' title='better' role='img' aria-label='better'>✓</span>")
"""Sign beside the better one of two figures."""


class Figure(NamedTuple):
    """A figure of one robot."""

    text: str
    value: float | None
    """For the comparison; None where there is none."""


class FigureRow(NamedTuple):
    """A figure of both robots."""

    heading: str
    both: Sequence[Figure]
    """Of the left and the right one."""
    is_less_better: bool = False
    is_judged: bool = True
    """Whether one of two such figures is better than the other."""
    hint: str = ""

    @property
    def better(self) -> int | None:
        """Index of the better one; None where they are alike, or one is not known."""
        left, right = [figure.value for figure in self.both]
        if not self.is_judged or left is None or right is None:
            return None
        if abs(left - right) <= SAME * max(abs(left), abs(right), 1e-9):
            return None
        return int((right > left) != self.is_less_better)


UNKNOWN = Figure(DASH, None)
"""A figure that is not known."""


def figures_table(
    pair: Pair,
    replies: Sequence[Reply | None],
    cards: Sequence[ScoreCard | None],
    is_busy: bool = False,
) -> str:
    """The figures of both robots, the better one of each marked.

    Args:
        pair: the robots.
        replies: their answers; None while there is none.
        cards: their score cards; None while there is none.
        is_busy: whether the answers are to an earlier wrench.
    """
    groups = [
        ("At this wrench", _answer_rows(replies), is_busy),
        ("Reach", _reach_rows(pair, cards), False),
        ("Robot", _robot_rows(pair), False),
    ]
    rows = []
    for title, figures, is_old in groups:
        rows.append(html("<tr class='group'><th colspan='3'>{}</th></tr>", title))
        for figure in figures:
            rows.append(_markup_of(figure, is_old))
    head = html("<tr><th></th>{}{}</tr>", *_heads(pair))
    return html("<table class='versus'>{}{}</table>", head, rows)


def _heads(pair: Pair) -> list[str]:
    """The heads of both columns: place and name, and where each comes from where both have the same
    name."""
    heads = []
    names = [standing.state.layout.name for standing in pair.both]
    for place, standing, name in zip(PLACES, pair.both, names, strict=True):
        origin = html("<br><i>{}</i>", standing.title) if len(set(names)) == 1 else ""
        template = "<th title='{}'><i>{}</i><br><b>{}</b>{}</th>"
        heads.append(html(template, f"{name}: {standing.title}", place, name, origin))
    return heads


def _markup_of(row: FigureRow, is_old: bool) -> str:
    """A row of the table."""
    better = row.better
    cells = []
    for index, figure in enumerate(row.both):
        is_better = index == better
        style = "better" if is_better else ""
        sign = BETTER if is_better else ""
        cells.append(html("<td class='{}'>{}{}</td>", style, sign, figure.text))
    template = "<tr class='{}'><td title='{}'>{}</td>{}</tr>"
    return html(template, "dim" if is_old else "", row.hint, row.heading, cells)


def _answer_rows(replies: Sequence[Reply | None]) -> list[FigureRow]:
    """What both do for the wrench."""
    errors: list[Figure] = []
    watts: list[Figure] = []
    missing: list[Figure] = []
    for reply in replies:
        if reply is None:
            for figures in (errors, watts, missing):
                figures.append(UNKNOWN)
            continue
        answer = reply.answer
        is_exact = answer.err_norm <= REACHED
        left_undone = np.nan_to_num(answer.unallocated)
        error = "exact" if is_exact else error_digits(answer.err_norm)
        # Errors are shares of what each robot can push: between two that fall short, the missing
        # wrench says which is better.
        errors.append(Figure(error, float(not is_exact)))
        # Less power for less wrench is no merit.
        watts.append(Figure(three_digits(answer.power), answer.power if is_exact else None))
        words = "nothing" if is_exact else missing_axes(left_undone)
        missing.append(Figure(words, 0.0 if is_exact else size_of(left_undone)))
    hint = "missing, as a share of what each can push; exact up to 0.001"
    rows = [
        FigureRow("error", errors, is_less_better=True, hint=hint),
        FigureRow("power [W]", watts, is_less_better=True),
    ]
    if any(figure.text != "nothing" for figure in missing):
        hint = f"the largest part; compared with torques over {LEVER:g} m"
        rows.append(FigureRow("missing", missing, is_less_better=True, hint=hint))
    return rows


def size_of(wrench: Array) -> float:
    """The size of a wrench (6,) [N, N m], with its torques over `LEVER` [N]."""
    return math.hypot(*wrench[:3].tolist(), *(wrench[3:] / LEVER).tolist())


def missing_axes(missing: Array) -> str:
    """The largest component of a missing wrench (6,) [N, N m]: `surge 4.2 N`."""
    forces = np.abs(missing) / np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
    axis = int(np.argmax(forces))
    return f"{MOTIONS[axis]} {three_digits(float(missing[axis]))} {UNITS[axis]}"


def _reach_rows(pair: Pair, cards: Sequence[ScoreCard | None]) -> list[FigureRow]:
    """What both can push."""
    rows = []
    for column in CARD_COLUMNS:
        figures = [_card_figure(column, card) for card in cards]
        rows.append(FigureRow(column.heading, figures))
    rows_by_card: list[dict[MotionAxis, AxisRow]] = []
    for card in cards:
        by_axis = {} if card is None else {row.axis: row for row in axis_rows(card)}
        rows_by_card.append(by_axis)
    commanded = np.any([standing.state.layout.commanded for standing in pair.both], axis=0)
    for axis, unit, counts in zip(MOTIONS, UNITS, commanded.tolist(), strict=True):
        if counts:
            figures = [
                _axis_figure(axis, by_axis, card)
                for by_axis, card in zip(rows_by_card, cards, strict=True)
            ]
            rows.append(FigureRow(f"{axis} [{unit}]", figures, hint=LARGEST.hint))
    return rows


def _card_figure(column: Column, card: ScoreCard | None) -> Figure:
    """A figure of a card."""
    if card is None:
        return UNKNOWN
    return Figure(cell_text(column, card), column.value(card))


def _axis_figure(
    axis: MotionAxis, by_axis: dict[MotionAxis, AxisRow], card: ScoreCard | None
) -> Figure:
    """How far an axis reaches; the lesser way counts."""
    if card is None:
        return UNKNOWN
    row = by_axis.get(axis)
    if row is None:
        return Figure("free", None)
    return Figure(cell_text(LARGEST, row), min(row.largest, row.most_negative))


def _robot_rows(pair: Pair) -> list[FigureRow]:
    """What both are made of."""

    def row(heading: str, text_of: Callable[[Standing], str]) -> FigureRow:
        figures = [Figure(text_of(standing), None) for standing in pair.both]
        return FigureRow(heading, figures, is_judged=False)

    rows = [
        row("actuators", lambda standing: standing.state.layout.counts_in_words),
        row("mass [kg]", _mass_text),
    ]
    if any(standing.state.lost for standing in pair.both):
        rows.append(row("lost", lambda standing: ", ".join(standing.state.lost) or "none"))
    methods = {standing.state.method for standing in pair.both}
    if len(methods) > 1:
        rows.append(row("method", lambda standing: standing.state.method))
    return rows


def _mass_text(standing: Standing) -> str:
    body = standing.state.layout.body
    mass = None if body is None else body.mass_kg
    return DASH if mass is None else three_digits(mass)


def summary(
    pair: Pair, replies: Sequence[Reply | None], cards: Sequence[ScoreCard | None]
) -> tuple[str, ...]:
    """Sentences that say what the tables come to; arguments as for `figures_table`."""
    sentences = []
    power = _answer_rows(replies)[1]
    watts = [figure.value for figure in power.both]
    better = power.better
    if better is not None:
        least, most = watts[better], watts[1 - better]
        assert least is not None and most is not None
        times = f"{three_digits(most / least)} times" if least > 0.0 else "more than"
        sentences.append(
            f"For this wrench the {PLACES[1 - better]} one takes {times} the power of the "
            f"{PLACES[better]} one."
        )
    axes = _reach_rows(pair, cards)[len(CARD_COLUMNS) :]
    for index, place in enumerate(PLACES):
        won = [row.heading.partition(" ")[0] for row in axes if row.better == index]
        if won and len(won) == len(axes):
            sentences.append(f"The {place} one reaches further along all {len(axes)} axes.")
        elif won:
            sentences.append(f"The {place} one reaches further along {listed(won)}.")
    for place, card in zip(PLACES, cards, strict=True):
        if card is None:
            continue
        costly = [loss.actuator for loss in card.losses if loss.lost]
        if len(costly) > MOST_NAMED:
            n_working = len(card.losses)
            share = "" if len(costly) == n_working else f"{len(costly)} of "
            sentences.append(
                f"The {place} one loses axes when any of {share}its {n_working} working actuators "
                "fails."
            )
        elif costly:
            names = " or ".join(costly)
            sentences.append(f"The {place} one loses axes when {names} fails.")
    return tuple(sentences)


def losses_tables(pair: Pair, cards: Sequence[ScoreCard | None]) -> str:
    """What each of both has left without one actuator, one table beside the other."""
    tables = []
    for place, standing, card in zip(PLACES, pair.both, cards, strict=True):
        tables.append(_losses_table(place, standing, card))
    return html("<div class='versus-losses'>{}</div>", tables)


def _losses_table(place: str, standing: Standing, card: ScoreCard | None) -> str:
    layout = standing.state.layout
    head = html(
        "<tr><th title='{}'><b>{}</b> {}</th><th>{}</th><th class='words'>{}</th></tr>",
        layout.name,
        place,
        WITHOUT.heading,
        WEAKEST_LEFT.heading,
        AXES_LOST.heading,
    )
    rows = []
    for loss in () if card is None else card.losses:
        badge = swatch(layout.index(loss.actuator))
        name = html("{}<span class='name' title='{}'>{}</span>", badge, *(2 * (loss.actuator,)))
        rows.append(
            html(
                "<tr><td>{}</td><td>{}</td><td class='words {}'>{}</td></tr>",
                name,
                cell_text(WEAKEST_LEFT, loss),
                "missing" if loss.lost else "dim",
                cell_text(AXES_LOST, loss),
            )
        )
    if card is not None and not rows:
        rows.append(html("<tr><td colspan='3' class='words dim'>a single one works</td></tr>"))
    return html("<table class='losses'>{}{}</table>", head, rows)


def status_of_both(pair: Pair, replies: Sequence[Reply | None], is_busy: bool) -> list[str]:
    """The status line of both: name, power, and verdict of each."""
    markup = []
    for place, standing, reply in zip(PLACES, pair.both, replies, strict=True):
        figures = ""
        words = WORKING
        color = DEAD
        if reply is not None and not is_busy:
            verdict = verdict_of(reply.answer, reply.in_reach)
            words = verdict.value
            color = COLORS[verdict]
            figures = html(
                "<span><span class='dim'>power</span> <b class='power'>{}</b> W</span>",
                three_digits(reply.answer.power),
            )
        template = (
            "<span class='both'><span><span class='dim'>{}</span> <b>{}</b></span>{}"
            "<span class='pill' style='background:{}'>{}</span></span>"
        )
        name = standing.state.layout.name
        markup.append(html(template, place, name, figures, css(color), words))
    return markup
