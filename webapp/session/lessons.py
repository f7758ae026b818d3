"""The tour and the lessons: each stop is a prepared state with words; a lesson has a task and its check."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finlab.allocation.allocation import Allocation
from webapp.session.core import Core
from webapp.session.files import shipped
from webapp.session.looking import Desk
from webapp.session.state import History, State, chosen, least_of
from webapp.session.targets import FIRST

ALIGNED = 0.999
"""Cosine from which what is delivered points where it was asked."""


@dataclass(frozen=True)
class Stop:
    """A prepared state, what there is to see in it, and perhaps something to do."""

    name: str
    title: str
    text: str
    layout: str = "ucat"
    target: tuple[float, float, float, float, float, float] = FIRST
    """Wrench that is asked for [N, N m]."""
    mode: int = 0
    method: str = "dual"
    swims: bool = False
    drawer: str = "Candidates"
    """What lies uppermost in the drawer; its task is open."""
    exercise: str = ""
    praise: str = ""
    done: Callable[[Core, Allocation], bool] = lambda session, answer: False
    """Whether the exercise is, by a session and what is on its robot."""

    @property
    def state(self) -> State:
        """The prepared state, with nothing left of the present one."""
        return State(shipped()[self.layout], target=self.target, method=self.method)


def _aligned(answer: Allocation) -> bool:
    """Whether something is delivered, and in the direction that was asked for."""
    delivered, target = (wrench / answer.scale for wrench in (answer.wrench, np.nan_to_num(answer.target)))
    size = float(np.linalg.norm(delivered) * np.linalg.norm(target))
    return size > 0.0 and float(delivered @ target) / size > ALIGNED


TOUR = (
    Stop(
        "wrench",
        "A wrench becomes flapping",
        "The blue arrow and ring above the hull are what is asked: forward, and a turn to the left. Each fin "
        "answers with amplitude, frequency and direction; its arrow is its mean force. Green is the sum.",
    ),
    Stop(
        "many-ways",
        "One wrench has many answers",
        "Four fins have twelve numbers, the wrench only six. Here a network proposes ways, each is made "
        "exact, and this is the second best. In the plot below each numbered ring is one. Press some: the "
        "fins change, the green sum stays.",
        mode=1,
        method="mdn",
    ),
    Stop(
        "swim",
        "It swims",
        "Ten times a second the controller asks for a wrench and the fins answer. The blue ball is where "
        "the robot should be. Break a fin by its number, and watch the others take over.",
        swims=True,
        drawer="Swim over time",
    ),
    Stop(
        "thrusters",
        "Not fins alone",
        "Two thrusters lift this robot beside its four fins. Fins take little power at light load, thrusters "
        "take what is heavy: ask for more heave, and see who carries it. Finish brings your work back.",
        "turtle_hybrid",
        (1.2, 0.0, 4.0, 0.0, 0.0, 0.25),
    ),
)


LESSONS = (
    Stop(
        "two-ways",
        "One wrench, several ways",
        "Four fins have twelve numbers, a wrench has six: many commands do the same. In the plot below, "
        "small dots are what a network proposes, and thin lines lead from each to the numbered ring where it "
        "ends. The filled ring is on the robot: the answer, number 1.",
        exercise="Press a row with the badge network, or its ring. Which fins change, and what stays?",
        praise="The fins changed, the green arrows did not: the robot feels the same force and torque.",
        done=lambda session, answer: session.mode > 0 and answer.reachable,
    ),
    Stop(
        "refinement",
        "From a sample to an answer",
        "A sample is nearly right: its error is some hundredths of what the robot can push. It is followed "
        "to the least effort near it, first by descent in forces; then its commands are made exact by the "
        "fins' own laws. The plot's error goes up in powers of ten.",
        mode=1,
        exercise="Press Play below the plot. Watch the dots, the fins, and the error below the robot.",
        praise="Now drag Step: at each place stands what the robot would do there. With Loop it begins anew.",
        done=lambda session, _: session.step is not None and session.step > 0,
    ),
    Stop(
        "temperature",
        "Mixture and temperature",
        "The network gives a mixture: components, each with a mean and a spread, for different ways to share "
        "the wrench. First come the means; the other samples are drawn about them, with variances times the "
        "temperature.",
        exercise="Set Temperature to 0, beside the plot, then to 2. What becomes of dots and rings?",
        praise=(
            "At 0 dots lie on the means, at 2 they stray far; the rings stay. The minima belong to the "
            "robot: the network only says where to begin."
        ),
        done=lambda session, _: (session.state.temperature or 0.0) > 1.9,
    ),
    Stop(
        "watts-or-effort",
        "Watts are not effort",
        "Effort, the paper's measure, adds up how far and how fast fins flap. Its cheapest answer lets some "
        "fins rest. Watts grow faster than force, so they are least where all fins share the work.",
        "hexa",
        (1.5, 0.0, 0.0, 0.0, 0.0, 0.1),
        exercise="At Least, in the bar above, choose watts. What do the resting fins do now?",
        praise=(
            "More fins work, each a little, and the robot needs fewer watts. The answer has the badge "
            "optimum: its watts are proved least. What the network proposes stands beside it."
        ),
        done=lambda session, answer: least_of(session.state.method) == "watts" and answer.reachable,
        method="mdn",
    ),
    Stop(
        "lost-fin",
        "A fin is lost",
        "Nothing has to be built or trained for it: the fin is left out, and the wrench is divided among the "
        "others, as long as they can give it.",
        exercise="At Fail, on the left, press the number of a fin, so that nothing is left undone.",
        praise="Three fins are enough for this turn. Fail a second one: which axis is missing then?",
        done=lambda session, answer: bool(session.state.failed) and answer.reachable,
    ),
    Stop(
        "no-yaw",
        "What a layout cannot do",
        "Each fin of this robot pushes along a line through its middle, or up and down, so no command turns "
        "it left or right. No method can change that: the placement of the fins decides.",
        "no_yaw",
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.2),
        exercise="Press a fin in the list, and move Shaft on the right, until below the robot stands Exact.",
        praise="One turned shaft gave the robot an axis. Reach, below, has before and now side by side.",
        done=lambda session, answer: (
            session.state.layout.fins != shipped()["no_yaw"].fins and answer.reachable
        ),
        drawer="Reach",
    ),
    Stop(
        "out-of-reach",
        "Out of reach",
        "This wrench is more than the fins can give. By the policy closest the error is as small as can be, "
        "and what is delivered may point elsewhere than what was asked.",
        "ucat",
        (30.0, 6.0, 0.0, 0.0, 0.0, 4.0),
        exercise="At Out of reach, on the right, choose direction. What happens to the arrows?",
        praise=(
            "Less is delivered, in the asked proportions: a robot that is asked for too much still goes "
            "where it should."
        ),
        done=lambda session, answer: (
            session.state.policy == "direction" and not answer.reachable and _aligned(answer)
        ),
    ),
    Stop(
        "learned-physics",
        "What a network believes",
        "The paper's method learns the physics of the fins from samples, and draws its answers from a "
        "mixture. Below the robot every answer is judged by the fins' own law, whatever the method believes.",
        "A",
        (1.0, 0.0, 0.5, 0.0, 0.0, 0.1),
        exercise="At Method, in the bar above, choose paper, and see the error below the robot.",
        praise=(
            "What is left is what the network has not learnt. Press Compare the methods below: each of them "
            "on this wrench, with its error, costs and time."
        ),
        drawer="Comparison",
        done=lambda session, answer: session.state.method == answer.method == "paper",
    ),
)


BY_NAME = {stop.name: stop for stop in (*TOUR, *LESSONS)}
KEPT = ("history", "saved", "display", "chosen", "mode", "desk")
"""What of a session comes back at the end."""


class Guide:
    """A stop of the tour, or a lesson, that is open; the scene brings its camera back with the work."""

    def __init__(self, session: Core) -> None:
        self._session = session
        self.stop: Stop | None = None
        self.solved = False
        """Whether its exercise has been done since it was opened."""
        self._left: dict[str, Any] = {}
        """The work as it was."""

    def open(self, name: str) -> None:
        """Prepare the state of a stop; what was there before comes back at the end. FinlabError: there is no
        such stop."""
        stop, session = BY_NAME[chosen(name, "lesson", BY_NAME)], self._session
        if self.stop is None:
            self._left = {key: getattr(session, key) for key in KEPT}
        self._enter(History(stop.state))  # what can be undone is what is done here
        self.stop, self.solved = stop, False
        session.saved, session.chosen, session.mode = stop.state.layout, (), stop.mode
        session.desk = Desk()
        session.show_drawer(stop.drawer)
        session.display = replace(session.display, drawn="none")

    def _enter(self, history: History) -> None:
        before, self._session.history = self._session.state, history
        self._session.settle(before)

    def go(self, steps: int) -> None:
        """The stop so many after this one; after the last one the work comes back."""
        if self.stop is not None:
            course = TOUR if self.stop in TOUR else LESSONS
            place = max(course.index(self.stop) + steps, 0)
            if place == len(course):
                self.end()
            else:
                self.open(course[place].name)

    def tour(self) -> None:
        """The tour's first stop, or the one after this."""
        if self.stop in TOUR:
            self.go(1)
        else:
            self.open(TOUR[0].name)

    def end(self) -> None:
        """All is as it was left, and what could be undone then can be undone now."""
        if self.stop is not None:
            self.stop = None
            self._enter(self._left["history"])
            self._session.history.end_merge()
            for key, value in self._left.items():
                setattr(self._session, key, value)

    def take(self, answer: Allocation) -> None:
        """See what the fins do now; an exercise that is done stays so until another stop is opened."""
        session = self._session
        if self.stop is not None and answer.layout == session.state.able:
            self.solved = self.solved or self.stop.done(session, answer)
