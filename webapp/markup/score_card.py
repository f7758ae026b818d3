"""Markup of a layout's score card, and of the quick checks below the layout's editor.

`panels/limits_tab.py` shows the card, `panels/cards.py` the checks.
"""

from collections.abc import Callable
from itertools import combinations

import numpy as np
from markupsafe import Markup

from finlab.analysis import AXES, Authority, ScoreCard
from finlab.analysis.score_card import QuickCheck
from finlab.axes import UNITS
from finlab.layout import Layout
from finlab.swim.hull import hull_of
from webapp.markup.answer import swatch
from webapp.markup.words import html, in_app, listed, row, three_digits
from webapp.scene.actuator_shapes import SPAN

FIGURES: dict[str, Callable[[ScoreCard], float | None]] = {
    "weakest direction [N]": lambda card: card.authority.weakest,
    "weakest after the worst loss [N]": lambda card: (
        card.worst_loss.weakest if card.worst_loss else None
    ),
}
"""Words -> figure of a whole robot; None where it has none, as the worst loss of a single fin."""
SAME = 1e-3
"""Relative difference of two figures up to which they count as equal."""
TIP = 0.05
"""How far out on its blade a fin is asked whether it beats inside the hull [m]."""


def score_table(layout: Layout, card: ScoreCard, old_card: ScoreCard | None) -> str:
    """The score card as tables: figures of the whole robot, of each axis, and of each loss.

    Args:
        layout: the robot.
        card: what it can do.
        old_card: what could be done before, which stands beside that; None where it is the same.
    """
    markup = [_summary(card, old_card), _axes(card, old_card), _losses(layout, card)]
    for note in card.notes:
        markup.append(html("<div class='said dim'>{}</div>", in_app(note)))
    return html("<div class='fl score'>{}</div>", markup)


def rank_sentence(authority: Authority | QuickCheck) -> str:
    """Rank, conditioning and what is missing, in words."""
    text = html("<b>{} of {}</b> axes independent", authority.rank, authority.counted)
    if authority.condition is not None:
        text += f", condition number {three_digits(authority.condition)}"
    text += "."
    if authority.free:
        text += html(" Free, not commanded: {}.", listed(authority.free))
    if authority.without_authority:
        missing = listed(authority.without_authority)
        text += html(" <span class='missing'>It cannot {}.</span>", missing)
    if authority.coupled:
        coupled = listed(authority.coupled).capitalize()
        text += html(" <span class='missing'>{} only together with others.</span>", coupled)
    return text


def _cards(card: ScoreCard, old_card: ScoreCard | None) -> list[ScoreCard]:
    """The cards in the order of their columns."""
    return [card] if old_card is None else [old_card, card]


def _summary(card: ScoreCard, old_card: ScoreCard | None) -> str:
    """The rank in a sentence, and a table of the figures of the whole robot."""
    cards = _cards(card, old_card)
    head = ""
    if old_card is not None:
        ranks = [f"{each.authority.rank} of {each.authority.counted}" for each in cards]
        head = html(
            "<tr><th></th><th>before</th><th>now</th><th></th></tr>{}",
            row("axes independent", *ranks, ""),
        )
    rows = []
    for words, figure in FIGURES.items():
        rows.append(_figure_row(words, [figure(each) for each in cards]))
    return html(
        "<div class='said'>{}</div><table>{}{}</table>", rank_sentence(card.authority), head, rows
    )


def _figure_row(words: str, values: list[float | None]) -> str:
    """A row of one card, or of two and a sign that says which is better; nothing where neither has
    the figure."""
    if not any(value is not None for value in values):
        return ""
    cells: list[object] = [three_digits(value) for value in values]
    if len(values) > 1:
        cells.append(_trend(values[0], values[-1]))
    return row(words, *cells)


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
    """What each commanded axis gives at most, before and after the worst loss, and what it
    costs."""
    authorities = [each.authority for each in _cards(card, old_card)]
    rows = []
    for k, word in enumerate(AXES):
        if word in card.authority.free:
            continue
        shares = []
        for loss in card.losses:
            share = loss.share_left[k]
            if share is not None:
                shares.append(share)
        power = card.unit_power[k]
        rows.append(
            row(
                html("{} <span class='dim'>{}</span>", word, UNITS[k]),
                *[_range_words(each.largest[k], each.most_negative[k]) for each in authorities],
                f"{100 * min(shares):.0f} %" if shares else "–",
                "–" if power is None else three_digits(power),
            )
        )
    columns = [""] if old_card is None else ["before", "now"]
    head = html(
        "<tr><th>largest on its own</th>{}"
        "<th title='after the worst loss of one'>one lost</th>"
        "<th title='least power for so much'>W at 1 N, 0.1 N m</th></tr>",
        [html("<th>{}</th>", word) for word in columns],
    )
    return html("<table>{}{}</table>", head, rows)


def _range_words(positive: float, negative: float) -> str:
    """What an axis gives at most with either sign; one number where both have the same digits."""
    if positive == negative == 0.0:
        return Markup("<span class='missing'>none</span>")
    forward = three_digits(positive)
    backward = three_digits(negative)
    return f"±{forward}" if forward == backward else f"+{forward} −{backward}"


def _losses(layout: Layout, card: ScoreCard) -> str:
    """A row for each actuator: what is left without it."""
    if not card.losses:
        return ""
    rows = []
    for loss in card.losses:
        cost = html("<span class='missing'>loses {}</span>", listed(loss.lost)) if loss.lost else ""
        name = html("without {}{}", swatch(layout.index(loss.actuator)), loss.actuator)
        weakest = f"{three_digits(loss.weakest)} N"
        rows.append(row(name, weakest, html("<div class='words'>{}</div>", cost)))
    return html("<table><tr><th>one lost</th><th>weakest</th><th></th></tr>{}</table>", rows)


def check_card(quick: QuickCheck, has_several: bool, warnings: tuple[str, ...]) -> str:
    """What there is to watch while a layout is edited.

    Args:
        quick: its axes, and what single failures cost.
        has_several: whether the robot has more actuators than one.
        warnings: sentences about fins in the way.
    """
    texts = [html("<div class='missing'>{}</div>", text) for text in warnings]
    costs = "No single failure costs an axis." if has_several else ""
    if quick.lost:
        lost = "; ".join([f"{name}: {', '.join(axes)}" for name, axes in quick.lost])
        costs = html("<span class='missing'>A failure costs axes: {}.</span>", lost)
    return html(
        "<div class='fl check'>{}<div class='said'>{} {}</div></div>",
        texts,
        rank_sentence(quick),
        costs,
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
