"""What lies over the 3D view: the status line, and the legend of colours and scales."""

from html import escape

from finlab.allocation.allocation import Allocation
from webapp.markup.figures import small, three_digits
from webapp.markup.swim_card import pace_words
from webapp.markup.words import reach_sentence
from webapp.session.state import State
from webapp.tasks.swimmer import ERROR
from webapp.tasks.swimming import Swimming
from webapp.theme import ASKED, DEAD, DELIVERED, MISSING, OTHER, css


def corner(
    state: State,
    legend: str,
    allocation: Allocation | None,
    busy: bool,
    error: str | None,
    raw: bool = False,
) -> str:
    """Legend and status line in the lower left corner of the page.

    Args:
        state: what is asked.
        legend: what the view shows, as markup.
        allocation: what is on the robot.
        busy: whether a newer answer is on its way.
        error: why there is no answer.
        raw: whether it is a raw command on show, of which nobody expects that it is exact.
    """
    return (
        f"<div class='fl-corner'><div class='fl fl-card fl-legend-card'>{legend}</div>"
        f"<div class='fl fl-card fl-status'>{_status(state, allocation, busy, error, raw)}</div></div>"
    )


def swim_corner(swimming: Swimming, newtons: float) -> str:
    """The same while robots swim."""
    first = swimming.swimmers[0]
    trails = "".join(
        f"<svg width='44' height='10'><path d='M0 5H44' stroke='{css(color)}' stroke-width='3.5'/></svg>"
        f"<span>{word}</span>"
        for word, color in (
            ("the path", ASKED),
            *((s.method, c) for s, c in zip(swimming.swimmers, (DELIVERED, OTHER), strict=False)),
        )
    )
    alive = len(first.fins) - len(first.failed)
    off = f"{100 * float(first.shown.record[-1, ERROR]):.1f}" if len(first.shown.record) else "–"
    parts = (
        f"<b>{escape(first.swim.layout.name)}</b>",
        f"<span>{alive} of {len(first.fins)} fins</span>",
        f"<span><b>{first.time:.1f}</b> s of {first.duration_s:.0f} s</span>",
        f"<span><span class='dim'>off the path</span> <b>{off}</b> cm</span>",
        f"<span>{pace_words(swimming)}</span>",
    )
    return (
        f"<div class='fl-corner'><div class='fl fl-card fl-legend-card'><div class='fl-legend'>{trails}</div>"
        f"<div class='dim scales'>arrow 0.1 m = {newtons:g} N</div></div>"
        f"<div class='fl fl-card fl-status'>{''.join(parts)}</div></div>"
    )


def _status(state: State, allocation: Allocation | None, busy: bool, error: str | None, raw: bool) -> str:
    fins = f"{len(state.healthy)} of {state.layout.n_fins} fins"
    parts = [f"<b>{escape(state.layout.name)}</b>", f"<span>{fins}</span>"]
    if error is not None:
        parts.append(f"<span class='missing'>{escape(error)}</span>")
    elif allocation is None:
        parts.append("<span class='dim'>computing …</span>")
    else:
        color = (
            DEAD if raw else DELIVERED if allocation.reachable and not allocation.unknown_fins else MISSING
        )
        verdict = "Raw, not refined" if raw else reach_sentence(allocation)
        energy, time = three_digits(allocation.energy), three_digits(allocation.solve_ms)
        parts += [
            f"<span><span class='dim'>error</span> <b class='err'>{small(allocation.err_norm)}</b> σ</span>",
            f"<span><span class='dim'>energy</span> <b class='energy'>{energy}</b></span>",
            f"<span><span class='dim'>{escape(allocation.method)}</span> {time} ms</span>",
            f"<span class='pill' style='background:{css(color)}'>{escape(verdict)}</span>",
        ]
        if busy:
            parts.append("<span class='dim'>computing …</span>")
    return "".join(parts)
