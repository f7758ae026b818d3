"""How an answer came about, as a table of its steps."""

from html import escape

from webapp.markup.picking import send
from webapp.markup.words import error_digits, source_words, three_digits
from webapp.tasks.refinement import Way

STEPS = "fl-step"
"""Channel that hears which step is clicked."""


def step_name(name: str) -> str:
    """A step's name at the beginning of a line."""
    return name[0].upper() + name[1:]


def way_table(way: Way | None, at: int | None) -> str:
    """Name, error, power and effort of each step, the one on the robot marked; nothing where none is known.

    Args:
        way: the steps.
        at: which one is on the robot, None for the last one.
    """
    if way is None:
        return ""
    here, rows = len(way.steps) - 1 if at is None else at, []
    for k, (name, answer) in enumerate(way.steps):
        tell = send(STEPS, f"`{k},${{Date.now()}}`")
        rows.append(
            f"<tr class='pick{' chosen' * (k == here)}' onclick=\"{tell}\"><td>{k + 1}</td>"
            f"<td class='words'>{escape(step_name(name))}</td><td>{error_digits(answer.err_norm)}</td>"
            f"<td>{three_digits(answer.power)}</td><td>{three_digits(answer.energy)}</td></tr>"
        )
    return (
        f"<div class='fl'><b>The way to {escape(way.steps[-1].name.lower())}</b> "
        f"<span class='dim'>{escape(source_words((way.start,)))}</span>"
        "<table class='way'><tr><th>#</th><th class='words'>step</th><th>error [σ]</th>"
        f"<th>power&nbsp;[W]</th><th>effort</th></tr>{''.join(rows)}</table></div>"
    )
