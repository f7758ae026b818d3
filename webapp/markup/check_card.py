"""The card of quick checks below the editor of a layout."""

from html import escape

from finlab.analysis import ScoreCard
from webapp.markup.score_card import rank_sentence


def check_card(card: ScoreCard | None, stale: bool, warnings: tuple[str, ...]) -> str:
    """What there is to watch while a layout is edited.

    Args:
        card: the newest score card, None before there is one.
        stale: whether it is older than the layout.
        warnings: sentences about fins in the way.
    """
    texts = "".join(f"<div class='missing'>{escape(text)}</div>" for text in warnings)
    if card is None:
        return f"<div class='fl'>{texts}<div class='dim'>computing …</div></div>"
    lost = [f"{loss.fin}: {', '.join(loss.lost)}" for loss in card.losses if loss.lost]
    costs = "No single failure costs an axis." if card.losses else ""
    if lost:
        costs = f"<span class='missing'>A failure costs axes: {escape('; '.join(lost))}.</span>"
    kind = "said dim" if stale else "said"
    return f"<div class='fl check'>{texts}<div class='{kind}'>{rank_sentence(card)} {costs}</div></div>"
