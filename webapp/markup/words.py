"""Sentences and numbers as people read them: fixed width, a real minus sign, three significant
digits."""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from finlab.actuators.kinds import free_angles
from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.damage import WHOLE, Damage
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.righting import righting_words
from finlab.swim.vehicle.vehicle import Vehicle
from webapp.session.state import AXIS_WORDS

SAFE = (Markup, int, float, np.float64)
ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "'": "&#39;", '"': "&#34;"})


def html(template: str, *values: object) -> str:
    """Markup, a text that is marked as such, with values in the place of `{}`, which may have
    formats, as `str.format` has them. Of several things in one, all stand one after the other."""
    # Much faster than the format of `Markup`, which looks at each value through a formatter of its
    # own.
    safe: list[Any] = []
    for value in values:
        if type(value) in SAFE:
            safe.append(value)
        elif isinstance(value, str) or not isinstance(value, Iterable):
            safe.append(str(value).translate(ESCAPES))
        else:
            parts = value if isinstance(value, (list, tuple)) else tuple(value)
            safe.append(html("{}" * len(parts), *parts))
    return str.__new__(Markup, template.format(*safe))


def row(*cells: object) -> str:
    """A row of a table."""
    return html("<tr>{}</tr>", [html("<td>{}</td>", cell) for cell in cells])


def marker(name: str) -> str:
    """Invisible element, put right before what a style is about; its holder gets `data-fl`
    (`habits.js`)."""
    return html("<i class='{}'></i>", name)


def button_colors(name: str, colors: list[tuple[str, str]]) -> str:
    """A style that paints the buttons of the group behind the marker: background and text colour of
    each."""
    rules = [
        html(
            "[data-fl~={}] + div button:nth-of-type({}) {{ background: {}; color: {}; "
            "border-color: {}; }}",
            name.removeprefix("fl-"),
            k + 1,
            back,
            text,
            back,
        )
        for k, (back, text) in enumerate(colors)
    ]
    return html("<style>{}</style>{}", rules, marker(name))


SPEED = "Speed through the water [m/s]"
"""Label of the control that tells how the robot moves."""
CONVERT = "finlab layout convert"
CONTROLS = {
    "(--flow)": f"({SPEED[:-6]})",
    "(flow)": f"({SPEED[:-6]})",
    "(--force LEAST MOST)": "(Force, at Limits of each)",
    "--robot LAYOUT": "This robot, at Log",
    "leave it out of the layout's axes, or name it in free": "switch it off beside its slider",
    "correct `force_n`": "correct Force at Limits of each",
    "as `model`": "at Model of each",
    "--scale": "finlab log --scale",
    "--voltage": "finlab fit thruster --voltage",
    **{
        f"--{word}": f"{CONVERT} --{word}"
        for word in ("origin", "frame", "fins", "thrusters", "rows", "model")
    },
}
"""Words of the command line that reach the page, and what is said there."""
SMALL = 3e-4
"""Share of what the robot can push that is too small to draw, on one axis; an exact answer lacks no
more."""
OWN = "the answer"
"""Source of a mode that is the answer of a method without candidates."""
MOST_LISTED = 2
"""Components of a mixture that are named; of more their number is told."""
ROUNDING = 1e-9
"""Normalized error below which the digits are those of the computer's rounding."""
AT_LIMIT = 0.995
"""Share of the upper limit from which a command counts as saturated."""


def listed(items: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    items = list(items)
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def fins_words(numbers: Sequence[int], layout: Layout | None = None) -> str:
    """`fin 2`, `fins 1 and 3`: fins, or actuators of a layout with others, by their places from 0
    in it."""
    word = "fin" if layout is None or layout.is_of_fins else "actuator"
    return f"{word}{'s' if len(numbers) > 1 else ''} {listed([str(k + 1) for k in numbers])}"


def small(value: float) -> str:
    """A number that is small when all is well: `3.10e−05`, and `16.2` where it is not."""
    if 0.1 <= abs(value) < 1e4:
        return three_digits(value)
    return f"{value:.2e}".replace("-", "−") if math.isfinite(value) else "–"


def error_digits(value: float) -> str:
    """An error as `small` has it; what lies below `ROUNDING` is rounding."""
    return "≤ 1e−9" if value < ROUNDING else small(value)


def degrees(angle: float) -> str:
    """An angle [rad] as people read it: `−30`."""
    return f"{math.degrees(angle):.0f}".replace("-", "−")


def three_digits(value: float | None) -> str:
    """Three significant digits: `2.32`, `0.0410`, `12.5`; small and large ones as `small` has
    them."""
    if value is None or not math.isfinite(value):
        return "–"
    if value != 0 and not 1e-3 <= abs(value) < 1e4:
        return small(value)
    digits = math.floor(math.log10(float(f"{abs(value):.2e}"))) if value else 0
    return f"{value:.{max(2 - digits, 0)}f}".replace("-", "−")


def source_words(sources: Sequence[str]) -> str:
    """Where a mode comes from: the components of a mixture, or where the search began."""
    if OWN in sources:
        return OWN
    numbers = [s.removeprefix("component ") for s in sources if s.startswith("component ")]
    if len(numbers) > MOST_LISTED:
        numbers = [*numbers[:MOST_LISTED], f"{len(numbers) - MOST_LISTED} more"]
    if numbers:
        return f"component{'s' if len(numbers) > 1 else ''} {listed(numbers)}"
    if not sources:
        return ""
    first = sources[0]
    words = {"all fins": "found with all fins", "refined": "a refined sample"}
    return words.get(first, f"found {first}" if first.startswith("without ") else f"from {first}")


def in_app(text: str) -> str:
    """A sentence of the library in the words of the page: its own controls in place of options of
    commands, and the command of an option that it has no control for."""
    for option, control in CONTROLS.items():
        text = text.replace(option, control)
    return text


def missing_part(allocation: Allocation) -> Array:
    """The unallocated wrench (6,) [N, N m] without what is too small to matter."""
    rest = allocation.unallocated
    return np.where(np.abs(rest / allocation.scale) > SMALL, rest, 0.0)


def unlearned_sentence(layout: Layout, fins: Sequence[str]) -> str:
    """Which fins the method's networks have not learned, so that its commands for them are
    wrong."""
    return (
        f"Not learned: {fins_words([layout.index(name) for name in fins])}. Choose another method"
    )


def authority_sentence(layout: Layout, failed: tuple[str, ...], reach: Array) -> str | None:
    """Which axes the working fins cannot act on at all, given their reach (6,) [N, N m]; None for
    none."""
    blind = [AXIS_WORDS[k] for k in range(6) if reach[k] < 1e-6]
    if not blind:
        return None
    without = (
        f"Without {fins_words([layout.index(name) for name in failed], layout)} this"
        if failed
        else "This"
    )
    return f"{without} robot cannot {listed(blind)}."


def righting_sentences(layout: Layout) -> tuple[str, ...]:
    """What there is to say of a robot that nothing rights; nothing where a moment does."""
    said = righting_words(layout)
    return () if said is None else (f"{said[0].upper()}{said[1:]}.",)


def trim_sentence(layout: Layout, reach: Array) -> str | None:
    """What keeping its depth takes of the working fins, given their reach (6,) [N, N m]; None if
    little."""
    vehicle = Vehicle(complete_body(layout))
    over = vehicle.buoyancy - vehicle.weight
    if abs(over) < max(0.5 * float(reach[2]), 1e-3 * vehicle.weight):
        return None
    goes, way = ("rises", "down") if over > 0.0 else ("sinks", "up")
    said = f"By its mass and buoyancy this robot {goes} with {three_digits(abs(over))} N"
    most = f"{three_digits(float(reach[2]))} N" if reach[2] >= 1e-6 else "nothing"
    if abs(over) < reach[2]:
        return f"{said}; of the {most} that its working fins can push {way}, that is most."
    return (
        f"{said}, and its working fins can push {way} with {most} at most: it cannot keep its "
        "depth."
    )


def saturated(allocation: Allocation) -> NDArray[np.bool_]:
    """Which of the first two numbers of commands (n, 2) are at their limits, but for free
    angles."""
    layout = allocation.layout
    command = allocation.command[:, :2]
    turns = _turning(layout)[:, :2]
    with np.errstate(invalid="ignore"):
        high = (command >= AT_LIMIT * layout.upper[:, :2]) & (layout.upper[:, :2] > 0.0)
        low = (command <= AT_LIMIT * layout.lower[:, :2]) & (layout.lower[:, :2] < 0.0)
    return np.asarray((high | low) & ~turns)


@lru_cache(maxsize=8)
def _turning(layout: Layout) -> NDArray[np.bool_]:
    return free_angles(layout.actuators)


def parts_word(layout: Layout) -> str:
    """What a robot pushes with, in a word."""
    return "fins" if layout.is_of_fins else "actuators"


def damage_words(damage: Damage, name: str, turns: bool = True) -> str:
    """What is wrong with an actuator that still works: `weak 50 %, stuck at 30°`; nothing for a
    whole one. `turns` says whether what sticks is an angle, else a force."""
    said: dict[str, Callable[[Any], str]] = {
        "weak": lambda share: f"weak {100 * share:.0f} %",
        "torn": lambda share: f"torn, {100 * share:.0f} % left",
        "stuck": lambda at: (
            f"stuck at {math.degrees(at):.0f}°" if turns else f"hangs at {at:.3g} N"
        ),
        "running": lambda command: "runs on",
    }
    known = {} if damage == WHOLE else damage.of(name)
    return ", ".join(said[kind](value) for kind, value in known.items()).replace("-", "−")
