"""Guesses by the names of links what they are, for questions about a description that does not say
it."""

import re
from collections.abc import Mapping, Sequence

from finlab.exchange.links import TURNING, Joint
from finlab.exchange.questions import Choice, Question, which_links

_THRUSTER_NAME = re.compile(
    r"thruster|propell|(?:^|[_\W])prop(?:[_\W\d]|$)|rotor|screw", re.IGNORECASE
)
"""A name by which people call a thruster or its propeller."""
_FIN_NAME = re.compile(r"(?:^|[_\W])fin(?:[_\W\d]|s|$)|flipper|paddle", re.IGNORECASE)
"""A name by which people call a fin that flaps."""


def is_thruster_name(text: str) -> bool:
    """Whether a text has a name by which people call a thruster or its propeller."""
    return bool(_THRUSTER_NAME.search(text))


def turning_first(joint_of_link: Mapping[str, Joint]) -> list[str]:
    """Returns the links that a joint moves, those on joints that turn first, by name."""
    return sorted(joint_of_link, key=lambda link: (joint_of_link[link].kind not in TURNING, link))


def questions_of_links(joint_of_link: Mapping[str, Joint]) -> tuple[Question, ...]:
    """Returns the questions which links push and which are fins; none where no joint moves any.

    Args:
        joint_of_link: the joints by the names of the links that they move.
    """
    if not joint_of_link:
        return ()
    pushing = []
    finned = []
    others = []
    for link in turning_first(joint_of_link):
        names = f"{link} {joint_of_link[link].name}"
        if is_thruster_name(names):
            pushing.append(link)
        elif _FIN_NAME.search(names):
            finned.append(link)
        else:
            others.append(link)
    kinds = {}
    for link in (*pushing, *finned, *others):
        joint = joint_of_link[link]
        x, y, z = joint.position + 0.0
        kinds[link] = f"{joint.kind} {joint.name}, at {x:.3g} {y:.3g} {z:.3g} m"
    return which_links(kinds, tuple(pushing), tuple(finned))


def which_idle(links: Sequence[str]) -> Question:
    """Returns the question which links push beside those that plugins drive; none is taken without
    an answer."""
    return Question(
        "thrusters",
        "Which of these push, too?",
        "No plugin of the file drives them.",
        tuple(Choice(link, link) for link in links),
        (),
        takes_several=True,
    )
