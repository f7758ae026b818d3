"""The card of quick checks below the editor of a layout."""

from html import escape

from finlab.analysis.quick import QuickCheck
from webapp.markup.score_card import rank_sentence


def check_card(quick: QuickCheck, several: bool, warnings: tuple[str, ...]) -> str:
    """What there is to watch while a layout is edited.

    Args:
        quick: axes, and what single failures cost.
        several: whether more than one fin works.
        warnings: sentences about fins in the way.
    """
    texts = "".join(f"<div class='missing'>{escape(text)}</div>" for text in warnings)
    costs = "No single failure costs an axis." if several else ""
    if quick.lost:
        lost = "; ".join(f"{name}: {', '.join(axes)}" for name, axes in quick.lost)
        costs = f"<span class='missing'>A failure costs axes: {escape(lost)}.</span>"
    return f"<div class='fl check'>{texts}<div class='said'>{rank_sentence(quick)} {costs}</div></div>"
