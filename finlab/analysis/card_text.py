"""Writes a score card as sentences and tables; `ScoreCard` shows itself by it."""

from __future__ import annotations

from typing import Any

from finlab.analysis.authority import AXES, Authority, Loss
from finlab.display import Block, Table

ScoreCard = Any
"""`finlab.analysis.ScoreCard`, which shows itself by what is here."""
_UNITS = ("N", "N", "N", "N m", "N m", "N m")
"""Units of a wrench."""
SMALL_COMPONENT = 0.05
"""Components of the weakest direction below this size are left out."""


def card_blocks(card: ScoreCard) -> list[Block]:
    """Returns everything on a score card as sentences and tables."""
    blocks: list[Block] = [
        "\n".join(_span_lines(card)),
        _axis_table(card),
        _evenness(card.authority),
    ]
    if card.losses:
        blocks.append(_loss_table(card))
    if card.notes:
        blocks.append("\n".join(card.notes))
    return blocks


def _span_lines(card: ScoreCard) -> list[str]:
    """Sentences on the axes that the actuators push at all, and alone, before any limit."""
    authority = card.authority
    verb = "pushes" if card.n_actuators == 1 else "push"
    rank = f"{authority.rank} of {authority.counted} independent directions"
    lines = [f"{card.counted} {verb} in {rank}."]
    if card.lost:
        lines.append("Lost: " + ", ".join(card.lost) + ".")
    if authority.free:
        lines.append("Not commanded, free: " + ", ".join(authority.free) + ".")
    if authority.without_authority:
        lines.append("Out of reach: " + ", ".join(authority.without_authority) + ".")
    if authority.coupled:
        lines.append("Only together with other axes: " + ", ".join(authority.coupled) + ".")
    return lines


def _axis_table(card: ScoreCard) -> Table:
    """The largest wrench along each commanded axis, and the power of a small one."""
    authority = card.authority
    head = ("axis", "largest +", "largest -", "", "for", "power [W]")
    rows = []
    for k, axis in enumerate(AXES):
        if axis in authority.free:
            continue
        cells = (
            axis,
            f"{authority.largest[k]:.3f}",
            f"{authority.most_negative[k]:.3f}",
            _UNITS[k],
            f"{card.unit_wrench[k]:g} {_UNITS[k]}",
            _number(card.unit_power[k]),
        )
        rows.append(cells)
    return Table(head, rows, (True, *(False,) * 5))


def _evenness(authority: Authority) -> str:
    """Sentences on the weakest direction, the condition and the singular values."""
    components = []
    for value, axis in zip(authority.weakest_direction, AXES, strict=True):
        if abs(value) > SMALL_COMPONENT:
            components.append((value, axis))
    components.sort(key=lambda component: -abs(component[0]))
    direction = ", ".join(f"{axis} {value:+.2f}" for value, axis in components)
    values = " ".join(f"{value:.2f}" for value in authority.singular_values)
    return (
        f"Weakest direction: {authority.weakest:.2f} N along {direction} (torques over 0.2 m).\n"
        f"Condition {_number(authority.condition, 'infinite')}, singular values {values} N."
    )


def _loss_table(card: ScoreCard) -> Table:
    """What is left after the loss of each actuator; the worst one has a star."""
    is_of_fins = card.counted.endswith(" fins") and " and " not in card.counted
    actuator = "fin" if is_of_fins else "actuator"
    title = (
        f"Share of the largest wrench that is left without one {actuator} (* the worst to lose):"
    )
    head = ("without", "rank", "weakest [N]", *AXES, "lost")
    rows = [_loss_row(loss, loss is card.worst_loss) for loss in card.losses]
    return Table(head, rows, (True, *(False,) * 8, True), title)


def _loss_row(loss: Loss, is_worst: bool) -> tuple[str, ...]:
    """A row of that table."""
    name = f"{loss.actuator} *" if is_worst else loss.actuator
    shares = ["-" if share is None else f"{100 * share:.0f} %" for share in loss.share_left]
    return (name, f"{loss.rank}", f"{loss.weakest:.2f}", *shares, ", ".join(loss.lost) or "nothing")


def _number(value: float | None, none: str = "-") -> str:
    """A number with two decimals, or the text for None."""
    return none if value is None else f"{value:.2f}"
