"""The state that a browser works on: one immutable, checked value that undo can put back."""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

from finlab.actuators.fin.fin_model import MAX_AMPLITUDE, MAX_FREQUENCY
from finlab.allocation.methods import METHODS, method_class
from finlab.allocation.policy import POLICY_NAMES
from finlab.axes import AXES, UNITS
from finlab.errors import FinlabError
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from finlab.physics import plant_of
from finlab.research.mdn.method import MdnSettings
from finlab.research.paper.pipeline import PaperSettings
from webapp.session.granted import Granted, SourceFile

MAX_TARGET = 1e12
"""Largest target component that the page may ask for [N, N m]."""
Flow = tuple[float, float, float, float, float, float]
FIRST_POLICY = "closest"
"""The policy that a robot begins with."""
MAX_SPEED = 3.0
"""Greatest speed through the water that the page may ask for [m/s]."""
STRENGTH_RANGE = (0.05, 1.0)
"""Shares that may be left of a weak or torn actuator."""
COMPARED = ("dual", "analytic", "qp", "mdn", "sqp", "paper")
"""Methods for fins that answer quickly enough to be compared while one waits, the quick ones
first."""
LEAST = {"watts": "dual", "effort": "mdn"}
"""What answers may keep least, and the method that does it best."""
CHOICES: dict[str, tuple[str, ...]] = {"method": tuple(METHODS), "policy": POLICY_NAMES}
DRAWING: dict[str, MdnSettings | PaperSettings] = {"mdn": MdnSettings(), "paper": PaperSettings()}
"""Methods that draw candidates from a mixture, with their own settings."""


@dataclass(frozen=True)
class State:
    """A layout, its damage and the question asked of it."""

    layout: Layout
    damage: Damage = NO_DAMAGE
    target: tuple[float, float, float, float, float, float] = (0.0,) * 6
    """Desired wrench [N, N m], body frame."""
    temperature: float | None = None
    """How far draws may stray from the mixture's means; None for the method's own."""
    method: str = "dual"
    network: str = ""
    """Which of the networks that are there method `paper` answers with; empty for the one it began
    with."""
    policy: str = FIRST_POLICY
    speed: float = 0.0
    """Speed ahead through the water [m/s]."""
    granted: tuple[Granted, ...] = ()
    """What was taken for granted of the robot's file."""
    source: SourceFile | None = None
    """The file of another program that the robot was read from; None for others."""

    @cached_property
    def flow(self) -> Flow | None:
        """Velocity (6,) relative to the water where an actuator feels it and it is not at rest;
        else None."""
        felt = self.speed != 0.0 and plant_of(self.layout).feels_flow
        return (self.speed, 0.0, 0.0, 0.0, 0.0, 0.0) if felt else None

    @cached_property
    def able(self) -> Layout:
        """The layout with the limits that are left to damaged fins."""
        return self.layout if self.damage == NO_DAMAGE else self.damage.applied_to(self.layout)

    @cached_property
    def lost(self) -> tuple[str, ...]:
        """Names of the actuators that are lost."""
        return tuple(self.damage.lost)

    def is_same_but_target(self, other: "State") -> bool:
        """Whether another state asks the same robot in the same way, for this wrench or another."""
        is_same_robot = self.layout is other.layout and self.damage is other.damage
        is_same_method = self.method == other.method and self.policy == other.policy
        is_same_network = self.network == other.network and self.temperature == other.temperature
        is_as_fast = self.speed == other.speed
        return is_same_robot and is_same_method and is_same_network and is_as_fast

    def with_target(self, axis: int, value: Any) -> "State":
        """One component of the target changed."""
        target = list(self.target)
        name = f"{AXES[axis]} [{UNITS[axis]}]"
        target[axis] = number(value, name, -MAX_TARGET, MAX_TARGET) + 0.0  # -0.0 + 0.0 is 0.0
        fx, fy, fz, tx, ty, tz = target
        return replace(self, target=(fx, fy, fz, tx, ty, tz))

    def with_loss_toggled(self, name: str) -> "State":
        """One actuator lost or repaired."""
        self.layout.index(name)
        lost = set(self.lost) ^ {name}
        return self.with_lost(name for name in self.layout.names if name in lost)

    def with_lost(self, names: Iterable[str]) -> "State":
        """Other actuators are lost."""
        return replace(self, damage=replace(self.damage, lost=tuple(names)))

    def with_fault(self, name: str, kind: str, value: Any) -> "State":
        """An actuator with a fault of its type, see `Kind.faults`; None, and a share of 1, mend
        that."""
        actuator = self.layout.actuator(name)
        one_of(kind, f"fault of {name}, a {actuator.type}", actuator.KIND.faults)
        checked = None if value is None else _checked_fault(actuator, kind, value)
        return self._with_damage(self.damage.with_fault(name, kind, checked))

    def _with_damage(self, damage: Damage) -> "State":
        damage.applied_to(self.layout)  # says what cannot be
        return replace(self, damage=damage)

    def with_layout(
        self, layout: Layout, renamed: Mapping[str, str] = MappingProxyType({})
    ) -> "State":
        """Another layout; damage of actuators that still exist stays, also of those that are
        `renamed` (old and new names). FinlabError: one of them cannot have its damage any more."""
        names = {old: renamed.get(old, old) for old in self.layout.names}
        now = {old: new for old, new in names.items() if new in layout.names}
        lost = {now.get(name) for name in self.lost}
        damage = replace(
            self.damage.renamed(now), lost=[name for name in layout.names if name in lost]
        )
        method = method_for(layout, self.method)
        granted = tuple([row.renamed(now) for row in self.granted])
        state = replace(self, layout=layout, method=method, granted=granted)
        return state._with_damage(damage)

    def with_setting(self, key: str, value: Any) -> "State":
        """The temperature, the method, the policy or the network changed."""
        one_of(key, "setting", ("temperature", "network", *CHOICES))
        if key == "network":  # the solver knows which there are
            return replace(self, network=str(value))
        if key in CHOICES:
            return replace(self, **{key: one_of(value, key, CHOICES[key])})
        settings = DRAWING.get(self.method, DRAWING["mdn"])  # they say what is wrong with a number
        return replace(self, temperature=replace(settings, temperature=value).temperature)


def _checked_fault(actuator: Actuator, kind: str, value: Any) -> Any:
    name = actuator.name
    if kind in ("weak", "torn"):
        share = number(value, f"share left of {name}", *STRENGTH_RANGE)
        return None if share == 1.0 else share
    if kind == "stuck" and not actuator.KIND.sticks_at_angle:
        return number(value, f"force of {name}, stuck [N]", -math.inf, math.inf)
    if kind == "stuck":
        return _angle(value, f"angle of {name}, stuck [°]", -math.pi, math.pi)
    if not isinstance(actuator, Fin):  # the robot's own checks say what else is wrong
        return tuple(
            number(component, f"command that {name} keeps", -math.inf, math.inf)
            for component in value
        )
    amplitude, frequency, angle = value
    return (
        _angle(amplitude, f"amplitude of {name} [°]", 0.0, MAX_AMPLITUDE),
        number(frequency, f"frequency of {name} [Hz]", 0.0, MAX_FREQUENCY),
        _angle(angle, f"direction of {name} [°]", -math.pi, math.pi),
    )


def _angle(value: Any, name: str, low: float, high: float) -> float:
    """An angle [rad] within bounds [rad]; people read of it in degrees."""
    if not isinstance(value, bool) and isinstance(value, (int, float)):
        low_deg = math.degrees(low - 1e-6)  # a page's own rounding
        high_deg = math.degrees(high + 1e-6)
        number(math.degrees(value), name, low_deg, high_deg)
    return number(value, name, -math.inf, math.inf)


def is_same_robot(one: State, other: State) -> bool:
    """Whether two states have the same robot with the same damage; which actuators move together
    while it is edited does not count."""
    is_same_layout = one.layout is other.layout or one.layout.unpaired == other.layout.unpaired
    return is_same_layout and one.damage == other.damage


def compared(layout: Layout) -> tuple[str, ...]:
    """Methods that are compared on a robot, the quick ones first."""
    return COMPARED if layout.is_of_fins else ("dual", "analytic", "px4", "ardusub", "ipopt")


def method_for(layout: Layout, method: str) -> str:
    """A method where it takes all actuators of a robot, else the one that takes any."""
    return method if method_class(method).fits(layout) else "dual"


def least_of(method: str) -> str:
    """What a method keeps least: a key of `LEAST`. The two with networks know the paper's effort
    alone."""
    return "effort" if method in DRAWING else "watts"


def one_of(value: Any, name: str, choices: Iterable[str]) -> Any:
    """One of some words. FinlabError: it is none of them, and which there are."""
    words = tuple(choices)
    if value not in words:
        raise FinlabError(f"{name}: expected one of {', '.join(words)}, got {value!r:.60}")
    return value


def number(value: Any, name: str, low: float, high: float) -> float:
    """A finite number within limits.

    Args:
        value: what a page sent.
        name: what it is called in a sentence, with its unit.
        low: least number that is taken.
        high: largest one.

    Raises:
        FinlabError: `value` is not such a number.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise FinlabError(f"{name}: expected a number, got {value!r:.60}")
    if not low <= value <= high:  # a NaN compares false as well
        ends = f"{_plain(low)} to {_plain(high)}"
        raise FinlabError(f"{name}: expected a number from {ends}, got {_plain(value)}")
    return float(value)


def _plain(value: float) -> str:
    """A number without a power of ten where its digits can be written out."""
    return f"{value:,.0f}" if 1e6 <= abs(value) < 1e12 else f"{value:g}"


def numbers(
    values: Sequence[Any], subject: str, low: float, high: float, words: Sequence[str] = "xyz"
) -> tuple[float, ...]:
    """Some finite numbers within limits.

    Args:
        values: what a page sent.
        subject: what they are numbers of, with their unit: `of front_left [m]`.
        low: least number that is taken.
        high: largest one.
        words: what each is called in a sentence.

    Raises:
        FinlabError: one is not such a number.
    """
    return tuple(
        [
            number(value, f"{word} {subject}", low, high)
            for value, word in zip(values, words, strict=True)
        ]
    )


MERGE_WINDOW_S = 1.0
"""Changes of the same kind that follow each other faster than this are one step of undo."""
MAX_STEPS = 1000
"""Steps that can be undone; older ones are forgotten, so that a long session stays small."""


class Step(NamedTuple):
    """One step of undo, and what was there on the other side of it."""

    name: str
    state: State
    shifts: tuple[float, ...] = ()
    """How far along the answer's null space the forces were [N]."""


Steps = list[Step]


class History:
    """The present state, with those before it and those that were undone."""

    def __init__(self, state: State, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with one state; `clock` gives seconds and is replaced in tests."""
        self.state = state
        self._clock = clock
        self.past: Steps = []
        """Steps that can be undone, oldest first, with what was there before them."""
        self.future: Steps = []
        """Steps that can be redone, last one first, with what was there after them."""
        self.merge_key: str | None = None
        """Key of the step that is still being merged into, if any."""
        self._merge_time = 0.0
        self.undo_name: str | None = None
        """Name of the step that undo takes back, if any."""
        self.redo_name: str | None = None
        """Name of the step that redo brings back, if any."""

    def commit(
        self,
        name: str,
        state: State,
        merge_key: str | None,
        timed: bool,
        shifts: tuple[float, ...] = (),
    ) -> None:
        """Make another state the present one by a step.

        Args:
            name: what undo calls the step.
            state: the other state.
            merge_key: changes with the same one in quick succession share a step.
            timed: without it they share a step however slow they are, until `end_merge`.
            shifts: where in the null space the forces were before [N].
        """
        now = self._clock()
        is_same_change = merge_key is not None and merge_key == self.merge_key
        is_quick = not timed or now - self._merge_time < MERGE_WINDOW_S
        if not (is_same_change and self.past and is_quick):
            self.past.append(Step(name, self.state, shifts))
            self.past = self.past[-MAX_STEPS:]
            self.undo_name = name
            self.future = []
            self.redo_name = None
        self.merge_key = merge_key
        self._merge_time = now
        self.state = state

    def replace(self, state: State) -> None:
        """Let the present state be another one, without a step."""
        self.state = state
        self.merge_key = None
        self.name_steps()

    def add_aside(self, name: str, shifts: tuple[float, ...], steps: Steps, close: Step) -> None:
        """Take in the steps of other work, which ended where this one goes on.

        Args:
            name: of the step from the present state to the first one of the others.
            shifts: where in the null space the present forces are [N].
            steps: the other steps.
            close: the step back to the present state.
        """
        aside = [Step(name, self.state, shifts), *steps, close]
        self.past = [*self.past, *aside][-MAX_STEPS:]
        self.future = []
        self.merge_key = None
        self.name_steps()

    def name_steps(self) -> None:
        """Say what undo and redo do, after `past` or `future` have changed."""
        self.undo_name = self.past[-1].name if self.past else None
        self.redo_name = self.future[-1].name if self.future else None

    def end_merge(self) -> None:
        """The next change starts a step of its own."""
        self.merge_key = None
