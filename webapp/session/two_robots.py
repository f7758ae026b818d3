"""Two robots beside each other, asked for the same wrench: which they are, and what becomes of
them."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.damage import Damage
from webapp.session.base import BaseSession
from webapp.session.files import shipped
from webapp.session.looking import TWO_ROBOTS
from webapp.session.state import State, is_same_robot, method_for, one_of

PLACES = ("left", "right")
"""Where the two stand, as seen from the camera."""
THIS = "This robot"
"""Title of the robot that the page works on, which changes with it."""
SAVED = "As opened or saved last"
"""Title of that robot as it was opened or saved."""
PROPOSAL = "Proposal of Improve"
"""Title of the layout that a search has found."""
MOST_EARLIER = 20
"""Steps of undo that are offered, the newest ones."""
MOST_GUESTS = 8
"""Robots of files and links that are kept; older ones are forgotten."""


@dataclass(frozen=True)
class Source:
    """A robot that may stand on either side."""

    title: str
    """Where it comes from, as the list has it."""
    state: State | None
    """The robot with its damage; None for the one that the page works on."""

    def state_for(self, question: State) -> State:
        """The robot with the question of another state: wrench, speed, policy, and the method where
        it takes all its actuators."""
        if self.state is None:
            return question
        return replace(
            self.state,
            target=question.target,
            speed=question.speed,
            policy=question.policy,
            method=method_for(self.state.layout, question.method),
            temperature=question.temperature,
            network=question.network,
        )


@dataclass(frozen=True)
class Standing:
    """A robot of a pair, with what is asked of it."""

    title: str
    """Where it comes from."""
    state: State
    is_this: bool
    """Whether it is the robot that the page works on."""


@dataclass(frozen=True)
class Pair:
    """Two robots that stand beside each other."""

    left: Standing
    right: Standing

    @property
    def both(self) -> tuple[Standing, Standing]:
        """In the order of `PLACES`."""
        return self.left, self.right

    @property
    def names(self) -> tuple[str, str]:
        """What each is called where both are spoken of: its robot's name, with where it comes from
        where both have the same."""
        left, right = self.both
        left_name = left.state.layout.name
        right_name = right.state.layout.name
        if left_name != right_name:
            return left_name, right_name
        return f"{left_name} ({left.title})", f"{right_name} ({right.title})"


THIS_ROBOT = Source(THIS, None)
"""The robot that the page works on."""


@dataclass(frozen=True)
class Acceptance:
    """One of a pair became the robot of the page."""

    state_before: State
    """The robot of the page before it."""
    sources_before: list[Source]
    """What stood on `PLACES` before it."""
    state_after: State
    """The robot of the page from then on."""
    sources_after: list[Source]
    """What has stood on `PLACES` since."""


class TwoRobots:
    """Which two robots of one session stand beside each other. Only `accept` is a step of undo."""

    def __init__(self, session: BaseSession) -> None:
        """Nothing has been chosen yet: this robot, and the one before its last change."""
        self._session = session
        self._chosen: list[Source] | None = None
        self.guests: tuple[Source, ...] = ()
        """Robots of files and links, which stand in the list."""
        self._pair: Pair | None = None
        self._acceptances: list[Acceptance] = []
        """The newest last; undo and redo of one bring back what stood there with it."""

    @property
    def is_open(self) -> bool:
        """Whether the pair is looked at."""
        desk = self._session.desk
        return desk.opened[desk.task] == TWO_ROBOTS

    @property
    def pair(self) -> Pair | None:
        """The two while they are looked at; the same object as long as they are the same."""
        desk = self._session.desk
        if desk.opened[desk.task] != TWO_ROBOTS:
            return None
        left, right = self._standing()
        old = self._pair
        if old is None or old.left != left or old.right != right:
            self._pair = Pair(left, right)
        return self._pair

    def sources(self, proposal: State | None = None) -> tuple[Source, ...]:
        """All robots that may be chosen, each with a title of its own.

        Args:
            proposal: the robot that a search has found; None where there is none.
        """
        session = self._session
        sources = [THIS_ROBOT]
        if proposal is not None:
            sources.append(Source(PROPOSAL, proposal))
        if session.saved != session.state.layout:
            sources.append(Source(SAVED, State(session.saved)))
        sources += self._earlier()
        sources += self.guests
        for name, layout in shipped().items():
            sources.append(Source(f"Shipped: {name}", State(layout)))
        # A step of undo that is shown stays in the list when newer ones come.
        titles = {source.title for source in sources}
        for source in self._both():
            if source.title not in titles:
                sources.append(source)
                titles.add(source.title)
        return tuple(sources)

    def choose(self, place: str, title: str, proposal: State | None = None) -> None:
        """Another robot on one of `PLACES`, by its title. FinlabError: there is none of that."""
        by_title = {source.title: source for source in self.sources(proposal)}
        self._put(place, by_title[one_of(title, "robot", by_title)])

    def show(self, place: str, source: Source) -> None:
        """Put a robot on one of `PLACES`, and look at both."""
        self._put(place, source)
        self._session.show_drawer(TWO_ROBOTS)

    def show_proposal(self, proposal: State) -> None:
        """Look at this robot, at the left, and what a search has found for it."""
        self._chosen = [THIS_ROBOT, THIS_ROBOT]
        self.show("right", Source(PROPOSAL, proposal))

    def welcome(self, place: str, title: str, layout: Layout, lost: tuple[str, ...]) -> None:
        """Take in a robot of a file or a link, put it on one of `PLACES`, and look at both.

        Args:
            place: where it stands.
            title: what it is called in the list; a number follows where that is taken.
            layout: the robot.
            lost: names of its lost actuators.
        """
        taken = {source.title for source in self.sources()}
        guest = Source(_own_title(title, taken), State(layout, Damage(lost)))
        self.guests = (*self.guests, guest)[-MOST_GUESTS:]
        self.show(place, guest)

    def show_pair(self, title: str, layout: Layout, lost: tuple[str, ...]) -> None:
        """Look at this robot, at the left, and another one; arguments as for `welcome`."""
        self._chosen = [THIS_ROBOT, THIS_ROBOT]
        self.welcome("right", title, layout, lost)

    def swap(self) -> None:
        """Each goes where the other one was."""
        left, right = self._both()
        self._chosen = [right, left]

    def accept(self, place: str) -> None:
        """One of the two becomes the robot of the page, a step of undo; what that was before stays
        beside it. FinlabError: it is that already."""
        index = PLACES.index(one_of(place, "place", PLACES))
        both = self._both()
        source = both[index]
        if source.state is None:
            raise FinlabError(f"the {place} one is this robot already; accept the other one")
        session = self._session
        state_before = session.state
        state = source.state_for(state_before)
        before = Source(f"Before: Accept {state.layout.name}", state_before)
        if not session.accept_state(f"Accept {state.layout.name}", state):
            raise FinlabError(f"the {place} one is the same as this robot; nothing changes")
        chosen = [before if each.state is None else each for each in both]
        chosen[index] = THIS_ROBOT
        self._chosen = chosen
        self._acceptances.append(Acceptance(state_before, both, session.state, chosen))
        self._acceptances = self._acceptances[-MOST_EARLIER:]

    def _standing(self) -> tuple[Standing, Standing]:
        """Both, with the question of this moment."""
        question = self._session.state
        left, right = [
            Standing(source.title, source.state_for(question), source.state is None)
            for source in self._both()
        ]
        return left, right

    def _both(self) -> list[Source]:
        """What stands on `PLACES`. Until something is chosen the right one is what the robot was
        before, or another one that is shipped."""
        if self._chosen is not None:
            self._chosen = self._as_accepted(self._chosen)
            return self._chosen
        earlier = self._earlier()
        if earlier:
            return [THIS_ROBOT, earlier[0]]
        name = next(
            name for name, known in shipped().items() if known != self._session.state.layout
        )
        return [THIS_ROBOT, Source(f"Shipped: {name}", State(shipped()[name]))]

    def _as_accepted(self, chosen: list[Source]) -> list[Source]:
        """What stands on `PLACES` after undo or redo of an `accept`, where nothing else was chosen
        since: the robot that was accepted is that of the page, or stands beside it again."""
        state = self._session.state
        for acceptance in reversed(self._acceptances):
            if chosen is acceptance.sources_after and state is acceptance.state_before:
                return acceptance.sources_before
            if chosen is acceptance.sources_before and state is acceptance.state_after:
                return acceptance.sources_after
        return chosen

    def _put(self, place: str, source: Source) -> None:
        index = PLACES.index(one_of(place, "place", PLACES))
        chosen = list(self._both())
        chosen[index] = source
        self._chosen = chosen

    def _earlier(self) -> list[Source]:
        """The robot before each of the newest steps of undo that have changed it."""
        session = self._session
        later = session.state
        sources: list[Source] = []
        titles: set[str] = set()
        for step in reversed(session.history.past):
            state = step.state
            if not is_same_robot(state, later):
                title = _own_title(f"Before: {step.name}", titles)
                titles.add(title)
                sources.append(Source(title, state))
            later = state
            if len(sources) == MOST_EARLIER:
                break
        return sources


def _own_title(title: str, taken: Iterable[str]) -> str:
    """A title, with a number where there is one like it."""
    own = title
    number = 2
    while own in taken:
        own = f"{title} ({number})"
        number += 1
    return own
