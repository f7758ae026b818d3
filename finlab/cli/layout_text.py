"""The improvement of a layout as text."""

from pathlib import Path

from finlab.analysis import Improvement


def improvement_text(improvement: Improvement, output: Path) -> str:
    """Where the actuators went, the card after it, and where the layout was written."""
    lines = [f"{improvement.goal}: {improvement.value_before:.4g} -> {improvement.value_after:.4g}", ""]
    for name in improvement.moved:
        part = improvement.layout.part(name)
        place = "  ".join(f"{value:6.3f}" for value in part.position)
        lines.append(f"{name:<16}  {place} m  {part.direction_words}")
    lines += ["", str(improvement.card_after), ""]
    lines.append(
        f"{output}: written."
        if improvement.improved
        else f"{output}: written unchanged, nothing better was found."
    )
    return "\n".join(lines)
