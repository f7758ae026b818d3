"""The solver: from a state to an answer with all that a page shows of it, by allocators that it
keeps."""

from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import MethodChoice, choose_method
from finlab.allocation.policy import POLICY_NAMES, Policy
from finlab.allocation.power_budget import budget_of
from finlab.allocation.report import is_proved_least
from finlab.allocation.solution import Candidates
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.research.networks.checkpoint import network_features, resolve_checkpoint
from finlab.research.paper.network import NetworkConfig
from webapp.markup.words import ANSWER_SOURCE, fins_words
from webapp.session.state import DRAWING, State, one_of
from webapp.tasks.modes import Mode, find_modes, force_sizes, mode_signature, same_signature
from webapp.theme import MODE_COLORS

MAX_SHOWN = len(MODE_COLORS)
"""Modes that are shown, each in its own colour; a robot with many fins has dozens, the last ones
dear."""


class NamedMode(NamedTuple):
    """One way to deliver the wrench, as people call it."""

    mode: Mode
    name: str
    """What makes it different from the others that are shown."""
    badge: str
    """Whose it is: `network`, `optimum` where it is proved to be least, or another method's
    name."""


class NullSpaceDirections(NamedTuple):
    """Directions of the null space of an answer, as the page lists them."""

    names: tuple[str, ...]
    """What each direction is called: the numbers of the actuators that push otherwise along it."""
    about: tuple[str, ...]
    """The same with their shares."""
    ranges: tuple[tuple[float, float], ...]
    """How far one may go along each, the others as they are [N]."""
    more: int
    """Directions that are not listed."""
    budget_w: float | None = None
    has_budget: bool = False
    """Whether the ranges end where a power budget does, too."""


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of an answer, as the page lists them."""

    visible: tuple[NamedMode, ...]
    """The first `MAX_SHOWN` of them, the answer first, no two of the same name."""
    count: int
    refinement: tuple[Candidates, ...] = ()
    """What a network proposed, then the same K after each step of their refinement where that is
    told."""
    null_space: "NullSpaceDirections | None" = None
    """The null space that these ways lie in, where that is looked at."""
    ends: tuple[int, ...] = ()
    """For each proposal the shown mode at which it ends, -1 where that is none of them."""
    answer: Allocation | None = None
    """The answer to which the proposals were made; None where there are none."""

    @cached_property
    def steps(self) -> int:
        """Steps of the refinement."""
        return max(len(self.refinement) - 1, 0)

    @cached_property
    def is_in_vain(self) -> bool:
        """Whether proposals were refined, and none of them gives the wrench."""
        if not self.steps:
            return False
        return not (self.refinement[-1].err_norm <= ALTERNATIVE_ERROR).any()

    def proposal_of(self, mode: int) -> int | None:
        """The first proposal that ends at a mode: the likeliest, as those come first. Where none
        ends at any mode, the one that ends nearest to the wrench, whatever the mode."""
        if not self.steps:
            return None
        if mode in self.ends:
            return self.ends.index(mode)
        if all(end < 0 for end in self.ends):
            return int(np.argmin(self.refinement[-1].err_norm))
        return None


NO_MODES = Modes((), 0)
"""The modes of an answer that has none."""


def modes_of(
    answer: Allocation, candidates: Candidates, badge: str, ways: tuple[Candidates, ...]
) -> Modes:
    """The modes of an answer, of itself as a candidate and others; `badge` says whose it is, `ways`
    are what a network proposed for it, and its refinement."""
    layout = answer.layout
    modes = find_modes(
        candidates, force_sizes(layout, candidates.command), layout.lower, layout.upper
    )
    visible = named_modes(modes, badge)
    last = ways[-1].command
    signatures = mode_signature(last, force_sizes(layout, last))
    ends = np.full(len(last), -1)
    for k in reversed(range(len(visible))):
        ends[same_signature(visible[k].mode.signature, signatures)] = k
    return Modes(visible, len(modes), ways, ends=tuple(ends.tolist()), answer=answer)


def named_modes(modes: Sequence[Mode], badge: str) -> tuple[NamedMode, ...]:
    """The first modes with their names, no two alike; all but the first one are the network's."""
    named: list[NamedMode] = []
    count_of: Counter[str] = Counter()
    for mode in modes[:MAX_SHOWN]:
        words = _resting_words(mode)
        count_of[words] += 1
        number = count_of[words]
        name = f"{words} ({number})" if number > 1 else words
        named.append(NamedMode(mode, name, "network" if named else badge))
    return tuple(named)


def _resting_words(mode: Mode) -> str:
    """Which fins rest, and which hardly push."""
    still: list[int] = []
    weak: list[int] = []
    for fin in mode.resting:
        (still if fin in mode.still else weak).append(fin)
    phrases = []
    if still:
        phrases.append(f"{fins_words(still)} {'rest' if len(still) > 1 else 'rests'}")
    if weak:
        phrases.append(f"{fins_words(weak)} hardly {'push' if len(weak) > 1 else 'pushes'}")
    if phrases:
        return ", ".join(phrases)
    has_lost = bool(np.isnan(mode.command).any())
    return "all that work push" if has_lost else "all fins push"


Load = Callable[..., MethodChoice]
"""Loads a method by its name, as `choose_method` does."""
MAX_ALLOCATORS = 24
"""Most allocators in the cache: to make one takes as long as a hundred answers."""
ALTERNATIVE_ERROR = 1e-4
"""Normalized error up to which another answer is an alternative."""
SHIPPED = NetworkConfig.shipped
"""Name of the shipped network of method `paper`."""
POLICIES: dict[str, Policy] = {kind: Policy(kind) for kind in POLICY_NAMES}
"""Name of each policy that the page offers -> the policy."""
RUNS = "runs"
"""Folder with the checkpoints of trainings, in the one where the app was started."""


@dataclass(frozen=True, eq=False)
class Reply:
    """An answer and what belongs to it."""

    state: State
    """The question."""
    answer: Allocation
    in_reach: bool
    """Whether any command of the working fins gives what is asked."""


class KnownModes(NamedTuple):
    """Modes of a reply that are kept."""

    reply: Reply
    seen: bool
    modes: Modes


KEPT_REPLIES = 4
"""Answers that are kept, and modes: pages that follow another one ask for them again at once."""


class JetComparison(NamedTuple):
    """Answers to a state whose jets count, both judged with them."""

    state: State
    with_jets: Allocation
    """The answer."""
    without_jets: Allocation
    """That of the actuators' own laws alone."""


class Solver:
    """Answers states. Used from one thread at a time: the worker's, or the loop's while that has
    nothing to do."""

    def __init__(self, checkpoint: str | Path | None = None, load: Load = choose_method) -> None:
        """`checkpoint` is a name or folder for method `mdn` or `paper`, None for the shipped ones;
        `load` is replaced in tests."""
        self._checkpoint = checkpoint
        self._load = load
        self._choices: dict[tuple[str, str], MethodChoice] = {}
        self._made: dict[tuple[Layout, str, float | None, str], Allocator] = {}
        self._replies: deque[Reply] = deque(maxlen=KEPT_REPLIES)
        """The last answers, the newest first."""
        self._modes: deque[KnownModes] = deque(maxlen=KEPT_REPLIES)
        """Modes that were found last, the newest first."""
        own = checkpoint is not None and _is_papers(resolve_checkpoint(checkpoint))
        self.first_network = str(resolve_checkpoint(checkpoint)) if own and checkpoint else SHIPPED
        """The network that method `paper` begins with."""

    @cached_property
    def for_other_thread(self) -> "Solver":
        """Another solver with the same checkpoint, for another thread."""
        return Solver(self._checkpoint, self._load)

    def networks(self) -> dict[str, Path]:
        """The networks that method `paper` may answer with now, by name: the shipped one, those
        that were trained here, and the checkpoint, which may be of another method."""
        folders = [resolve_checkpoint(SHIPPED)]
        folders += sorted(path.parent for path in Path(RUNS).glob("*/config.json"))
        if self._checkpoint is not None:
            folders.append(resolve_checkpoint(self._checkpoint))
        names = [SHIPPED, *map(str, folders[1:])]
        networks = {}
        for name, folder in zip(names, folders, strict=True):
            if _is_papers(folder):
                networks[name] = folder
        return networks

    def allocator(self, state: State) -> Allocator:
        """The allocator for a state's robot, method and settings, one of the last few or made now;
        fails where it cannot be made."""
        layout = state.layout
        method = state.method
        temperature = state.temperature if method in DRAWING else None
        network = (state.network or self.first_network) if method == "paper" else ""
        key = layout, method, temperature, network
        allocator = self._made.pop(key, None)
        if allocator is None:
            choice = self._choice(method, network)
            settings = choice.settings
            if temperature is not None and "temperature" in choice.kind.option_names():
                settings = replace(settings, **{"temperature": temperature})
            allocator = Allocator.of_choice(layout, replace(choice, settings=settings))
        self._made[key] = allocator  # the newest is last
        while len(self._made) > MAX_ALLOCATORS:
            self._made.pop(next(iter(self._made)))
        return allocator

    def checkpoint_of(self, state: State) -> str | None:
        """The checkpoint that a state is answered with, as a name or folder; None for the shipped
        one, and for methods without networks."""
        is_papers = self.first_network != SHIPPED
        if state.method == "mdn":
            return None if is_papers or self._checkpoint is None else str(self._checkpoint)
        network = state.network or self.first_network
        if state.method != "paper" or network == SHIPPED:
            return None
        return str(self.networks()[one_of(network, "network", self.networks())])

    def _choice(self, method: str, network: str) -> MethodChoice:
        """A method with its networks, loaded once."""
        if (method, network) not in self._choices:
            checkpoint = (
                self._checkpoint if method == "mdn" and self.first_network == SHIPPED else None
            )
            if network and network != SHIPPED:
                checkpoint = self.networks()[one_of(network, "network", self.networks())]
            self._choices[method, network] = self._load(method, checkpoint=checkpoint)
        return self._choices[method, network]

    def reply(self, state: State) -> Reply:
        """The answer to a state with all that a page shows of it, computed to the end; the last
        ones are kept, for pages that follow another one. Fails as `solve`."""
        for known in self._replies:
            if known.state is state:
                return known
        answer = judged_by_plant(self.solve(state))
        _ = answer.forces, answer.power, answer.effort  # here, not where the page is written
        in_reach = answer.reachable
        if not in_reach and state.method != "dual":  # which misses nothing that can be reached
            in_reach = self.solve(replace(state, method="dual")).reachable
        reply = Reply(state, answer, in_reach)
        self._replies.appendleft(reply)
        return reply

    def jet_comparison(self, state: State) -> JetComparison:
        """The answer to a state of a robot whose jets count, and that of the laws alone. Fails as
        `solve`."""
        layout = replace(state.layout, interaction=None)
        without_jets = self.solve(replace(state, layout=layout))
        without_jets = replace(
            without_jets,
            layout=replace(without_jets.layout, interaction=state.layout.interaction),
            flow=None if state.flow is None else np.array(state.flow),
            wrench_expected=None,
            answered=None,
        )
        with_jets = self.solve(state)
        for answer in (with_jets, without_jets):
            _ = answer.err_norm, answer.power  # here, not where the page is written
        return JetComparison(state, with_jets, without_jets)

    def modes(self, reply: Reply, seen: bool = True) -> Modes:
        """The answer, and beside it all distinct ways to do the same that the network proposes:
        tens of milliseconds. Method `paper` has a network of its own. Where they are not `seen` it
        is only proved."""
        for known in self._modes:
            if known.reply is reply and known.seen == seen:
                return known.modes
        modes = self._modes_of(reply, seen)
        self._modes.appendleft(KnownModes(reply, seen, modes))
        return modes

    def _modes_of(self, reply: Reply, seen: bool) -> Modes:
        """As `modes`, which keeps the last ones."""
        answer = reply.answer
        state = reply.state
        _ = answer.bound  # to prove what is least takes longer than to find it
        if answer.unknown_fins or not answer.reachable:
            _ = answer.notes  # the page shows them
        if not seen:
            return NO_MODES
        if answer.samples is not None and answer.candidates is not None and state.method == "paper":
            return modes_of(answer, answer.candidates, "network", (answer.samples,))
        asks = np.nan_to_num(answer.target).any()
        if not (reply.in_reach and answer.effort is not None and asks):  # effort is of fins
            return NO_MODES
        if state.method == "mdn" and answer.candidates is not None:
            own = answer.candidates.rows([0])
            badge = "network"
        else:
            costs = np.array([answer.effort]), np.array([answer.power])
            error = np.array([answer.err_norm])
            own = Candidates(
                answer.command[None], answer.wrench[None], error, *costs, (ANSWER_SOURCE,)
            )
            badge = "optimum" if is_proved_least(answer) else state.method
        ways = self.allocator(replace(state, method="mdn")).refinement(answer)
        others = _within_budget(ways[-1].exact(ALTERNATIVE_ERROR), answer.layout)
        return modes_of(answer, own.followed_by(others), badge, ways)

    def solve(self, state: State) -> Allocation:
        """The answer to a state. FinlabError: the method cannot be loaded or cannot answer."""
        return self.allocator(state).allocate(
            state.target,
            damage=state.damage,
            policy=POLICIES[state.policy],
            flow=state.flow,
            seed=0,
        )


def _within_budget(candidates: Candidates, layout: Layout) -> Candidates:
    """Those candidates that keep the power budget of a layout."""
    budget = None
    if layout.has_budget:
        budget = budget_of(layout)
    if budget is None:
        return candidates
    is_kept = budget.are_kept(plant_of(layout).power(candidates.command))
    return candidates.rows(np.flatnonzero(is_kept).tolist())


def _is_papers(folder: Path) -> bool:
    """Whether a folder holds a network of method `paper`."""
    try:
        return network_features(folder) == NetworkConfig.features
    except FinlabError:  # a folder of something else is no choice
        return False


def judged_by_plant(answer: Allocation) -> Allocation:
    """An answer whose candidates and samples have the wrench by the fins' own laws, as it has
    itself. A method with a learned model ranks them by what that believes."""
    if answer.wrench_expected is None:
        return answer

    def corrected(drawn: Candidates | None) -> Candidates | None:
        if drawn is None:
            return None
        wrench = plant_of(answer.layout).wrench(drawn.command)
        error = np.linalg.norm(np.nan_to_num(wrench - answer.target) / answer.scale, axis=-1)
        return replace(drawn, wrench=wrench, err_norm=error)

    return answer.with_candidates(corrected(answer.candidates), corrected(answer.samples))
