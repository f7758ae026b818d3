"""The card that explains a stop of the tour."""

from html import escape

from webapp.session.tour import STEPS


def tour_card(index: int) -> str:
    """Title and text of a stop."""
    step = STEPS[index]
    return (
        f"<div class='fl tour'><b>{index + 1} of {len(STEPS)} · {escape(step.title)}</b>"
        f"<div class='said'>{escape(step.text)}</div></div>"
    )
