"""Two robots beside each other: which there are, what is said of them, what becomes of them, and
links that carry both. Judges are the library's own cards and answers, and geometry."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.analysis import score_card
from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.swim.design_files import Opened
from tests.webapp.stand_in import context_of, until
from webapp.markup.two_robots import Figure, FigureRow, figures_table, losses_tables, summary
from webapp.scene.robot_scene import CAMERAS
from webapp.scene.two_robots import half_extent, pair_scale, placement
from webapp.scene.wrench_nodes import ARROWS, LENGTH, Scale
from webapp.session import Session, files
from webapp.session.looking import TWO_ROBOTS
from webapp.session.state import State
from webapp.session.two_robots import PROPOSAL, SAVED, THIS, Pair, Source
from webapp.tasks.slot import Pool
from webapp.tasks.solver import Solver
from webapp.tasks.two_robots import CardQuestion, Pairing


@pytest.fixture(scope="module")
def solver() -> Solver:
    """The shipped methods."""
    return Solver()


@pytest.fixture
def pool() -> Iterator[Pool]:
    """One thread."""
    pool = Pool()
    yield pool
    pool.stop()


def titles(session: Session) -> list[str]:
    """Titles of all robots that can be chosen."""
    return [source.title for source in session.two_robots.sources()]


def looked_at(session: Session) -> Pair:
    """Both, which are looked at."""
    session.show_drawer(TWO_ROBOTS)
    pair = session.two_robots.pair
    assert pair is not None
    return pair


def test_all_robots_of_a_session_can_be_chosen(session: Session) -> None:
    session.select("front_left")
    session.delete()
    session.set_target(0, 3.0)  # no step of the robot
    session.toggle_loss("back_left")
    proposal = replace(session.state, layout=load_layout("A"))
    chosen = [source.title for source in session.two_robots.sources(proposal)]
    assert chosen[:5] == [
        THIS,
        PROPOSAL,
        SAVED,
        "Before: Fail back_left",
        "Before: Delete front_left",
    ]
    assert chosen[5:] == [f"Shipped: {name}" for name in shipped_layouts()]
    assert len(set(chosen)) == len(chosen)
    session.two_robots.choose("left", "Before: Fail back_left")
    session.two_robots.choose("right", PROPOSAL, proposal)
    left, right = looked_at(session).both
    assert (left.state.layout.n, left.state.lost, left.is_this) == (3, (), False)
    assert right.state.layout == load_layout("A")
    assert left.state.target == right.state.target == session.state.target
    with pytest.raises(FinlabError, match="robot: expected one of This robot, .* got 'nobody'"):
        session.two_robots.choose("left", "nobody")


def test_steps_of_one_name_can_be_told_apart(session: Session) -> None:
    for _ in range(3):
        session.toggle_loss("back_left")
        session.toggle_loss("back_left")
    earlier = [title for title in titles(session) if title.startswith("Before")]
    assert earlier[:3] == [
        "Before: Repair back_left",
        "Before: Fail back_left",
        "Before: Repair back_left (2)",
    ]
    session.two_robots.choose("right", "Before: Repair back_left (2)")
    session.select("front_left")
    session.delete()
    assert "Before: Repair back_left (2)" in titles(session)
    pinned = looked_at(session).right
    assert (pinned.state.layout.n, pinned.state.lost) == (4, ("back_left",))


def test_one_wrench_is_asked_of_both_while_it_changes(session: Session) -> None:
    session.two_robots.choose("right", "Shipped: bluerov2_heavy")
    before = looked_at(session)
    assert before is session.two_robots.pair, "as long as nothing changes it is one object"
    session.set_target(2, -1.5)
    session.set_setting("policy", "direction")
    after = looked_at(session)
    assert after.left.state == session.state
    assert after.right.state.target == session.state.target
    assert after.right.state.policy == "direction"
    session.show_drawer("Comparison")
    assert session.two_robots.pair is None


def test_a_method_that_does_not_take_all_gives_way(session: Session) -> None:
    session.set_setting("method", "mdn")
    session.two_robots.choose("right", "Shipped: bluerov2_heavy")
    left, right = looked_at(session).both
    assert (left.state.method, right.state.method) == ("mdn", "dual")


def test_either_can_be_accepted_by_a_step_that_is_undone(session: Session) -> None:
    ucat = session.state.layout
    session.two_robots.choose("right", "Shipped: octo")
    looked_at(session)
    with pytest.raises(FinlabError, match="the left one is this robot already"):
        session.two_robots.accept("left")
    session.set_target(0, 2.5)
    session.two_robots.accept("right")
    assert session.history.undo_name == "Accept octo"
    assert session.state.layout == load_layout("octo")
    assert session.state.target[0] == 2.5
    left, right = looked_at(session).both
    assert right.is_this and left.state.layout == ucat, "both still stand there"
    assert session.undo() == "Accept octo"
    assert session.state.layout == ucat
    left, right = looked_at(session).both
    assert left.is_this and right.title == "Shipped: octo", "the pair is as it was"
    session.redo()
    left, right = looked_at(session).both
    assert right.is_this and left.state.layout == ucat


def test_what_was_chosen_since_stays_at_undo(session: Session) -> None:
    session.two_robots.choose("right", "Shipped: octo")
    session.two_robots.accept("right")
    session.two_robots.choose("left", "Shipped: hexa")
    session.undo()
    left, right = looked_at(session).both
    assert left.title == "Shipped: hexa" and right.is_this


def test_two_of_one_name_are_told_apart(session: Session) -> None:
    """A robot and what it was before have one name, which says nothing."""
    session.new_layout("thruster")
    session.rename_robot("mine")
    session.mirror()
    pair = looked_at(session)
    assert pair.names == ("mine (This robot)", "mine (Before: Mirror left)")
    assert "<i>Before: Mirror left</i>" in figures_table(pair, (None, None), (None, None))
    card = score_card(session.state.layout)
    words = summary(pair, (None, None), (card, None))
    assert words == ("The left one loses axes when left or right fails.",)
    for count, said in ((3, "any of 3 of its 4"), (4, "any of its 4")):
        losses = [replace(card.losses[0], lost=("Fx",) * (k < count)) for k in range(4)]
        (sentence,) = summary(pair, (None, None), (replace(card, losses=tuple(losses)), None))
        assert sentence == f"The left one loses axes when {said} working actuators fails."
    session.two_robots.choose("right", "Shipped: octo")
    pair = looked_at(session)
    assert pair.names == ("mine", "octo")
    assert "Shipped: octo</i>" not in figures_table(pair, (None, None), (None, None))


def test_the_same_robot_is_not_accepted(session: Session) -> None:
    session.toggle_loss("front_left")
    session.toggle_loss("front_left")
    session.two_robots.choose("right", "Before: Fail front_left")
    with pytest.raises(FinlabError, match="the right one is the same as this robot"):
        session.two_robots.accept("right")


def test_damage_comes_along(session: Session) -> None:
    session.toggle_loss("front_left")
    session.mend_all()
    session.two_robots.choose("right", "Before: Mend all")
    looked_at(session)
    session.two_robots.accept("right")
    assert session.state.lost == ("front_left",)


def test_guests_of_one_name_have_titles_of_their_own(session: Session) -> None:
    for name in ("A", "B"):
        session.two_robots.welcome("right", "Link: mine", load_layout(name), ())
    assert titles(session).count("Link: mine") == titles(session).count("Link: mine (2)") == 1
    assert session.drawer == TWO_ROBOTS
    assert looked_at(session).right.state.layout == load_layout("B")


def test_the_answers_and_cards_are_those_of_each_robot(
    session: Session, pool: Pool, solver: Solver
) -> None:
    session.two_robots.choose("right", "Shipped: bluerov2_heavy")
    pairing = Pairing(context_of(pool, session, solver))
    pair = looked_at(session)
    pairing.ask(pair)
    assert pairing.cards.busy
    until(lambda: not (pairing.left.busy or pairing.right.busy or pairing.cards.busy))
    assert pairing.cards.answer is not None
    for index, standing in enumerate(pair.both):
        reply = pairing.reply(index, pair)
        assert reply is not None
        layout = standing.state.layout
        answer = Allocator(layout).allocate(session.state.target)
        assert reply.answer.power == pytest.approx(answer.power, rel=1e-9)
        card = pairing.cards.answer[index]
        assert card is not None
        assert card.authority == score_card(layout).authority
    replies = (pairing.left.answer, pairing.right.answer)
    table = figures_table(pair, replies, pairing.cards.answer)
    assert table.count("aria-label='better'") == 1 + 2 + 6, (
        "power, both figures of the weakest direction, and all axes"
    )
    assert "<td class='better'>" in table.split("power [W]")[1].split("</td>", 1)[1][:60]
    words = summary(pair, replies, pairing.cards.answer)
    ratio = replies[1].answer.power / replies[0].answer.power  # type: ignore[union-attr]
    assert f"the right one takes {ratio:.3g}" in words[0]
    assert "The right one reaches further along all 6 axes." in words
    losses = losses_tables(pair, pairing.cards.answer)
    assert losses.count("swatch") == 4 + 8
    session.two_robots.choose("left", "Shipped: octo")
    other = looked_at(session)
    assert pairing.reply(0, other) is None, "what is known is of another robot"
    assert pairing.reply(1, other) is pairing.right.answer


def test_cards_can_be_given_up_and_made_again(session: Session, pool: Pool) -> None:
    session.two_robots.choose("right", "Shipped: octo")
    pairing = Pairing(context_of(pool, session))
    pair = looked_at(session)
    cards = (CardQuestion.of_state(pair.left.state), CardQuestion.of_state(pair.right.state))
    pairing.cards.ask(cards, at_once=True)
    pairing.cards.stop()
    until(lambda: not pairing.cards.busy)
    assert pairing.cards.answer is not None and pairing.cards.answer[1] is None
    pairing.compare_again()
    until(lambda: not pairing.cards.busy)
    assert None not in pairing.cards.answer


@pytest.mark.parametrize(
    ("left", "right", "is_less_better", "better"),
    [
        (1.0, 2.0, False, 1),
        (1.0, 2.0, True, 0),
        (2.0, 1.0, True, 1),
        (1.0, 1.0005, True, None),
        (0.0, 0.0, True, None),
        (None, 1.0, False, None),
    ],
)
def test_the_better_figure_is_marked(
    left: float | None, right: float | None, is_less_better: bool, better: int | None
) -> None:
    row = FigureRow("", [Figure("", left), Figure("", right)], is_less_better)
    assert row.better == better


def test_less_power_for_less_wrench_is_no_merit(
    session: Session, pool: Pool, solver: Solver
) -> None:
    session.set_target(0, 100.0)  # beyond U-CAT, within BlueROV2
    session.two_robots.choose("right", "Shipped: bluerov2_heavy")
    pairing = Pairing(context_of(pool, session, solver))
    pair = looked_at(session)
    pairing.ask(pair)
    until(lambda: not (pairing.left.busy or pairing.right.busy))
    table = figures_table(pair, (pairing.left.answer, pairing.right.answer), (None, None))
    power = table.split("power [W]")[1].split("</tr>")[0]
    assert "better" not in power
    assert "exact" in table and "surge" in table.split(">missing<")[1].split("</tr>")[0]


@pytest.mark.parametrize("view", CAMERAS)
@pytest.mark.parametrize(("left", "right"), [("ucat", "bluerov2_heavy"), ("torpedo", "fish")])
def test_both_stand_apart_left_and_right_in_each_view(view: str, left: str, right: str) -> None:
    layouts = [load_layout(name) for name in (left, right)]
    placed = placement(layouts[0], layouts[1], view)
    eye = np.array(CAMERAS[view])
    toward = -eye / np.linalg.norm(eye)
    to_the_right = np.cross(toward, [0.0, 0.0, 1.0])
    to_the_right /= np.linalg.norm(to_the_right)
    apart = float((placed.right - placed.left) @ to_the_right)
    widths = [half_extent(layout, to_the_right) for layout in layouts]
    assert apart > sum(widths)
    assert float((placed.right - placed.left) @ toward) == pytest.approx(0.0, abs=1e-12), (
        "neither is nearer to the camera"
    )
    assert placed.down[2] <= 0.0
    assert float(placed.down @ to_the_right) == pytest.approx(0.0, abs=1e-12)
    outer = widths[0] - float(placed.left @ to_the_right)
    assert outer == pytest.approx(widths[1] + float(placed.right @ to_the_right), rel=1e-9)


def test_arrows_of_both_have_one_scale_that_fits() -> None:
    target = (40.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    answers = [Allocator(load_layout(name)).allocate(target) for name in ("ucat", "bluerov2_heavy")]
    scale = pair_scale(target, [*answers, None], Scale(1.0, 1.0, 1.0))
    largest = max(float(np.linalg.norm(answer.wrench[:3])) for answer in answers)
    assert LENGTH * largest / scale.newtons <= ARROWS[1] + 1e-12


def test_a_link_carries_both_and_the_wrench() -> None:
    wrench = "1.2,0,0,0,0,0.25"
    left, right = [files.packed(load_layout(name)) for name in ("ucat", "octo")]
    link = f"{files.FRAGMENT}{left}{files.WRENCH}{wrench}{files.BESIDE}{right}"
    assert files.parts_of_link(link) == (left, wrench, right)
    assert files.parts_of_link(f"{files.FRAGMENT}{left}{files.WRENCH}{wrench}") == (
        left,
        wrench,
        "",
    )
    assert files.parts_of_link(f"{files.FRAGMENT}{left}") == (left, "", "")
    assert files.parts_of_link("") == ("", "", "")
    for part, name in ((left, "ucat"), (right, "octo")):
        opened: Opened = files.unpacked(part)
        assert opened.layout == load_layout(name)


def test_before_is_the_state_just_before(session: Session) -> None:
    assert session.before is None
    first = session.state.layout
    session.select("front_left")
    session.duplicate()
    second = session.state.layout
    session.delete()
    session.set_target(0, 2.0)
    before = session.before
    assert before is not None and before.layout == second
    session.toggle_loss("back_left")
    before = session.before
    assert before is not None and (before.layout, before.lost) == (first, ())
    session.open_layout(load_layout("octo"))
    assert session.before is None, "another robot is nothing to compare with"


def test_a_source_keeps_what_is_asked(session: Session) -> None:
    source = Source("mine", State(load_layout("octo")))
    session.set_speed(0.5)
    state = source.state_for(session.state)
    assert state.speed == 0.5 and state.layout.name == "octo"
    assert math.isclose(state.target[0], session.state.target[0])
