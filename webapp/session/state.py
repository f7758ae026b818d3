"""What a browser works on: one immutable, checked value that undo can put back."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from finlab.allocation.mdn_settings import MdnSettings
from finlab.allocation.methods import METHODS
from finlab.allocation.policy import AXES, KINDS
from finlab.errors import FinlabError
from finlab.layout import Fin, Layout
from finlab.layout.damage import Health
from finlab.paper.settings import PaperSettings
from webapp.session.links import Links, kept, linked

AXIS_WORDS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
AXIS_UNITS = ("N", "N", "N", "N m", "N m", "N m")

MAX_TARGET = 1000.0
"""Largest target component that the page may ask for [N, N m]."""
STRENGTH_RANGE = (0.05, 1.0)
"""Shares that may be left of a weak fin's largest amplitude and frequency."""
COMPARED = ("dual", "mdn", "paper", "analytic", "qp", "sqp")
"""Methods that answer quickly enough to be compared while one waits."""
LEAST = {"watts": "dual", "effort": "mdn"}
"""What answers may keep least, and the method that does it best."""
CHOICES: dict[str, tuple[str, ...]] = {"method": tuple(METHODS), "policy": KINDS}
DRAWING: dict[str, MdnSettings | PaperSettings] = {"mdn": MdnSettings(), "paper": PaperSettings()}
"""Methods that draw candidates from a mixture, with their own settings."""


@dataclass(frozen=True)
class State:
    """A layout, its failures and the question asked of it."""

    layout: Layout
    failed: tuple[str, ...] = ()
    weak: tuple[tuple[str, float], ...] = ()
    """Weak fins: name, and the share that is left of the largest amplitude and frequency."""
    stuck: tuple[tuple[str, float], ...] = ()
    """Fins that no longer turn: name, and the zero direction [rad] at which they stay."""
    target: tuple[float, float, float, float, float, float] = (0.0,) * 6
    """Desired wrench [N, N m], body frame."""
    temperature: float | None = None
    """How far draws may stray from the mixture's means; None for the method's own."""
    method: str = "dual"
    policy: str = "closest"
    links: Links = ()

    @property
    def healthy(self) -> tuple[str, ...]:
        """Names of the fins that work."""
        return tuple(name for name in self.layout.names if name not in self.failed)

    @property
    def health(self) -> Health | None:
        """What is known of damaged fins; None where all are whole."""
        return Health(self.weak, self.stuck) if self.weak or self.stuck else None

    @property
    def able(self) -> Layout:
        """The layout with the limits that are left to damaged fins."""
        return self.layout if self.health is None else self.health.applied_to(self.layout)

    def with_target(self, axis: int, value: Any) -> "State":
        """One component of the target changed."""
        checked = number(value, f"{AXES[axis]} [{AXIS_UNITS[axis]}]", -MAX_TARGET, MAX_TARGET)
        target = list(self.target)
        target[axis] = checked
        fx, fy, fz, tx, ty, tz = target
        return replace(self, target=(fx, fy, fz, tx, ty, tz))

    def with_failure_toggled(self, name: str) -> "State":
        """One fin failed or repaired; the last working fin cannot fail."""
        self.layout.index(name)
        lost = set(self.failed) ^ {name}
        if len(lost) == self.layout.n:
            raise FinlabError(
                f"{name} is the last one that works, so it cannot fail too; repair another one first"
            )
        return replace(self, failed=tuple(n for n in self.layout.names if n in lost))

    def with_strength(self, name: str, share: Any) -> "State":
        """A fin that is weak, with a share left of its largest amplitude and frequency; 1 is a whole one."""
        self.layout.index(name)
        checked = number(share, f"strength left of {name}", *STRENGTH_RANGE)
        others = tuple(pair for pair in self.weak if pair[0] != name)
        return replace(self, weak=others if checked == 1.0 else (*others, (name, checked)))

    def with_stop(self, name: str, angle: Any) -> "State":
        """A fin that is stuck at a zero direction [rad]; None frees it."""
        self.layout.index(name)
        others = tuple(pair for pair in self.stuck if pair[0] != name)
        if angle is None:
            return replace(self, stuck=others)
        checked = number(angle, f"direction of {name}, stuck, in radians", -math.pi - 1e-6, math.pi + 1e-6)
        return replace(self, stuck=(*others, (name, checked)))

    def with_layout(self, layout: Layout) -> "State":
        """Another layout; damage of fins that still exist stays, unless none would work."""
        failed = tuple(name for name in layout.names if name in self.failed)
        return replace(
            self,
            layout=layout,
            failed=() if len(failed) == layout.n else failed,
            weak=tuple(pair for pair in self.weak if pair[0] in layout.names),
            stuck=tuple(pair for pair in self.stuck if pair[0] in layout.names),
            links=kept(self.links, layout),
        )

    def with_renamed(self, name: str, wanted: str) -> "State":
        """A fin with another name; its damage and its link go on with it.

        Raises:
            LayoutError: there is no such fin, the name is none, or another fin has it.
        """

        def new(old: str) -> str:
            return wanted if old == name else old

        return replace(
            self,
            layout=self.layout.replace_actuator(name, name=wanted),
            failed=tuple(new(old) for old in self.failed),
            weak=tuple((new(old), share) for old, share in self.weak),
            stuck=tuple((new(old), angle) for old, angle in self.stuck),
            links=tuple((new(a), new(b)) for a, b in self.links),
        )

    def with_link(self, a: str, b: str) -> "State":
        """Two fins become a mirror pair that moves together."""
        for name in (a, b):
            self.layout.index(name)
        return replace(self, links=linked(self.links, a, b))

    def with_setting(self, key: str, value: Any) -> "State":
        """The temperature, the method or the policy changed."""
        chosen(key, "setting", ("temperature", *CHOICES))
        if key in CHOICES:
            return replace(self, **{key: chosen(value, key, CHOICES[key])})
        settings = DRAWING.get(self.method, DRAWING["mdn"])  # they say what is wrong with a number
        return replace(self, temperature=replace(settings, temperature=value).temperature)


def can_be_edited(layout: Layout) -> bool:
    """Whether all actuators are fins with horizontal shafts, which the page can place and turn so far."""
    return all(isinstance(part, Fin) and part.mounting_angle is not None for part in layout.actuators)


def least_of(method: str) -> str:
    """What a method keeps least: a key of `LEAST`. The two with networks know the paper's effort alone."""
    return "effort" if method in DRAWING else "watts"


def chosen(value: Any, name: str, choices: Iterable[str]) -> Any:
    """One of some words, or a sentence that says which there are; the page may send anything.

    Raises:
        FinlabError: `value` is none of them.
    """
    words = tuple(choices)
    if value not in words:
        raise FinlabError(f"{name}: expected one of {', '.join(words)}, got {value!r:.60}")
    return value


def number(value: Any, name: str, low: float, high: float) -> float:
    """A finite number within limits, or a sentence that says what is wrong; the page may send anything.

    Raises:
        FinlabError: `value` is not such a number.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise FinlabError(f"{name}: expected a number, got {value!r:.60}")
    if not low <= value <= high:  # a NaN compares false as well
        raise FinlabError(f"{name}: expected a number from {low:g} to {high:g}, got {value:g}")
    return float(value)
