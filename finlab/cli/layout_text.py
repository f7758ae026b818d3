"""Layouts and their score cards as text."""

from collections.abc import Sequence
from pathlib import Path

from finlab.analysis import AXES, Authority, Improvement, Loss, ScoreCard
from finlab.command_end import aligned
from finlab.layout import Layout

_UNITS = ("N", "N", "N", "N m", "N m", "N m")
COLUMNS = ("actuator", "type", "x [m]", "y [m]", "z [m]", "direction", "limits")


def layout_text(layout: Layout) -> str:
    """A layout in words, and a table of its actuators."""
    rows = [
        (part.name, part.type, *(f"{x:6.3f}" for x in part.position), part.direction_words, part.limits_words)
        for part in layout.actuators
    ]
    title = f"{layout.name}: {layout.description}" if layout.description else layout.name
    return "\n".join([title, "", *table(COLUMNS, rows)])


def improvement_text(improvement: Improvement, output: Path) -> str:
    """Where the actuators went, the card after it, and where the layout was written."""
    lines = [f"{improvement.goal}: {improvement.value_before:.4g} -> {improvement.value_after:.4g}", ""]
    for name in improvement.moved:
        part = improvement.layout.part(name)
        place = "  ".join(f"{value:6.3f}" for value in part.position)
        lines.append(f"{name:<16}  {place} m  {part.direction_words}")
    lines += ["", score_card_text(improvement.card_after), ""]
    lines.append(
        f"{output}: written."
        if improvement.improved
        else f"{output}: written unchanged, nothing better was found."
    )
    return "\n".join(lines)


def score_card_text(card: ScoreCard) -> str:
    """Everything on the card, as tables and sentences."""
    lines = [*_span_lines(card), "", *_axis_table(card), "", *_evenness(card.authority)]
    if card.losses:
        rows = [_loss_row(loss, loss is card.worst_loss) for loss in card.losses]
        what = "fin" if card.counted.endswith(" fins") and " and " not in card.counted else "actuator"
        lines += ["", f"Share of the largest wrench that is left without one {what} (* the worst to lose):"]
        lines += table(("without", "rank", "weakest [N]", *AXES, "lost"), rows)
    lines += ["", *card.notes] if card.notes else []
    return "\n".join(lines)


def _span_lines(card: ScoreCard) -> list[str]:
    """Which axes the actuators push at all, and which they push alone, before any limit."""
    held = card.authority
    verb = "pushes" if card.n_actuators == 1 else "push"
    lines = [f"{card.counted} {verb} in {held.rank} of {held.counted} independent directions."]
    if card.failed:
        lines.append("Failed: " + ", ".join(card.failed) + ".")
    if held.free:
        lines.append("Not commanded, free: " + ", ".join(held.free) + ".")
    if held.without_authority:
        lines.append("Out of reach: " + ", ".join(held.without_authority) + ".")
    if held.coupled:
        lines.append("Only together with other axes: " + ", ".join(held.coupled) + ".")
    return lines


def _axis_table(card: ScoreCard) -> list[str]:
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
    return table(head, rows)


def _evenness(held: Authority) -> list[str]:
    parts = sorted(zip(held.weakest_direction, AXES, strict=True), key=lambda part: -abs(part[0]))
    direction = ", ".join(f"{axis} {value:+.2f}" for value, axis in parts if abs(value) > 0.05)
    values = " ".join(f"{value:.2f}" for value in held.singular_values)
    return [
        f"Weakest direction: {held.weakest:.2f} N along {direction} (torques over 0.2 m).",
        f"Condition {_number(held.condition, 'infinite')}, singular values {values} N.",
    ]


def _loss_row(loss: Loss, worst: bool) -> tuple[str, ...]:
    shares = ("-" if share is None else f"{100 * share:.0f} %" for share in loss.share_left)
    name = f"{loss.actuator} *" if worst else loss.actuator
    return (name, f"{loss.rank}", f"{loss.weakest:.2f}", *shares, ", ".join(loss.lost) or "nothing")


def table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Rows under a head; the first column and a last one of words are flush left, numbers are flush right."""
    words = [k == 0 or name in ("lost", "model") for k, name in enumerate(head)]
    return aligned(head, rows, words).splitlines()


def _number(value: float | None, none: str = "-") -> str:
    return none if value is None else f"{value:.2f}"
