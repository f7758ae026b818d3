"""What files of others leave open is asked: as data, with choices and likely answers."""

import pickle
from collections.abc import Mapping

import numpy as np
import pytest

from finlab.errors import LayoutError
from finlab.exchange import Exchange, Question, QuestionError, Reading, read_asking, read_robot
from finlab.exchange.exchange import KNOWN_THRUSTERS, T200_FORCE
from finlab.exchange.inquiry import exchange_of
from finlab.layout import Fin, Thruster
from tests.t200 import t200_rows

PLAIN_URDF = """<robot name="sub">
  <link name="base"><inertial><mass value="11"/>
    <inertia ixx="0.2" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"/><link name="thruster_left"/><link name="prop2"/><link name="tail_fin"/>
  <joint name="j0" type="revolute"><parent link="base"/><child link="arm"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
  <joint name="j1" type="continuous"><parent link="base"/><child link="thruster_left"/>
    <origin xyz="-0.3 0.2 0"/><axis xyz="1 0 0"/></joint>
  <joint name="j2" type="continuous"><parent link="base"/><child link="prop2"/>
    <origin xyz="-0.3 -0.2 0"/><axis xyz="1 0 0"/></joint>
  <joint name="j3" type="revolute"><parent link="base"/><child link="tail_fin"/>
    <origin xyz="-0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
</robot>"""
"""A description in which no plugin says what pushes."""
MATRIX = "matrix:\n  Fx: [1, 1, 0]\n  Fz: [0, 0, 1]\n  Tz: [-0.3, 0.3, 0]\n"
"""An allocation matrix per newton, without a frame and without limits."""
MODEL = """<model name="{}"><link name="hull"><inertial><mass>5</mass></inertial></link>
  <link name="screw"/><joint name="j" type="revolute"><parent>hull</parent><child>screw</child>
  <axis><xyz>1 0 0</xyz></axis></joint>
  <plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster">
  <joint_name>j</joint_name><min_thrust_cmd>-5</min_thrust_cmd><max_thrust_cmd>7</max_thrust_cmd>
  </plugin></model>"""
"""A model of SDF with one thruster."""
TWO_ROBOTS = (
    f"<sdf version='1.9'><world name='w'>{MODEL.format('one')}{MODEL.format('two')}</world></sdf>"
)


def by_option(reading: Reading) -> Mapping[str, Question]:
    """The questions of a reading."""
    return {question.option: question for question in reading.questions}


def default_answers(reading: Reading) -> dict[str, tuple[str, ...]]:
    """The likely answer to each question."""
    return {question.option: question.default for question in reading.questions}


def test_a_plain_urdf_asks_which_links_push_and_guesses_by_their_names() -> None:
    reading = read_asking(PLAIN_URDF, "sub.urdf", {})
    asked = by_option(reading)
    assert [*asked] == ["thrusters", "fins", "missing_force"]
    pushing = asked["thrusters"]
    assert pushing.takes_several and {*pushing.default} == {"thruster_left", "prop2"}
    assert {choice.value for choice in pushing.choices} == {
        "arm",
        "thruster_left",
        "prop2",
        "tail_fin",
    }
    assert "j1" in pushing.choices[-1].meaning or "-0.3" in " ".join(
        choice.meaning for choice in pushing.choices
    )
    assert asked["fins"].default == ("tail_fin",)
    answers = {**default_answers(reading), "missing_force": ("-12", "15.5")}
    answered = read_asking(PLAIN_URDF, "sub.urdf", answers)
    assert answered.questions == () and answered.layout is not None
    actuators = {actuator.name: actuator for actuator in answered.layout.actuators}
    assert {*actuators} == {"thruster_left", "prop2", "tail_fin"}
    assert isinstance(actuators["tail_fin"], Fin)
    left = actuators["thruster_left"]
    assert isinstance(left, Thruster) and left.force == (-12.0, 15.5)


def test_a_plain_urdf_without_a_likely_name_is_asked_before_anything_is_read() -> None:
    text = PLAIN_URDF.replace("thruster_left", "a").replace("prop2", "b").replace("tail_fin", "c")
    reading = read_asking(text, "sub.urdf", {})
    assert reading.layout is None and by_option(reading)["thrusters"].default == ()
    answered = read_asking(text, "sub.urdf", {"thrusters": ("a",), "fins": ()})
    assert [question.option for question in answered.questions] == ["missing_force"]
    with pytest.raises(LayoutError, match="Which links push"):
        read_asking(text, "sub.urdf", {"thrusters": (), "fins": ()})


def test_the_frame_is_asked_with_what_it_would_mean() -> None:
    reading = read_asking(MATRIX, "tam.yaml", {})
    frame = by_option(reading)["frame"]
    flu, frd = frame.choices
    assert frame.default == ("FLU",) == (flu.value,)
    # Column 1 pushes ahead with Tz -0.3: its line is at y = +0.3, at the left where y is so.
    assert flu.meaning == "thruster1 sits at the left, thruster3 pushes up"
    assert frd.meaning == "thruster1 sits at the right, thruster3 pushes down"
    for choice, side in ((flu, 1.0), (frd, -1.0)):
        answered = read_asking(
            MATRIX, "tam.yaml", {"frame": (choice.value,), "missing_force": ("T200 at 16 V",)}
        )
        assert answered.layout is not None and answered.questions == ()
        np.testing.assert_allclose(answered.layout.position[0], [0.0, 0.3 * side, 0.0], atol=1e-12)
        assert answered.layout.actuators[2].direction == (0.0, 0.0, side)


def test_a_frame_that_nobody_knows_is_asked() -> None:
    text = "frame: sideways\n" + MATRIX
    reading = read_asking(text, "tam.yaml", {})
    assert "sideways" in by_option(reading)["frame"].why
    answered = read_asking(text, "tam.yaml", default_answers(reading))
    assert answered.layout is not None and answered.questions == ()


def test_of_several_robots_one_is_chosen() -> None:
    reading = read_asking(TWO_ROBOTS, "boats.sdf", {})
    robot = by_option(reading)["model"]
    assert [choice.value for choice in robot.choices] == ["one", "two"]
    assert robot.default == ("one",)
    answered = read_asking(TWO_ROBOTS, "boats.sdf", {"model": ("two",)})
    assert answered.layout is not None and answered.layout.name == "two"
    assert not any("one" in str(note) for note in answered.notes)


def test_a_file_without_masses_asks_for_the_centre_of_gravity() -> None:
    text = PLAIN_URDF.replace('<mass value="11"/>', '<mass value="0"/>')
    reading = read_asking(text, "sub.urdf", {})
    assert by_option(reading)["origin"].default == ("base",)
    answered = read_asking(text, "sub.urdf", default_answers(reading))
    assert answered.layout is not None and answered.layout.body is None


def test_a_length_without_a_unit_is_asked_with_what_each_would_mean() -> None:
    text = '[{"name": "bow", "position": [260, 0, 0], "direction": [1, 0, 0]}]'
    reading = read_asking(text, "team.json", {})
    length = by_option(reading)["length"]
    assert [choice.value for choice in length.choices] == ["mm", "cm", "m"]
    assert length.choices[0].meaning == "the farthest thruster is 0.26 m away"
    answered = read_asking(text, "team.json", {**default_answers(reading), "length": ("cm",)})
    assert answered.layout is not None
    np.testing.assert_allclose(answered.layout.position[0], [2.6, 0.0, 0.0])


def test_rows_without_labels_are_asked() -> None:
    rows = "\n".join(",".join(["0.9"] * 6) for _ in range(6))
    reading = read_asking(rows, "tam.csv", {})
    assert [choice.value for choice in by_option(reading)["rows"].choices] == ["axes", "thrusters"]
    nine = "\n".join(",".join(["0.9"] * 6) for _ in range(9))
    reading = read_asking(nine, "tam.csv", {})
    assert [choice.value for choice in by_option(reading)["rows"].choices] == ["thrusters"]


def test_without_answers_the_command_line_takes_the_default_or_names_the_option() -> None:
    exchange = Exchange()
    layout = read_robot(MATRIX, "tam.yaml", exchange)
    assert isinstance(layout.actuators[0], Thruster) and layout.actuators[0].force == T200_FORCE
    assert any("--frame FRD" in note for note in exchange.notes)
    with pytest.raises(QuestionError, match="--thrusters LINK") as error:
        read_robot(PLAIN_URDF, "sub.urdf", Exchange())
    # Files are read in a process of their own, and errors come back from there.
    same = pickle.loads(pickle.dumps(error.value.with_prefix("", "sub.urdf")))
    assert same.questions == error.value.questions and same.source == "sub.urdf"


def test_notes_are_in_the_files_words_and_say_which_field_holds_what_was_taken() -> None:
    reading = read_asking(MATRIX, "tam.yaml", {})
    notes = {note.field: note for note in reading.notes if note.field}
    assert {*notes} == {"position", "force", "model"}
    for note in reading.notes:
        assert "--" not in note.sentence and "`" not in note.sentence.replace("`axes`", "")
    assert notes["force"].actuators == ("thruster1", "thruster2", "thruster3")


def test_forces_of_known_thrusters_are_their_makers() -> None:
    for volts in (12, 16, 20):
        forces = [row[1] for row in t200_rows(volts)]
        assert KNOWN_THRUSTERS[f"T200 at {volts} V"] == (min(forces), max(forces))
    assert exchange_of({"missing_force": ("-1", "2")}).missing_force == (-1.0, 2.0)
    with pytest.raises(LayoutError, match="two numbers"):
        exchange_of({"missing_force": ("strong",)})


def test_an_answer_for_unknown_forces_leaves_known_ones_alone() -> None:
    text = MATRIX + "limits:\n  thruster1: [-3, 4]\n"
    both = "thrusters:\n  a: {position: [0, 1, 0], direction: [1, 0, 0], limits: [-3, 4]}\n"
    both += "  b: {position: [0, -1, 0], direction: [1, 0, 0]}\n"
    reading = read_asking(both, "team.yaml", {})
    assert "missing_force" in by_option(reading), text
    answers = {"frame": ("FLU",), "missing_force": ("-8", "9")}
    answered = read_asking(both, "team.yaml", answers)
    assert answered.layout is not None
    forces = [actuator.force for actuator in answered.layout.actuators]  # type: ignore[attr-defined]
    assert forces == [(-3.0, 4.0), (-8.0, 9.0)]
