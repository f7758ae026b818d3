"""Base of all allocation methods, and of their settings: made once for a layout of healthy
actuators, a method solves for wrenches.

`finlab.Allocator` is its only caller. Who writes a method of his own begins with
docs/howto/allocation-method.md. Its settings are a frozen dataclass in the file of its class, whose
fields carry range, unit and meaning: all that asks for settings (a call, a bundle, the app) makes
such an object, which checks itself.
"""

import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from dataclasses import Field, dataclass, field, fields
from functools import cached_property
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.policy import Policy, PolicyName
from finlab.allocation.question import MethodQuestion
from finlab.allocation.solution import Candidates, PreparedAnswers, Solution, Solved
from finlab.arrays import Array
from finlab.errors import AllocationError, LayoutError
from finlab.layout.layout import Layout
from finlab.physics.plant import plant_of

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

    from finlab.allocation.power_budget import PowerBudget
    from finlab.allocation.rates import Rates

Takes = Literal["any actuator", "fins", "horizontal fins", "thrusters"]
"""What a method's robot may have."""
Reads = Literal["policy", "losses", "multipliers", "reference"]
"""What `Method.solve` may read of a question, beside targets, the command before, flow and seed.

`policy`: more than the least plain error may be asked for. `losses`: `lost` actuators and `free`
axes; a method that does not read them is made for a robot without them. `multipliers`: those of an
earlier answer, to begin there. `reference`: wrenches of the next ticks.
"""


class Networks(Protocol):
    """Trained networks, as far as allocating has to know them; methods that have some know the
    rest."""

    @property
    def name(self) -> str:
        """Name of the checkpoint that they come from."""
        ...

    @property
    def sha256(self) -> str:
        """SHA-256 of the file of their weights; empty for what was not read from a file."""
        ...


Checkpoint = str | os.PathLike[str] | Networks | None
"""A checkpoint folder, the name of a shipped checkpoint, or the contents of one."""


USUAL_PERIOD_S = 0.1
"""Time between ticks of methods for which it is no setting [s]."""
MAX_CANDIDATES = 4096
"""Most candidates that may be drawn; more would keep a robot from answering."""


class Range(NamedTuple):
    """What a setting may be."""

    low: float
    """Least value; a whole number where only whole numbers are meant."""
    high: float
    """Largest value."""
    meaning: str
    """What it is, in words."""
    unit: str = ""
    """Its unit."""
    above: bool = False
    """Whether the least value itself is too little."""

    def __str__(self) -> str:
        kind = "a whole number" if isinstance(self.low, int) else "a number"
        low = f"above {self.low:g} up to" if self.above else f"from {self.low:g} to"
        return f"{kind} {low} {self.high:g} {self.unit}".rstrip()


def number(
    default: float | None,
    low: float,
    high: float,
    meaning: str,
    unit: str = "",
    *,
    above: bool = False,
) -> Any:
    """Makes a field that is a number within a range.

    Args:
        default: its usual value; where it is None, None is taken besides.
        low: least value; only whole numbers are taken where it is one.
        high: largest value.
        meaning: what it is, in words that follow its name.
        unit: of the value.
        above: whether the least value itself is too little.

    Returns:
        The field of a dataclass.
    """
    return field(default=default, metadata={"range": Range(low, high, meaning, unit, above)})


def choice(default: str, choices: tuple[str, ...], meaning: str) -> Any:
    """Makes a field that is one of some words.

    Args:
        default: its usual value.
        choices: all of them.
        meaning: what it is, in words that follow its name.

    Returns:
        The field of a dataclass.
    """
    return field(default=default, metadata={"choices": choices, "meaning": meaning})


def switch(default: bool, meaning: str) -> Any:
    """Makes a field that is true or false.

    Args:
        default: its usual value.
        meaning: what it is, in words that follow its name.

    Returns:
        The field of a dataclass.
    """
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Settings:
    """Settings of a method that has none; base of all others.

    Raises:
        AllocationError: a value is of the wrong kind, or out of its range.
    """

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, _checked(each, getattr(self, each.name)))


def _checked(setting: "Field[Any]", value: Any) -> Any:
    """Returns the value of a field, of the kind that is meant."""
    limits = setting.metadata.get("range")
    if limits is not None:
        return _within(setting, limits, value)
    choices = setting.metadata.get("choices")
    if choices is None:
        is_right = isinstance(value, bool)
        expected = "true or false"
    else:
        is_right = value in choices
        expected = f"one of {', '.join(choices)}"
    if is_right:
        return value
    raise AllocationError(f"{setting.name}: expected {expected}, got {value!r:.60}")


def _within(setting: "Field[Any]", limits: Range, value: Any) -> float | None:
    """Returns the number of a field, whole where that is meant."""
    if value is None and setting.default is None:
        return None
    is_whole = isinstance(limits.low, int)
    kind: Any = Integral if is_whole else Real
    is_number = isinstance(value, kind) and not isinstance(value, bool)
    if is_number and limits.low <= value <= limits.high:
        is_too_little = limits.above and value == limits.low
        if not is_too_little:
            return int(value) if is_whole else float(value)
    raise AllocationError(
        f"{setting.name}: expected {limits}, got {value!r:.60} ({limits.meaning})"
    )


class Method(ABC):
    """Turns target wrenches into commands. `finlab.Allocator` asks, and makes results of
    answers."""

    name: ClassVar[str]
    """What the method is called."""
    settings_class: ClassVar[type[Settings]] = Settings
    """What can be set."""
    most_targets: ClassVar[int] = 1024
    """How many targets of a batch are solved at once; keeps memory flat for any number of them."""
    policy_under_way: ClassVar[PolicyName] = "closest"
    """What a control loop asks for by default where a wrench is out of reach."""
    takes: ClassVar[Takes] = "any actuator"
    """What the robot may have."""
    reads: ClassVar[frozenset[Reads]] = frozenset({"policy"})
    """What `solve` reads of a question that not every method does: of policies, losses, multipliers
    and a reference. What is not named here, it is not given."""
    keeps_limits: ClassVar[bool] = False
    """Whether its commands already are what a robot takes: within the rates in a tick, at rest
    inside a dead band outside of ticks. Those of any other method are brought there."""
    keeps_arcs: ClassVar[bool] = False
    """Whether it leaves out the zones between the arcs of an actuator with several."""
    needs_networks: ClassVar[bool] = False
    """Whether it is made with trained networks, of a checkpoint."""
    networks: Networks | None
    """Trained networks; None for methods without."""

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, networks: Networks | None = None
    ) -> None:
        """Prepares the method for a robot.

        Args:
            layout: of healthy actuators, with the axes that count.
            settings: of its `settings_class`.
            scale: wrench scale (6,) [N, N m] of the whole robot, by which errors are normalized.
            networks: trained networks; None for a method without.

        Raises:
            AllocationError: the method cannot work with these settings.
            CheckpointError: the networks are of another kind.
            DataError: a fin's force table cannot be read.
            LayoutError: the robot has an actuator that the method does not take.
        """
        self.check_robot(layout)
        self.layout = layout
        self.settings = settings
        self.scale = scale
        self.networks = networks
        self.plant = plant_of(layout).counting(layout.commanded)
        self.prepare()

    def prepare(self) -> None:  # noqa: B027 - most have nothing to prepare
        """Make ready what does not depend on the targets; errors as those of the method itself."""

    @classmethod
    def check_robot(cls, layout: Layout) -> None:
        """Raise a `LayoutError` at an actuator that the method does not take."""
        if cls.takes == "thrusters":
            layout.require_kind(f"method {cls.name}", "thruster")
        elif cls.takes != "any actuator":
            layout.require_kind(f"method {cls.name}", horizontal=cls.takes == "horizontal fins")

    @classmethod
    def fits(cls, layout: Layout) -> bool:
        """Returns whether the method takes all actuators of a robot."""
        try:
            cls.check_robot(layout)
        except LayoutError:
            return False
        return True

    @classmethod
    def option_names(cls) -> list[str]:
        """Returns the names of what can be set."""
        return [field.name for field in fields(cls.settings_class)]

    @abstractmethod
    def solve(self, question: MethodQuestion) -> Solved:
        """Solves for the targets of a question.

        Args:
            question: whose policy `check_policy` accepts; with what the method `reads`.

        Returns:
            Commands (N, n, 3) within the limits, and what else the method has to tell.
        """

    def prepared_answers(
        self,
        policy: Policy,
        lost: NDArray[np.bool_] | None,
        free: NDArray[np.bool_] | None,
        budget: "PowerBudget | None" = None,
    ) -> PreparedAnswers | None:
        """Prepares questions about single wrenches, at rest in the water and without a reference.

        Args:
            policy: what to give out of reach.
            lost: which actuators (n,) do not work; None where all do.
            free: which axes (6,) may take any wrench; None for none.
            budget: what actuators may take together; None for no limit.

        Returns:
            What answers them as `solve` does, but more quickly; None where the method has nothing
            of the kind.
        """
        return None

    def refinement(self, target: Array, *, flow: Array | None, seed: int) -> tuple[Candidates, ...]:
        """Returns what a network proposes for one target, step by step.

        Args:
            target: desired wrench (6,) [N, N m]; 0 along axes that do not count.
            flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.
            seed: as of the answer.

        Returns:
            The proposals, then the same rows after each step of their refinement; nothing for
            methods without proposals, or that do not tell.
        """
        return ()

    def in_time(self, target: Array, reference: Array) -> Array:
        """Returns which wrench is answered.

        Args:
            target: desired wrench (6,) [N, N m].
            reference: those of the next K ticks (K, 6).

        Returns:
            The target; or, where the time between ticks is a setting, the wrench (6,) of the moment
            at which the slowest actuator will have followed, interpolated between ticks; after the
            last of them, the last.
        """
        if self._delay_ticks is None:
            return target
        whole_ticks = int(self._delay_ticks)
        count = len(reference)
        before = target
        after = target
        if whole_ticks and count:
            before = reference[min(whole_ticks, count) - 1]
        if count:
            after = reference[min(whole_ticks + 1, count) - 1]
        return np.asarray(before + (self._delay_ticks - whole_ticks) * (after - before))

    @cached_property
    def _delay_ticks(self) -> float | None:
        """By how many ticks commands are late, half of one since a command is held for a period;
        None where the time between ticks is no setting."""
        period_s = vars(self.settings).get("period_s")
        return None if period_s is None else self.layout.delay_s / period_s + 0.5

    def check_policy(self, policy: Policy) -> None:
        """Raise an `AllocationError` at a policy that the method does not know."""
        if not ("policy" in self.reads or policy.is_plain):
            raise AllocationError(
                f"policy: method {self.name!r} minimizes the plain error and knows nothing else; "
                "use method 'dual', or policy 'closest' without axis weights"
            )

    def check_budget(self, budget: "PowerBudget", policy: Policy) -> None:
        """Raise an `AllocationError` at a power budget that the method cannot keep by a policy."""
        raise AllocationError(
            f"power: method {self.name!r} keeps no budget; use method 'dual', "
            "or power=inf where the layout has one"
        )

    def at(self, flow: Array | None) -> "Self":
        """Returns the method for a robot that moves through the water.

        Args:
            flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.

        Returns:
            Another one, without what was cached; itself where the robot feels nothing.
        """
        plant = self.plant.at(flow)
        if plant is self.plant:
            return self
        other = copy(self)
        other.plant = plant
        for name in list(vars(other)):
            if isinstance(getattr(type(self), name, None), cached_property):
                del other.__dict__[name]
        return other

    @property
    def period_s(self) -> float:
        """Time between ticks [s]."""
        return float(vars(self.settings).get("period_s", USUAL_PERIOD_S))

    @cached_property
    def rates(self) -> "Rates":
        """How far commands may change in a tick."""
        from finlab.allocation.rates import Rates

        return Rates(self.plant, self.layout.rates * self.period_s)

    @property
    def undriven(self) -> tuple[str, ...]:
        """Names of the axes of a wrench that no actuator gives, as far as the method knows."""
        return ()

    @property
    def unknown_fins(self) -> tuple[str, ...]:
        """Names of the fins whose model the networks have not learned; answers for them are
        wrong."""
        return ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences that the user should read before trusting any answer of the method for its
        robot."""
        return ()

    # The rest is about networks. Methods with networks override it, by inheriting from
    # `finlab.research.networks.learned_method.LearnedMethod`.

    @classmethod
    def read_networks(cls, checkpoint: Checkpoint) -> Networks | None:
        """Returns the networks that the method is made with.

        Methods that need some inherit from `finlab.research.networks.learned_method.LearnedMethod`,
        which reads them; any other is made with what it is given.
        """
        return None if isinstance(checkpoint, str | os.PathLike) else checkpoint

    @classmethod
    def networks_in(
        cls, files: Mapping[str, bytes], source: str, name: str | None
    ) -> Networks | None:
        """Reads the networks that came with a bundle.

        Args:
            files: of the networks, by name; none where they come with finlab.
            source: what errors call the bundle.
            name: of the checkpoint; None for the shipped one.

        Returns:
            The networks; None for methods without.
        """
        return None

    @classmethod
    def networks_for_bundle(cls, networks: Networks | None) -> tuple[str | None, dict[str, bytes]]:
        """Returns the SHA-256 of the networks' weights, and by name the files of those that a
        bundle has to bring, since they do not come with finlab; None and no files for methods
        without."""
        return None, {}


class LeastErrorMethod(Method):
    """A method that keeps the plain error least, whatever else is asked for."""

    reads: ClassVar[frozenset[Reads]] = frozenset()
    takes: ClassVar[Takes] = "fins"

    @abstractmethod
    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        """Solve for targets (N, 6); see `Method.solve`."""

    def solve(self, question: MethodQuestion) -> Solution:
        """Solves for targets in a flow; see `Method.solve`. The policy is the plain one."""
        if len(question.targets) == 0:
            return Solution(np.empty((0, self.layout.n, 3)))
        in_flow = self.at(question.flow)
        return in_flow._solve(question.targets, seed=question.seed, previous=question.previous)
