"""A score card as tables and sentences."""

from __future__ import annotations

from typing import Any

from finlab.analysis.authority import AXES, Authority, Loss
from finlab.display import Block, Table

ScoreCard = Any
"""`finlab.analysis.ScoreCard`, which shows itself by what is here."""
_UNITS = ("N", "N", "N", "N m", "N m", "N m")


def card_blocks(card: ScoreCard) -> list[Block]:
    """Returns everything on the card."""
    blocks: list[Block] = [
        "\n".join(_span_lines(card)),
        _axis_table(card),
        _evenness(card.authority),
    ]
    if card.losses:
        rows = [_loss_row(loss, loss is card.worst_loss) for loss in card.losses]
        what = (
            "fin" if card.counted.endswith(" fins") and " and " not in card.counted else "actuator"
        )
        title = (
            f"Share of the largest wrench that is left without one {what} (* the worst to lose):"
        )
        head = ("without", "rank", "weakest [N]", *AXES, "lost")
        blocks.append(Table(head, rows, (True, *(False,) * 8, True), title))
    return [*blocks, "\n".join(card.notes)] if card.notes else blocks


def _span_lines(card: ScoreCard) -> list[str]:
    """Which axes the actuators push at all, and which they push alone, before any limit."""
    held = card.authority
    verb = "pushes" if card.n_actuators == 1 else "push"
    lines = [f"{card.counted} {verb} in {held.rank} of {held.counted} independent directions."]
    if card.lost:
        lines.append("Lost: " + ", ".join(card.lost) + ".")
    if held.free:
        lines.append("Not commanded, free: " + ", ".join(held.free) + ".")
    if held.without_authority:
        lines.append("Out of reach: " + ", ".join(held.without_authority) + ".")
    if held.coupled:
        lines.append("Only together with other axes: " + ", ".join(held.coupled) + ".")
    return lines


def _axis_table(card: ScoreCard) -> Table:
    held = card.authority
    head = ("axis", "largest +", "largest -", "", "for", "power [W]")
    rows = [
        (
            axis,
            f"{held.largest[k]:.3f}",
            f"{held.most_negative[k]:.3f}",
            _UNITS[k],
            f"{card.unit_wrench[k]:g} {_UNITS[k]}",
            _number(card.unit_power[k]),
        )
        for k, axis in enumerate(AXES)
        if axis not in held.free
    ]
    return Table(head, rows, (True, *(False,) * 5))


def _evenness(held: Authority) -> str:
    parts = sorted(zip(held.weakest_direction, AXES, strict=True), key=lambda part: -abs(part[0]))
    direction = ", ".join(f"{axis} {value:+.2f}" for value, axis in parts if abs(value) > 0.05)
    values = " ".join(f"{value:.2f}" for value in held.singular_values)
    return (
        f"Weakest direction: {held.weakest:.2f} N along {direction} (torques over 0.2 m).\n"
        f"Condition {_number(held.condition, 'infinite')}, singular values {values} N."
    )


def _loss_row(loss: Loss, worst: bool) -> tuple[str, ...]:
    shares = ("-" if share is None else f"{100 * share:.0f} %" for share in loss.share_left)
    name = f"{loss.actuator} *" if worst else loss.actuator
    return (name, f"{loss.rank}", f"{loss.weakest:.2f}", *shares, ", ".join(loss.lost) or "nothing")


def _number(value: float | None, none: str = "-") -> str:
    return none if value is None else f"{value:.2f}"
