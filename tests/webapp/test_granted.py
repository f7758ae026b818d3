"""What was taken for granted of an opened file: asked in a dialog, listed, settled row by row."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from finlab.errors import FinlabError, LayoutError
from finlab.exchange import Question
from finlab.exchange.exchange import T200_FORCE, WHICH_FORCE
from finlab.layout import layout_to_dict, load_layout
from finlab.swim.design_files import Opened
from tests.actuators.test_propeller_rudder import JOINED, RUDDER, THRUSTER, boat_of
from tests.exchange.test_questions import MATRIX, PLAIN_URDF, TWO_ROBOTS
from webapp.box_labels import box_label, in_boxes
from webapp.inquiry import checked_answer
from webapp.markup.words import in_app
from webapp.panels.granted_card import granted_markup
from webapp.session import Session
from webapp.session.granted import Granted, SourceFile
from webapp.tasks.fitting import FitResult, Upload, WhichVoltage, fit_upload
from webapp.tasks.importing import Importing, rows_of
from webapp.tasks.slot import Work


class Dialog:
    """Stands for the page's dialog."""

    def __init__(self) -> None:
        self.text = ""
        self.questions: tuple[Question, ...] = ()
        self._take: Callable[[Any], object] | None = None

    def ask(
        self, title: str, text: str, questions: tuple[Question, ...], take: Callable[[Any], object]
    ) -> None:
        """Keep what is asked."""
        self.text = f"{title} {text}"
        self.questions = questions
        self._take = take

    def answer(self, **answers: tuple[str, ...]) -> None:
        """Answer, by the likely answers where nothing else is said."""
        given = {question.option: question.default for question in self.questions}
        take = self._take
        assert take is not None
        self.questions = ()
        take({**given, **answers})


class Now:
    """Stands for `Deferred`: work is done at once."""

    def make(self, work: Callable[[], Any], use: Callable[[Any], object], _kind: object) -> None:
        """Do the work, and use its result."""
        use(work())


@pytest.fixture
def page() -> tuple[Session, Dialog, Importing]:
    """A session, its dialog, and what opens files in it."""
    session = Session(load_layout("ucat"))
    dialog = Dialog()

    def take(opened: Opened, source: SourceFile) -> None:
        session.open_layout(opened.layout, **rows_of(opened, source))

    return session, dialog, Importing(session, dialog, Now(), take)  # type: ignore[arg-type]


Page = tuple[Session, Dialog, Importing]


def row_of(session: Session, field: str) -> Granted:
    """The row about a field."""
    return next(row for row in session.state.granted if row.field == field)


def test_a_file_is_opened_with_the_answers_and_undo_takes_it_back(page: Page) -> None:
    session, dialog, importing = page
    before = session.state
    importing.open("sub.urdf", PLAIN_URDF.encode())
    assert session.state is before and "sub.urdf" in dialog.text
    assert [question.option for question in dialog.questions] == [
        "thrusters",
        "fins",
        "missing_force",
    ]
    dialog.answer(fins=())
    assert session.state.layout.names == ("prop2", "thruster_left")
    assert {row.option for row in session.state.granted if row.is_confirmed} == {
        "thrusters",
        "fins",
        "missing_force",
    }
    assert not row_of(session, "model").is_settled(session.state.layout)
    session.undo()
    assert session.state is before and session.state.granted == ()


def test_answers_that_do_not_do_are_asked_again(page: Page) -> None:
    session, dialog, importing = page
    importing.open("sub.urdf", PLAIN_URDF.encode())
    dialog.answer(thrusters=(), fins=())
    assert session.state.layout.name == "ucat" and "Choose others" in dialog.text
    assert dialog.questions != ()
    dialog.answer(thrusters=("arm",))
    assert session.state.layout.names == ("arm",)


def test_rows_settle_as_the_user_corrects_or_confirms_them(page: Page) -> None:
    session, dialog, importing = page
    importing.open("tam.yaml", MATRIX.encode())
    dialog.answer()
    position = row_of(session, "position")
    names = session.state.layout.names
    assert position.left(session.state.layout) == names
    for name in names:
        session.select(name)
        x, y, z = session.state.layout.actuator(name).position
        session.place_selected((x + 0.1, y, z))
    assert row_of(session, "position").is_settled(session.state.layout)
    session.undo()
    assert row_of(session, "position").left(session.state.layout) == names[-1:]
    model = row_of(session, "model")
    session.confirm(model)
    assert row_of(session, "model").is_settled(session.state.layout)
    assert session.undo().startswith("Confirm")
    assert not row_of(session, "model").is_settled(session.state.layout)


def test_rows_follow_a_new_name_and_forget_what_is_deleted(page: Page) -> None:
    session, dialog, importing = page
    importing.open("tam.yaml", MATRIX.encode())
    dialog.answer()
    first, second, third = session.state.layout.names
    session.rename(first, "port")
    assert row_of(session, "position").left(session.state.layout) == ("port", second, third)
    session.select(second)
    session.delete()
    assert row_of(session, "position").left(session.state.layout) == ("port", third)


def test_a_question_can_be_asked_again(page: Page) -> None:
    session, dialog, importing = page
    importing.open("boats.sdf", TWO_ROBOTS.encode())
    dialog.answer(model=("two",))
    assert session.state.layout.name == "two"
    importing.ask_again("model")
    (question,) = dialog.questions
    assert question.default == ("two",) and "Undo" in dialog.text
    dialog.answer(model=("one",))
    assert session.state.layout.name == "one"
    session.undo()
    assert session.state.layout.name == "two"
    with pytest.raises(FinlabError, match="from no file"):
        importing.ask_again("rows")


def test_the_card_names_boxes_and_no_keys_or_options(page: Page) -> None:
    session, dialog, importing = page
    importing.open("tam.yaml", MATRIX.encode())
    dialog.answer()
    state = session.state
    markup = granted_markup(state.granted, state.source, state.layout)
    assert "Position of all" in markup and "2 of 4 settled" in markup
    assert "tam.yaml" in markup and "also read" in markup.lower()
    for word in ("--", "position_m", "force_n", "finlab "):
        assert word not in markup
    assert granted_markup((), None, state.layout) == ""


def test_a_design_of_finlab_and_another_robot_have_no_such_list(page: Page) -> None:
    session, dialog, importing = page
    importing.open("tam.yaml", MATRIX.encode())
    dialog.answer()
    session.open_layout(load_layout("ucat"))
    assert session.state.granted == () and session.state.source is None
    session.undo()
    assert len(session.state.granted) == 4


def test_a_rudder_that_is_read_into_its_screw_is_listed_with_its_box(page: Page) -> None:
    session, _, importing = page
    importing.open("boat.json", json.dumps(boat_of(THRUSTER, RUDDER)).encode())
    row = row_of(session, "slipstream")
    assert row.sentence == JOINED and row.left(session.state.layout) == ("screw",)
    markup = granted_markup(session.state.granted, session.state.source, session.state.layout)
    assert "Slipstream" in markup and "alone" not in markup
    session.select("screw")
    session.duplicate()
    copy = session.state.layout.actuator("screw_2")
    assert copy.parts == ()
    saved = json.dumps(layout_to_dict(session.state.layout))
    importing.open("boat.json", saved.encode())
    assert session.state.granted == (), "what is written as one is not taken for granted"


@pytest.mark.parametrize(
    ("sent", "answer"),
    [
        (["T200 at 12 V"], ("T200 at 12 V",)),
        (["-0,5", "1e2"], ("-0.5", "100")),
        (["−3", " 4 "], ("-3", "4")),
    ],
)
def test_a_force_is_chosen_or_typed(sent: list[str], answer: tuple[str, ...]) -> None:
    assert checked_answer(WHICH_FORCE, sent) == answer


@pytest.mark.parametrize(
    "sent",
    [[], None, ["T300"], ["1", "2"], ["a", "b"], ["", ""], ["-1", "1e10"], ["0", "0"], [[1]]],
)
def test_what_a_page_sends_is_checked(sent: Any) -> None:
    with pytest.raises(FinlabError):
        checked_answer(WHICH_FORCE, sent)


@pytest.mark.parametrize(
    ("field", "kind", "label"),
    [
        ("force", "thruster", "Force [N]"),
        ("dead_band", "thruster", "Dead band [N]"),
        ("time_constant", "thruster", "Lag [s]"),
        ("forward", "", "Ahead [W]"),
        ("position", "thruster", "Position [m]"),
        ("body.mass_kg", "", "Mass [kg]"),
        ("body.added_mass", "", "Added mass [kg]"),
        ("nothing", "", ""),
    ],
)
def test_fields_have_the_labels_of_their_boxes(field: str, kind: str, label: str) -> None:
    assert box_label(field, kind) == label


def test_errors_name_boxes_in_their_units() -> None:
    session = Session(load_layout("bluerov2_heavy"))
    session.select("front_right")
    with pytest.raises(LayoutError) as error:
        session.set_value("time_constant", -1.0)
    assert in_boxes(error.value).startswith("Lag [s] of thruster 'front_right': must lie within 0")
    fins = Session(load_layout("ucat"))
    fins.select(fins.state.layout.names[0])
    with pytest.raises(LayoutError) as error:
        fins.set_value("amplitude", (3.0, 1.0))
    assert in_boxes(error.value) == "A [°]: must lie within 0 .. 90, got 171.9"
    of_file = LayoutError("must lie within 0 .. 1", "force_n[0]", "robot.yaml")
    assert in_boxes(of_file) == str(of_file)


def test_sentences_of_the_library_lose_the_command_lines_words() -> None:
    for sentence in (
        "is a xacro file, not a description; `finlab layout convert` expands it",
        "holds measurements (power); `finlab fit` reads them",
        "rates differ; correct `force_n`.",
    ):
        assert "finlab " not in in_app(sentence) and "_n`" not in in_app(sentence)


def test_the_unknown_force_is_that_of_a_t200_until_it_is_answered(page: Page) -> None:
    session, dialog, importing = page
    importing.open("tam.yaml", MATRIX.encode())
    force = next(q for q in dialog.questions if q.option == "missing_force")
    assert force.default == ("T200 at 16 V",)
    dialog.answer()
    assert session.state.layout.actuators[0].force == T200_FORCE  # type: ignore[attr-defined]
    assert json.dumps(dict(session.state.source.answers))  # type: ignore[union-attr]


def test_a_bench_of_several_voltages_asks_which_counts() -> None:
    rows = ["pwm,thrust (kgf),power,voltage"]
    for volts, scale in ((12, 0.7), (16, 1.0)):
        for step in range(-4, 5):
            force = scale * step * abs(step) / 4.0
            watts = 100.0 * scale * abs(step / 4.0) ** 3 + 1.0
            rows.append(f"{1500 + 100 * step},{force:.3f},{watts:.2f},{volts}")
    thruster = load_layout("bluerov2_heavy").actuators[0]
    upload = Upload(thruster, "bench.csv", "\n".join(rows).encode())
    work: Work[Upload] = Work(upload, lambda: None)
    asked = fit_upload(upload, work)
    assert isinstance(asked, WhichVoltage) and asked.levels == (12.0, 16.0)
    answered = fit_upload(replace(asked.upload, voltage=12.0), work)
    assert isinstance(answered, FitResult)
    least, most = answered.fields["force"]
    assert most == pytest.approx(0.7 * 4.0 * 9.80665, rel=1e-6) and least == pytest.approx(-most)
