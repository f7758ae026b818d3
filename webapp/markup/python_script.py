"""The question on the page as a script in Python that prints the same answer."""

from dataclasses import replace
from typing import NamedTuple

from finlab.axes import AXES
from finlab.layout import Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from webapp.session.files import robot_file, shipped
from webapp.session.state import DRAWING, State


def script_of(state: State, checkpoint: str | None = None) -> str:
    """A script of under 15 lines.

    Args:
        state: the robot and the question.
        checkpoint: the checkpoint that the method answers with, as a name or folder; None for the
            shipped one, and for methods without networks.
    """
    opened = opened_robot(state.layout)
    free = opened.free
    made_of = ["robot"]
    if state.method != "dual":
        made_of.append(repr(state.method))
    if checkpoint is not None:
        made_of.append(f"checkpoint={checkpoint!r}")
    if state.method in DRAWING and state.temperature is not None:
        made_of.append(f"temperature={state.temperature!r}")
    arguments = ["wrench"]
    if state.damage != NO_DAMAGE:
        arguments.append(f"damage=finlab.Damage({_damage_arguments(state.damage)})")
    if free:
        arguments.append(f"free={free!r}")
    if state.policy != "closest":
        arguments.append(f"policy={state.policy!r}")
    if state.flow is not None:
        arguments.append(f"flow={list(state.flow)!r}")
    if opened.power:
        arguments.append(f"power={opened.power}")
    if len(arguments) == 1:
        call = ["answer = allocator.allocate(wrench)"]
    else:
        call = ["answer = allocator.allocate(", *[f"    {each}," for each in arguments], ")"]
    lines = [
        "import finlab",
        "",
        f"robot = finlab.load_layout({opened.robot!r})",
        f"allocator = finlab.Allocator({', '.join(made_of)})",
        "# Fx, Fy, Fz [N], Tx, Ty, Tz [N m]",
        f"wrench = {list(state.target)!r}",
        *call,
        "print(answer)",
        "print(answer.command.tolist())",
    ]
    return "\n".join(lines) + "\n"


class OpenedRobot(NamedTuple):
    """What the script opens, and how its question differs from what the file says."""

    robot: str
    """Name of a shipped layout, or of the file that this page makes."""
    free: tuple[str, ...] = ()
    """Axes that it frees."""
    power: str = ""
    """Its power budget in Python; empty for that of the file."""


def opened_robot(layout: Layout) -> OpenedRobot:
    """What the script opens, which axes it frees, and its power budget: a robot that is shipped but
    for those is still opened by its name."""
    for name, known in shipped().items():
        budget_apart = replace(layout.unpaired, power_w=known.power_w, buses=known.buses)
        if replace(budget_apart, axes=known.axes) != known.unpaired:
            continue
        power = _power_argument(layout, known)
        freed = known.commanded & ~layout.commanded
        is_freed_alone = not (layout.commanded & ~known.commanded).any()
        if is_freed_alone and power is not None:
            free = tuple([AXES[k] for k in range(len(AXES)) if freed[k]])
            return OpenedRobot(name, free, power)
    return OpenedRobot(robot_file(layout))


def _power_argument(layout: Layout, known: Layout) -> str | None:
    """The power budget of a layout in Python, beside a shipped one without buses; empty where that
    has the same, None where no argument says it."""
    if layout.buses != known.buses:
        return None
    if layout.power_w == known.power_w:
        return ""
    return "float('inf')" if layout.power_w is None else repr(layout.power_w)


def _damage_arguments(damage: Damage) -> str:
    """The arguments of `Damage` that are not as of a whole robot."""
    arguments: list[str] = []
    if damage.lost:
        arguments.append(f"lost={list(damage.lost)!r}")
    for kind, by_name in damage.faults_by_kind.items():
        arguments.append(f"{kind}={dict(by_name)!r}")
    return ", ".join(arguments)
