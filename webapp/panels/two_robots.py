"""Two robots beside each other: which they are, what is done with them, and their figures."""

from functools import partial

import viser
from markupsafe import Markup

from finlab.analysis import ScoreCard
from webapp.handles import add_html
from webapp.markup.two_robots import figures_table, losses_tables, summary
from webapp.markup.words import html, marker
from webapp.page import Page
from webapp.session.looking import CANDIDATES
from webapp.session.two_robots import PLACES, PROPOSAL, Pair, Source
from webapp.tasks.solver import Reply
from webapp.tasks.two_robots import Cards


def add_two_robots(page: Page) -> None:
    """A list for each side, and what can be done with the two."""
    session = page.session
    gui = page.gui
    two_robots = session.two_robots

    def choose(place: str, title: str) -> None:
        two_robots.choose(place, title, page.jobs.improver.proposal)

    for place in PLACES:
        hint = (
            "This robot, an earlier state of it, a proposal of Improve, one of a file or a link, "
            "or one that is shipped."
        )
        robots = gui.add_dropdown(place.capitalize(), ("",), hint=hint)
        page.board.show(robots, options=_titles)
        page.bind(robots, partial(choose, place), partial(_title_at, PLACES.index(place)))
    page.add_html(_notes)
    add_html(gui, marker("fl-accept"))

    def accept(place: str) -> None:
        pair = two_robots.pair
        is_proposal = pair is not None and pair.both[PLACES.index(place)].title == PROPOSAL
        two_robots.accept(place)
        if is_proposal:
            page.jobs.improver.forget()

    accepts = {f"Accept {place}": partial(accept, place) for place in PLACES}
    page.add_buttons("This robot", accepts, hint="It becomes the robot; undo takes that back.")

    def swap() -> None:
        two_robots.swap()

    def close() -> None:
        session.show_drawer(CANDIDATES)

    acts = {"Swap": swap, "Link": page.designs.share_pair, "Close": close}
    page.add_buttons("Both", acts, hint="A link carries both robots and the wrench.")
    hint = "A design or a robot of others; it stands at the right. Links are pasted below."
    page.add_upload(
        "Compare with a file",
        page.designs.open_beside,
        icon=viser.Icon.FOLDER_OPEN,
        mime_type=page.opening.suffixes,
        hint=hint,
    )
    box = gui.add_text("Link", "", hint="A shared link, pasted here and ended with Enter.")

    def open_link(text: str) -> None:
        if text.strip():
            page.designs.open_link_beside(text)

    page.on_change(box, open_link)
    page.board.show(box, value=lambda pair: "")


def _titles(pair_sources: tuple[Source, ...]) -> tuple[str, ...]:
    """Entries of both lists."""
    return tuple([source.title for source in pair_sources]) or ("",)


def _title_at(index: int, pair: Pair | None) -> str:
    """The entry of the robot that stands left (0) or right (1)."""
    return "" if pair is None else pair.both[index].title


def _notes(
    pair: Pair | None,
    left_reply: Reply | None,
    right_reply: Reply | None,
    cards: Cards | None,
    cards_busy: bool,
    pair_busy: bool,
) -> str:
    """What is to be known of the two, and what their figures come to."""
    if pair is None:
        return ""
    left, right = pair.both
    sentences = []
    same_layout = left.state.layout == right.state.layout
    if same_layout and left.state.damage == right.state.damage:
        return html(
            "<div class='fl'><div class='versus-said'>Both are the same robot; choose another one "
            "on one side.</div></div>"
        )
    if left.state.method != right.state.method:
        sentences.append(
            f"{left.state.method} answers for the left one, {right.state.method} for the right "
            "one: the chosen method does not take all actuators of both."
        )
    if not pair_busy:
        replies = (left_reply, right_reply)
        sentences += summary(pair, replies, _cards_of(cards, cards_busy))
    return html("<div class='fl'><div class='versus-said'>{}</div></div>", " ".join(sentences))


def add_figures_of_both(page: Page) -> None:
    """The table of both, and what is under way of it."""
    page.add_html(_progress)
    cancel = page.add_button(
        "Cancel", page.jobs.pairing.cards.stop, icon=viser.Icon.X, visible=False
    )
    page.board.show(cancel, visible=lambda cards_busy: cards_busy)
    again = page.add_button(
        "Work out the reach of both", page.jobs.pairing.compare_again, visible=False
    )
    page.board.show(again, visible=_is_cut_short)
    page.add_html(_figures)
    page.add_html(_losses)


def _is_cut_short(cards: Cards | None, cards_busy: bool, pair: Pair | None) -> bool:
    """Whether reach was given up before it was known of both."""
    if pair is None or cards is None or cards_busy:
        return False
    for card, standing in zip(cards, pair.both, strict=True):
        if card is None and len(standing.state.lost) < standing.state.layout.n:
            return True
    return False


def _progress(cards_busy: bool, cards_progress: int | None, cards_error: str | None) -> str:
    """How far the reach of both is."""
    if cards_error is not None:
        return html("<div class='fl missing'>{}</div>", cards_error)
    if not cards_busy:
        return ""
    return html(
        "<div class='fl dim' role='status'>Reach: {} of 2 robots worked out …</div>",
        cards_progress or 0,
    )


def _cards_of(cards: Cards | None, cards_busy: bool) -> tuple[ScoreCard | None, ScoreCard | None]:
    """The cards of the two that stand there now."""
    return (None, None) if cards is None or cards_busy else cards


def _figures(
    pair: Pair | None,
    left_reply: Reply | None,
    right_reply: Reply | None,
    cards: Cards | None,
    cards_busy: bool,
    pair_busy: bool,
) -> str:
    if pair is None:
        return ""
    known = _cards_of(cards, cards_busy)
    table = figures_table(pair, (left_reply, right_reply), known, pair_busy)
    return html("<div class='fl'>{}</div>", table)


def _losses(pair: Pair | None, cards: Cards | None, cards_busy: bool) -> str:
    if pair is None:
        return ""
    heading = Markup("<div class='said'>Without one actuator: weakest direction, axes lost</div>")
    tables = losses_tables(pair, _cards_of(cards, cards_busy))
    return html("<div class='fl'>{}{}</div>", heading, tables)
