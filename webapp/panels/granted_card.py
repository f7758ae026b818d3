"""The card *Taken for granted*: what was taken of a robot's file that does not say it, and which of
it the user has corrected or confirmed."""

import json

from finlab.display import listed
from finlab.layout import Layout
from webapp.box_labels import box_label
from webapp.handles import placed, press
from webapp.markup.words import html
from webapp.page import Page
from webapp.session.granted import BODY, Granted, SourceFile
from webapp.viser_internals import run_script

FIRST_OF_MODEL = "forward"
"""Field in the first box of the model of a thruster, whose power was taken."""
MOST_NAMED = 3
"""Most actuators that a row names; of more their number is told."""


def add_granted(page: Page) -> None:
    """The card, whose rows lead to the boxes that hold what was taken."""
    session = page.session

    def row_at(key: str) -> Granted:
        rows = session.state.granted
        return rows[placed(key, len(rows))]

    def go(key: str, _modifier: str) -> None:
        row = row_at(key)
        if row.option and not row.left(session.state.layout):
            page.importing.ask_again(row.option)
            return
        session.show_task("Design")
        left = row.left(session.state.layout) or tuple(name for name, _ in row.taken)
        names = [name for name in left if name in session.state.layout.names]
        session.select(None)
        for name in names:
            session.select_also(name)
        kind = session.state.layout.actuator(names[-1]).type if names else ""
        field = FIRST_OF_MODEL if row.field == "model" else row.field
        label = json.dumps(box_label(field, kind))
        run_script(page.gui, f"finlabInquiry.point({label});")

    page.presses.on("granted", go)
    page.presses.on("granted-tick", lambda key, _: session.confirm(row_at(key)))
    page.presses.on("granted-ask", lambda key, _: page.importing.ask_again(row_at(key).option))
    page.add_html(granted_markup)


def granted_markup(granted: tuple[Granted, ...], source: SourceFile | None, layout: Layout) -> str:
    """The rows, and what else was read of the file or left out.

    Args:
        granted: what was taken.
        source: the file; None where the robot is from none.
        layout: the robot as it is now.
    """
    if source is None:
        return ""
    rows = []
    n_settled = 0
    for k, row in enumerate(granted):
        is_settled = row.is_settled(layout)
        n_settled += is_settled
        rows.append(_row(k, row, is_settled, layout))
    head = html(
        "<div><span class='dim'>Of {}: {} of {} settled.</span></div>",
        source.name,
        n_settled,
        len(granted),
    )
    more = ""
    if source.remarks:
        remarks = [html("<p>{}</p>", remark) for remark in source.remarks]
        more = html(
            "<details><summary>Also read, or left out ({})</summary>{}</details>",
            len(remarks),
            remarks,
        )
    return html("<div class='fl fl-granted'>{}<ul>{}</ul>{}</div>", head, rows, more)


def _row(k: int, row: Granted, is_settled: bool, layout: Layout) -> str:
    """A row: a mark that confirms it, the sentence, and where it is changed."""
    hint = "Not sure after all" if row.is_confirmed else "That is right"
    tick = html(
        "<button class='tick' {} aria-pressed='{}' aria-label='{}' title='{}'>{}</button>",
        press("granted-tick", str(k)),
        str(is_settled).lower(),
        hint,
        hint,
        "✓" if is_settled else "",
    )
    where = []
    label = box_label(row.field, _kind(row, layout)).partition(" [")[0]
    if label:
        words = f" {label}{_whose(row, layout)} →"
        target = html("class='to' {}", press("granted", str(k)))
        where.append(html("<button {}>{}. <u>{}</u></button>", target, row.sentence, words))
    elif row.option:
        target = html("class='to' {}", press("granted", str(k)))
        end = "" if row.sentence.endswith("?") else "."
        where.append(html("<button {}>{}{} <u>Ask again →</u></button>", target, row.sentence, end))
    else:
        where.append(html("<span class='to'>{}.</span>", row.sentence))
    style = "settled" if is_settled else ""
    return html("<li class='{}'>{}{}</li>", style, tick, where)


def _kind(row: Granted, layout: Layout) -> str:
    """Type of the actuators that a row is about; empty where there are none."""
    for name, _ in row.taken:
        if name in layout.names:
            return layout.actuator(name).type
    return ""


def _whose(row: Granted, layout: Layout) -> str:
    """Whose boxes still hold what was taken."""
    if row.field.startswith(BODY):
        return " of the robot"
    left = row.left(layout)
    if not left or len(left) == layout.n:
        return " of all" if layout.n > 1 else ""
    if len(left) > MOST_NAMED:
        return f" of {len(left)} of {layout.n}"
    return f" of {listed(left)}"
