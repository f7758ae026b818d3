"""Jets: the switch that lets them count, and the answer beside that which leaves them out."""

from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from webapp.markup.verdict import rest_sentence
from webapp.markup.words import error_digits, html, row, three_digits
from webapp.page import Page
from webapp.session.state import State
from webapp.tasks.solver import Reply

HEADER = Markup(
    "<tr><th></th><th title='the answer, which counts jets'>with jets</th>"
    "<th title='commands by each own law alone, judged with jets'>without</th></tr>"
)


def add_jets(page: Page) -> None:
    """Switch and table."""
    about = "What the jets of thrusters and fins take from each other, and where they meet the hull."
    switch = page.gui.add_checkbox("Count jets", False, hint=about)
    page.bind(switch, page.session.set_jets, lambda layout: layout.interaction is not None)
    page.add_html(jets_table)


def jets_table(state: State, best: Allocation | None, busy: bool, blind: Reply | None) -> str:
    """What the answer misses and takes, and what that of the actuators' laws alone would."""
    if state.layout.interaction is None or best is None or busy or blind is None or blind.state != state:
        return ""
    both = best, blind.answer
    rows = [
        row("error", *(error_digits(answer.err_norm) for answer in both)),
        row("power [W]", *(three_digits(answer.power) for answer in both)),
    ]
    said = rest_sentence(blind.answer)
    words = "<div class='fl'><table>{}{}</table><div class='said'>Without: {}</div></div>"
    return html(words, HEADER, rows, said[0].lower() + said[1:])
