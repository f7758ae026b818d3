"""Lessons: the list of commands opens a prepared state with a sentence, a task and its check."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.session.files import shipped
from webapp.session.looking import Desk
from webapp.session.state import State, least_of
from webapp.session.targets import PRESETS
from webapp.session.tour import Guiding

ALIGNED = 0.999
"""Cosine from which what is delivered points where it was asked."""

Target = tuple[float, float, float, float, float, float]


class Seen(NamedTuple):
    """What a check is given."""

    state: State
    """The question."""
    answer: Allocation
    """What is on the robot."""
    mode: int
    """Which of the answer's modes that is."""

    @property
    def delivered(self) -> bool:
        """Whether the wrench is what was asked for."""
        return self.answer.reachable


@dataclass(frozen=True)
class Lesson:
    """A prepared state, and what to do in it."""

    name: str
    title: str
    text: str
    exercise: str
    praise: str
    """What has been shown once it is done."""
    layout: str
    """Shipped layout."""
    target: Target
    """Wrench that is asked for [N, N m]."""
    done: Callable[[Seen], bool]
    """Whether the exercise is done."""
    method: str = "dual"
    """Method that answers at first."""
    task: str = "Allocate"
    """Task of the page that is opened."""

    def state(self, now: State) -> State:
        """The prepared state, with nothing left of the present one but its numbers for drawing."""
        plain = State(shipped()[self.layout], target=self.target, method=self.method)
        kept = {key: getattr(now, key) for key in ("n_candidates", "temperature", "gamma")}
        return replace(plain, **kept)


def _aligned(seen: Seen) -> bool:
    """Whether something is delivered, and in the direction that was asked for."""
    given, asked = (wrench / seen.answer.scale for wrench in (seen.answer.wrench, seen.answer.target))
    size = float(np.linalg.norm(given) * np.linalg.norm(asked))
    return size > 0.0 and float(given @ asked) / size > ALIGNED


LESSONS = (
    Lesson(
        "two-ways",
        "One wrench, several ways",
        "Four fins have twelve numbers, a wrench has six. Where the paper's effort is kept least, there are "
        "several minima: a network proposes them, and the numbered dots below are its ways, made exact.",
        "Show another dot than the first. Which fins change, and what stays?",
        "The fins changed, the green arrows did not: the robot feels the same force and torque.",
        "ucat",
        PRESETS["Turn"],
        lambda seen: seen.mode > 0 and seen.delivered,
        method="mdn",
    ),
    Lesson(
        "watts-or-effort",
        "Watts are not effort",
        "Effort, the paper's measure, adds up how far and how fast fins flap. Its cheapest answer lets some "
        "fins rest. Watts grow faster than force, so they are least where all fins share the work.",
        "In the bar above, keep watts least. What do the resting fins do now?",
        "More fins work, each a little, and the robot needs fewer watts for the same wrench.",
        "hexa",
        (1.5, 0.0, 0.0, 0.0, 0.0, 0.1),
        lambda seen: least_of(seen.state.method) == "watts" and seen.delivered,
        method="mdn",
    ),
    Lesson(
        "lost-fin",
        "A fin is lost",
        "Nothing has to be built or trained for it: the fin is left out, and the wrench is divided among the "
        "others, as long as they can give it.",
        "Fail a fin by its number at the left, so that nothing is left undone.",
        "Three fins are enough for this turn. Fail a second one: which axis is missing then?",
        "ucat",
        PRESETS["Turn"],
        lambda seen: bool(seen.state.failed) and seen.delivered,
    ),
    Lesson(
        "no-yaw",
        "What a layout cannot do",
        "All shafts of this robot lie along one line, so no fin can push where it would turn the robot left "
        "or right. No method can change that: the placement of the fins decides.",
        "Under Design, select a fin and turn its shaft until the yaw is delivered.",
        "One turned shaft gave the robot an axis. The card of the design says what each fin is worth.",
        "no_yaw",
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.2),
        lambda seen: seen.state.layout.fins != shipped()["no_yaw"].fins and seen.delivered,
        task="Design",
    ),
    Lesson(
        "out-of-reach",
        "Out of reach",
        "This wrench is more than the fins can give. By the policy closest the error is as small as can be, "
        "and what is delivered may point elsewhere than what was asked.",
        "Choose the policy direction. What happens to the arrows?",
        "Less is delivered, in the asked proportions: a robot that is asked for too much still goes where it "
        "should.",
        "ucat",
        (30.0, 6.0, 0.0, 0.0, 0.0, 4.0),
        lambda seen: seen.state.policy == "direction" and not seen.delivered and _aligned(seen),
    ),
    Lesson(
        "learned-physics",
        "What a network believes",
        "The paper's method learns the physics of the fins from samples, and draws its answers from a "
        "mixture. The status line judges every answer by the fins' own law, whatever the method believes.",
        "In the bar above, choose the method paper, and compare the errors.",
        "A few hundredths: what the network has not learnt. Draw the fin a little larger under Design, and "
        "the paper's method does not notice.",
        "A",
        (1.0, 0.0, 0.5, 0.0, 0.0, 0.1),
        lambda seen: seen.state.method == "paper" and seen.answer.method == "paper",
    ),
)
"""All of them, in the order of a course."""
BY_NAME = {lesson.name: lesson for lesson in LESSONS}


class Learning(Guiding):
    """A lesson that is open."""

    lesson: Lesson | None = None
    """It, if any."""
    solved = False
    """Whether its exercise has been done since it was opened."""

    def open_lesson(self, name: str) -> None:
        """Prepare a lesson's state; what was there before comes back when it is closed.

        Raises:
            FinlabError: there is no such lesson.
        """
        if name not in BY_NAME:
            raise FinlabError(f"lesson: expected one of {', '.join(BY_NAME)}, got {name!r:.40}")
        lesson = BY_NAME[name]
        self.end_tour()
        self._leave()
        self._commit(f"Lesson: {lesson.title}", lesson.state(self.state))
        self.lesson, self.solved = lesson, False
        self.mode, self.selected = 0, None
        self.desk = Desk(lesson.task)

    def next_stop(self) -> None:
        """The tour's next stop, after the lesson is closed."""
        self.close_lesson()
        super().next_stop()

    def next_lesson(self) -> None:
        """The one after this; after the last one they are over."""
        names = list(BY_NAME)
        place = names.index(self.lesson.name) + 1 if self.lesson else 0
        if place < len(names):
            self.open_lesson(names[place])
        else:
            self.close_lesson()

    def close_lesson(self) -> None:
        """Back to the work."""
        if self.lesson is not None:
            self.lesson, self.solved = None, False
            self._come_back()

    def take(self, answer: Allocation) -> None:
        """See what the fins do now; an exercise that is done stays so until another lesson is opened."""
        if self.lesson is not None and answer.layout == self.state.able:
            self.solved = self.solved or self.lesson.done(Seen(self.state, answer, self.mode))

    def start_over(self) -> None:
        """Everything as at first sight, outside of tour and lessons; nothing comes back."""
        self.lesson, self.solved, self.stop, self._left = None, False, None, None
        super().start_over()
