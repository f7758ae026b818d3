"""Topics of single actuators: a name that ROS takes for each number of a command."""

import numpy as np
import pytest
from finlab_allocator.topics import number_topics, topic_names, values_to_send

import finlab


@pytest.mark.parametrize(
    ("names", "topics"),
    [
        (("bow", "stern"), ["bow", "stern"]),
        (
            ("Bug links", "1", "T-1", "T/1", "Ä"),
            ["Bug_links", "actuator_1", "T_1", "T_1_2", "actuator"],
        ),
        (("a", "a_2", "a "), ["a", "a_2", "a_3"]),
        (("__x__", "..."), ["x", "actuator"]),
    ],
)
def test_names_are_those_of_topics_and_different(names: tuple[str, ...], topics: list[str]) -> None:
    assert topic_names(names) == topics


def test_each_number_has_a_topic_and_each_actuator_a_force() -> None:
    fins = number_topics(finlab.load_layout("turtle_hybrid"))
    assert [topic.name for topic in fins[:4]] == [
        "front_right/amplitude",
        "front_right/frequency",
        "front_right/zero_direction",
        "front_right/force",
    ]
    assert [topic.name for topic in fins if topic.actuator == 5] == ["lift_right/force"]
    pods = number_topics(finlab.load_layout("catamaran"))
    assert [(topic.name, topic.number) for topic in pods if topic.actuator == 0] == [
        (f"{finlab.load_layout('catamaran').names[0]}/angle", 0),
        (f"{finlab.load_layout('catamaran').names[0]}/force", 1),
    ]
    rudders = number_topics(finlab.load_layout("torpedo"))
    names = [topic.name.rsplit("/", 1)[1] for topic in rudders]
    assert names.count("deflection") == 4 and names.count("force") == len(
        finlab.load_layout("torpedo").names
    )


def test_a_lost_one_is_sent_to_rest_and_keeps_its_angle() -> None:
    layout = finlab.load_layout("catamaran")
    command = np.array([[0.3, 5.0, 0.0], [0.2, 4.0, 0.0], [3.0, 0.0, 0.0]])
    assert values_to_send(layout, command) is command
    command[0] = np.nan
    sent = values_to_send(layout, command)
    assert np.isnan(sent[0, 0]) and sent[0, 1] == 0.0
    np.testing.assert_array_equal(sent[1:], command[1:])
    assert np.isnan(command[0]).all()
