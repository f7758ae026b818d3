"""Markup of a layout's score card, and of the quick checks below the layout's editor."""

from collections.abc import Callable
from itertools import combinations

import numpy as np
from markupsafe import Markup

from finlab.analysis import AXES, Authority, ScoreCard
from finlab.analysis.score_card import QuickCheck
from finlab.layout import Layout
from finlab.swim.hull import hull_of
from webapp.markup.answer import swatch
from webapp.markup.words import html, in_app, listed, row, three_digits
from webapp.scene.actuator_shapes import SPAN
from webapp.session.state import AXIS_UNITS

FIGURES: dict[str, Callable[[ScoreCard], float | None]] = {
    "weakest direction [N]": lambda card: card.authority.weakest,
    "weakest after the worst loss [N]": lambda card: (
        card.worst_loss.weakest if card.worst_loss else None
    ),
}
"""Words -> figure of a whole robot; None where it has none, as the worst loss of a single fin."""


def score_table(layout: Layout, card: ScoreCard, before: ScoreCard | None) -> str:
    """The score card, beside what could be done `before` where that differs."""
    parts = [_summary(card, before), _axes(card, before), _losses(layout, card)]
    parts += [html("<div class='said dim'>{}</div>", in_app(note)) for note in card.notes]
    return html("<div class='fl score'>{}</div>", parts)


def rank_sentence(a: Authority | QuickCheck) -> str:
    """Rank, conditioning and what is missing, in words."""
    text = html("<b>{} of {}</b> axes independent", a.rank, a.counted)
    if a.condition is not None:
        text += f", condition number {three_digits(a.condition)}"
    text += "."
    if a.free:
        text += html(" Free, not commanded: {}.", listed(a.free))
    if a.without_authority:
        text += html(" <span class='missing'>It cannot {}.</span>", listed(a.without_authority))
    if a.coupled:
        text += html(
            " <span class='missing'>{} only together with others.</span>",
            listed(a.coupled).capitalize(),
        )
    return text


def _summary(card: ScoreCard, before: ScoreCard | None) -> str:
    head = ""
    if before is not None:
        ranks = row(
            "axes independent",
            *(f"{one.authority.rank} of {one.authority.counted}" for one in (before, card)),
            "",
        )
        head = html("<tr><th></th><th>before</th><th>now</th><th></th></tr>{}", ranks)
    known = [one for one in (before, card) if one is not None]
    rows = [_figure(words, [of(one) for one in known]) for words, of in FIGURES.items()]
    return html(
        "<div class='said'>{}</div><table>{}{}</table>", rank_sentence(card.authority), head, rows
    )


def _figure(words: str, values: list[float | None]) -> str:
    """A row of one layout, or of both and a sign; a robot of one fin has no worst loss."""
    if not any(value is not None for value in values):
        return ""
    signs = [""] * (len(values) - 1)
    old, now = (values[0], values[-1])
    if signs and now is not None and old is not None:
        same = abs(now - old) < 1e-3 * max(abs(now), abs(old), 1e-9)
        kind, sign = ("", "=") if same else ("given", "▲") if now > old else ("missing", "▼")
        signs = [html("<span class='{}'>{}</span>", kind, sign)]
    return row(words, *(three_digits(value) for value in values), *signs)


def _axes(card: ScoreCard, before: ScoreCard | None) -> str:
    known = [one.authority for one in (before, card) if one is not None]
    rows = []
    for k, word in enumerate(AXES):
        if word in card.authority.free:
            continue
        left = [loss.share_left[k] for loss in card.losses]
        least = min((share for share in left if share is not None), default=None)
        power = card.unit_power[k]
        rows.append(
            row(
                html("{} <span class='dim'>{}</span>", word, AXIS_UNITS[k]),
                *(_both(one.largest[k], one.most_negative[k]) for one in known),
                "–" if least is None else f"{100 * least:.0f} %",
                "–" if power is None else three_digits(power),
            )
        )
    columns = ("",) if before is None else ("before", "now")
    head = html(
        "<tr><th>largest on its own</th>{}<th title='after the worst loss of one'>one lost</th>"
        "<th title='least power for so much'>W at 1 N, 0.1 N m</th></tr>",
        (html("<th>{}</th>", word) for word in columns),
    )
    return html("<table>{}{}</table>", head, rows)


def _both(positive: float, negative: float) -> str:
    """Both signs; one number where they are equal to what is shown of them."""
    a = three_digits(positive)
    b = three_digits(negative)
    if positive == negative == 0.0:
        return Markup("<span class='missing'>none</span>")
    return f"±{a}" if a == b else f"+{a} −{b}"


def _losses(layout: Layout, card: ScoreCard) -> str:
    if not card.losses:
        return ""
    rows = []
    for loss in card.losses:
        cost = html("<span class='missing'>loses {}</span>", listed(loss.lost)) if loss.lost else ""
        name = html("without {}{}", swatch(layout.index(loss.actuator)), loss.actuator)
        rows.append(
            row(name, f"{three_digits(loss.weakest)} N", html("<div class='words'>{}</div>", cost))
        )
    return html("<table><tr><th>one lost</th><th>weakest</th><th></th></tr>{}</table>", rows)


def check_card(quick: QuickCheck, several: bool, warnings: tuple[str, ...]) -> str:
    """What there is to watch while a layout is edited: axes, what single failures cost, fins in the
    way."""
    texts = Markup().join(html("<div class='missing'>{}</div>", text) for text in warnings)
    costs = "No single failure costs an axis." if several else ""
    if quick.lost:
        lost = "; ".join(f"{name}: {', '.join(axes)}" for name, axes in quick.lost)
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
    for a, b in combinations(layout.fins, 2):
        gap = float(np.linalg.norm(np.subtract(a.position, b.position)))
        if gap < SPAN:
            sentences.append(f"{a.name} and {b.name} are {gap:.2f} m apart and may touch.")
    for fin in layout.fins:
        if hull.contains(np.array(fin.position) + 0.05 * np.array(fin.frame[0])):
            sentences.append(f"{fin.name} beats inside the hull.")
    return tuple(sentences)
