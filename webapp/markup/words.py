"""Sentences and numbers as people read them: fixed width, a real minus sign, three significant
digits.

All panels write their markup with `html` and `row`, and their numbers with the functions here, so
that a quantity looks the same wherever it stands.
"""

import math
import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from markupsafe import Markup

import finlab.display
from finlab.actuators.kinds import free_angles
from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.axes import MOTIONS
from finlab.display import LARGEST_PLAIN, NO_NUMBER, as_sentence, listed
from finlab.layout import Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.righting import righting_words
from finlab.swim.vehicle.vehicle import Vehicle

SAFE = (Markup, int, float, np.float64)
"""Types of values that `html` takes as they are: none of them can hold a sign of markup."""
ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "'": "&#39;", '"': "&#34;"})
"""Signs of markup -> what a text has in place of them."""


def html(template: str, *values: object) -> str:
    """Markup: a text that is marked as such.

    Args:
        template: markup with `{}` where values go, which may have formats, as `str.format` has
            them.
        values: texts, which are escaped unless they are marked as markup, numbers, or iterables of
            such, whose items stand one after the other.
    """
    # Much faster than the format of `Markup`, which looks at each value through a formatter of its
    # own.
    safe: list[Any] = []
    for value in values:
        if type(value) in SAFE:
            safe.append(value)
        elif isinstance(value, str) or not isinstance(value, Iterable):
            safe.append(str(value).translate(ESCAPES))
        else:
            items = value if isinstance(value, (list, tuple)) else tuple(value)
            safe.append(html("{}" * len(items), *items))
    return str.__new__(Markup, template.format(*safe))


def row(*cells: object) -> str:
    """A row of a table."""
    return html("<tr>{}</tr>", [html("<td>{}</td>", cell) for cell in cells])


def marker(name: str) -> str:
    """Invisible element, put right before what a style is about; its holder gets `data-fl`
    (`habits.js`)."""
    return html("<i class='{}'></i>", name)


def button_colors(name: str, colors: Sequence[tuple[str, str]]) -> str:
    """A style that paints a group of buttons.

    Args:
        name: of the marker before the group.
        colors: background and text colour of each button, as in CSS.
    """
    template = (
        "[data-fl~={}] + div button:nth-of-type({}) {{ background: {}; color: {}; border-color: "
        "{}; }}"
    )
    holder = name.removeprefix("fl-")
    rules = []
    for k, (background, text) in enumerate(colors):
        rules.append(html(template, holder, k + 1, background, text, background))
    return html("<style>{}</style>{}", rules, marker(name))


DASH = "–"
"""What stands in place of a number that there is none of."""
SPEED = "Speed through the water [m/s]"
"""Label of the control that tells how the robot moves."""
POWER = "Power budget [W]"
"""Label of the box of the power that all actuators may take."""
CONTROLS = {
    "(--flow)": f"({SPEED[:-6]})",
    "(flow)": f"({SPEED[:-6]})",
    ", or power=inf where the layout has one": f", or empty {POWER[:-4]}",
    "leave out `power`, or": f"empty {POWER[:-4]}, or",
    "`result.power`": "its power",
    "(--force LEAST MOST)": "(Force, at Limits of each)",
    "--robot LAYOUT": "By this page's robot, at Log",
    "leave it out of the layout's axes, or name it in free": "switch it off beside its slider",
    "correct `force_n` if not": "else correct Force, at Limits in Design",
    "correct `force_n`": "correct Force, at Limits in Design",
    "correct `position_m`": "correct Position, in Design",
    "write your own as `model`": "correct Ahead and Astern, at Model in Design",
    "`finlab layout convert` expands it": "open the URDF that xacro makes of it",
    "`finlab fit` reads them": "select the thruster that was measured, and open them again",
    "; finlab layout convert reads": "; also read are",
    ", or take `finlab layout convert`, which opens it": "",
    " (--scale)": "",
    "; --whole judges it nevertheless": "",
    "; `finlab fit fin` takes": "; those of fins are",
}
"""Words of the command line that reach the page, and what is said there."""
SMALL = 3e-4
"""Share of what the robot can push that is too small to draw, on one axis; an exact answer lacks no
more."""
ANSWER_SOURCE = "the answer"
"""Source of a mode that is the answer of a method without candidates."""
COMPONENT = "component "
"""How the source of a candidate begins that comes from a component of a mixture."""
MOST_LISTED = 2
"""Components of a mixture that are named; of more their number is told."""
ROUNDING = 1e-9
"""Normalized error, and size of a quantity in its unit, below which the digits are those of the
computer's rounding."""
AT_LIMIT = 0.995
"""Share of the upper limit from which a command counts as saturated."""


def fins_words(numbers: Sequence[int], layout: Layout | None = None) -> str:
    """`fin 2`, `fins 1 and 3`: fins, or actuators of a layout with others, by their places from 0
    in it."""
    word = "fin" if layout is None or layout.is_of_fins else "actuator"
    return f"{word}{'s' if len(numbers) > 1 else ''} {listed([str(k + 1) for k in numbers])}"


def small(value: float) -> str:
    """A number that is small when all is well: `3.10e−05`, and `16.2` where it is not."""
    if 0.1 <= abs(value) < 1e4:
        return three_digits(value)
    return f"{value:.2e}".replace("-", "−") if math.isfinite(value) else DASH


def error_digits(value: float) -> str:
    """An error as `small` has it; what lies below `ROUNDING` is rounding."""
    return "≤ 1e−9" if value < ROUNDING else small(value)


LARGE = re.compile(r"(\d(?:\.\d+)?)e\+(\d+)")
"""A large number with a power of ten."""


def prefixed(value: float) -> tuple[str, str]:
    """Three significant digits of a number, and its SI prefix, from `LARGEST_PLAIN` on."""
    prefix = finlab.display.prefix_of(abs(value))
    digits = finlab.display.three_digits(value / prefix.factor).replace("-", "−")
    return digits, prefix.symbol


def without_powers(text: str) -> str:
    """A text whose large numbers have SI prefixes in place of powers of ten: `2.80M`."""

    def short(match: re.Match[str]) -> str:
        return "".join(prefixed(float(match[0])))

    return LARGE.sub(short, text)


def with_unit(value: float | None, unit: str) -> str:
    """Three significant digits and a unit, in thousands or millions of it where the number would be
    long: `327 W`, `25.8 kW`."""
    if value is not None and math.isfinite(value) and abs(value) >= LARGEST_PLAIN:
        digits, prefix = prefixed(value)
        return f"{digits} {prefix}{unit}"
    return f"{three_digits(value)} {unit}"


@lru_cache(maxsize=256)
def signed(value: float) -> str:
    """Three significant digits with a sign, which zero has not."""
    text = three_digits(value)
    is_positive = value >= ROUNDING and math.isfinite(value)
    return f"+{text}" if is_positive else text


def signed_degrees(angle: float) -> str:
    """An angle [rad] in degrees with a sign, which zero has not: `+30`."""
    rounded = round(math.degrees(angle))
    return f"{rounded:+d}".replace("-", "−") if rounded else "0"


def degrees(angle: float) -> str:
    """An angle [rad] as people read it: `−30`."""
    return f"{math.degrees(angle):.0f}".replace("-", "−")


@lru_cache(maxsize=256)
def three_digits(value: float | None) -> str:
    """Three significant digits, as the library writes them, with a real minus sign; a dash where
    there is no number, and zero where it is the computer's rounding."""
    if value is not None and abs(value) < ROUNDING:
        value = 0.0
    text = finlab.display.three_digits(value)
    if "e" in text:
        text = without_powers(text)
    return DASH if text == NO_NUMBER else text.replace("-", "−")


FEW_MS = 10.0
"""Time of an answer up to which it has two digits [ms]; no measurement repeats to a third one."""


def time_digits(ms: float) -> str:
    """The time of an answer [ms]."""
    return f"{ms:.2g}" if 1e-3 <= ms < FEW_MS else f"{ms:.0f}"


def source_words(sources: Sequence[str]) -> str:
    """Where a mode comes from: the components of a mixture, or where the search began."""
    if ANSWER_SOURCE in sources:
        return ANSWER_SOURCE
    numbers = [source.removeprefix(COMPONENT) for source in sources if source.startswith(COMPONENT)]
    if len(numbers) > MOST_LISTED:
        numbers = [*numbers[:MOST_LISTED], f"{len(numbers) - MOST_LISTED} more"]
    if numbers:
        return f"component{'s' if len(numbers) > 1 else ''} {listed(numbers)}"
    if not sources:
        return ""
    source = sources[0]
    if source == "all fins":
        return "found with all fins"
    if source == "refined":
        return "a refined sample"
    return f"found {source}" if source.startswith("without ") else f"from {source}"


def in_app(text: str) -> str:
    """A sentence of the library in the words of the page: its own controls in place of options of
    commands, and the command of an option that it has no control for."""
    for option, control in CONTROLS.items():
        text = text.replace(option, control)
    return text


def missing_part(allocation: Allocation) -> list[float]:
    """The unallocated wrench (6,) [N, N m] without what is too small to matter."""
    part: list[float] = allocation.unallocated.tolist()
    for axis, scale in enumerate(allocation.scale.tolist()):
        if abs(part[axis]) <= SMALL * scale:
            part[axis] = 0.0
    return part


def unlearned_sentence(layout: Layout, fins: Sequence[str]) -> str:
    """Which fins the method's networks have not learned, so that its commands for them are
    wrong."""
    words = fins_words([layout.index(name) for name in fins])
    return f"Not learned: {words}. Choose another method"


def authority_sentence(layout: Layout, lost: tuple[str, ...], reach: Array) -> str | None:
    """Which axes the working fins cannot act on at all.

    Args:
        layout: the robot.
        lost: names of its lost actuators.
        reach: what the others give at most along each axis (6,) [N, N m].

    Returns:
        A sentence; None where they can act on all axes.
    """
    is_blind = reach < 1e-6
    if not is_blind.any():
        return None
    blind = [MOTIONS[k] for k in range(6) if is_blind[k]]
    subject = "This"
    if lost:
        subject = f"Without {fins_words([layout.index(name) for name in lost], layout)} this"
    return f"{subject} robot cannot {listed(blind)}."


BODY_WORDS = {
    "mass_kg": "mass",
    "inertia_kgm2": "inertia",
    "added_mass": "added mass",
    "linear_damping": "linear damping",
    "quadratic_damping": "quadratic damping",
    "center_of_buoyancy_m": "centre of buoyancy",
}
"""Field of `Body` that a swim needs -> its words."""


def unsaid_of(layout: Layout) -> tuple[str, ...]:
    """What a swim needs of the body and the layout does not say; it takes U-CAT's in its place, see
    `complete_body`."""
    body = layout.body
    return tuple([words for key, words in BODY_WORDS.items() if getattr(body, key, None) is None])


def righting_sentences(layout: Layout) -> tuple[str, ...]:
    """What there is to say of a robot that nothing rights; nothing where a moment does."""
    words = righting_words(layout)
    return () if words is None else (as_sentence(words),)


def trim_sentence(layout: Layout, reach: Array) -> str | None:
    """What keeping its depth takes of the working fins, given their reach (6,) [N, N m]; None if
    little."""
    vehicle = Vehicle(complete_body(layout))
    # B - W [N]: positive where the robot rises by itself.
    lift = vehicle.buoyancy - vehicle.weight
    heave_reach = float(reach[2])
    if abs(lift) < max(0.5 * heave_reach, 1e-3 * vehicle.weight):
        return None
    motion = "rises" if lift > 0.0 else "sinks"
    direction = "down" if lift > 0.0 else "up"
    clause = f"By its mass and buoyancy this robot {motion} with {three_digits(abs(lift))} N"
    limit = f"{three_digits(heave_reach)} N" if heave_reach >= 1e-6 else "nothing"
    if abs(lift) < heave_reach:
        return f"{clause}; of the {limit} that its working fins can push {direction}, that is most."
    return (
        f"{clause}, and its working fins can push {direction} with {limit} at most: it cannot "
        "keep its depth."
    )


def saturated(allocation: Allocation) -> list[tuple[bool, bool]]:
    """Which of the first two numbers of each command are at their limits, but for free angles."""
    at_limits = []
    limits = _limits(allocation.layout)
    for command, (first, second) in zip(allocation.command.tolist(), limits, strict=True):
        is_first = command[0] >= first[1] or command[0] <= first[0]
        is_second = command[1] >= second[1] or command[1] <= second[0]
        at_limits.append((is_first, is_second))
    return at_limits


Interval = tuple[float, float]


@lru_cache(maxsize=8)
def _limits(layout: Layout) -> list[tuple[Interval, Interval]]:
    """Values at and beyond which the first two numbers of each command count as saturated; infinite
    where one has no limit: at 0, and of free angles."""
    turns = free_angles(layout.actuators)[:, :2]
    is_above = (layout.upper[:, :2] > 0.0) & ~turns
    is_below = (layout.lower[:, :2] < 0.0) & ~turns
    high = np.where(is_above, AT_LIMIT * layout.upper[:, :2], np.inf).tolist()
    low = np.where(is_below, AT_LIMIT * layout.lower[:, :2], -np.inf).tolist()
    return [((low[i][0], high[i][0]), (low[i][1], high[i][1])) for i in range(layout.n)]


def parts_word(layout: Layout) -> str:
    """What a robot pushes with, in a word."""
    return "fins" if layout.is_of_fins else "actuators"


def damage_words(damage: Damage, name: str, sticks_at_angle: bool = True) -> str:
    """What is wrong with an actuator that still works: `weak 50 %, stuck at 30°`.

    Args:
        damage: of the robot.
        name: of the actuator.
        sticks_at_angle: whether what sticks is an angle [rad], else a force [N].

    Returns:
        Words; nothing for a whole actuator.
    """
    if damage == NO_DAMAGE:
        return ""
    faults = []
    for kind, value in damage.faults_of(name).items():
        if kind == "weak":
            faults.append(f"weak {100 * value:.0f} %")
        elif kind == "torn":
            faults.append(f"torn, {100 * value:.0f} % left")
        elif kind == "running":
            faults.append("runs on")
        elif kind == "stuck" and sticks_at_angle:
            faults.append(f"stuck at {math.degrees(value):.0f}°")
        elif kind == "stuck":
            faults.append(f"hangs at {value:.3g} N")
    return ", ".join(faults).replace("-", "−")


def kind_words(kind: str) -> str:
    """A kind of actuator as a button says it, such as `Propeller rudder`."""
    return kind.replace("_", " ").capitalize()
