"""The question on the page as a script in Python that prints the same answer."""

from dataclasses import replace

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
    robot, free = robot_and_free_axes(state.layout)
    made_of = ["robot"]
    if state.method != "dual":
        made_of.append(repr(state.method))
    if checkpoint is not None:
        made_of.append(f"checkpoint={checkpoint!r}")
    if state.method in DRAWING and state.temperature is not None:
        made_of.append(f"temperature={state.temperature!r}")
    asked = ["wrench"]
    if state.damage != NO_DAMAGE:
        asked.append(f"damage=finlab.Damage({_damage_arguments(state.damage)})")
    if free:
        asked.append(f"free={free!r}")
    if state.policy != "closest":
        asked.append(f"policy={state.policy!r}")
    if state.flow is not None:
        asked.append(f"flow={list(state.flow)!r}")
    if len(asked) == 1:
        call = ["answer = allocator.allocate(wrench)"]
    else:
        call = ["answer = allocator.allocate(", *[f"    {each}," for each in asked], ")"]
    lines = [
        "import finlab",
        "",
        f"robot = finlab.load_layout({robot!r})",
        f"allocator = finlab.Allocator({', '.join(made_of)})",
        "# Fx, Fy, Fz [N], Tx, Ty, Tz [N m]",
        f"wrench = {list(state.target)!r}",
        *call,
        "print(answer)",
        "print(answer.command.tolist())",
    ]
    return "\n".join(lines) + "\n"


def robot_and_free_axes(layout: Layout) -> tuple[str, tuple[str, ...]]:
    """What the script opens, and which axes it frees: a robot that is shipped but for those is
    still opened by its name."""
    for name, known in shipped().items():
        if replace(layout.unpaired, axes=known.axes) != known.unpaired:
            continue
        freed = known.commanded & ~layout.commanded
        is_freed_alone = not (layout.commanded & ~known.commanded).any()
        if is_freed_alone:
            return name, tuple([AXES[k] for k in range(len(AXES)) if freed[k]])
    return robot_file(layout), ()


def _damage_arguments(damage: Damage) -> str:
    """The arguments of `Damage` that are not as of a whole robot."""
    arguments: list[str] = []
    if damage.lost:
        arguments.append(f"lost={list(damage.lost)!r}")
    for kind, by_name in damage.faults_by_kind.items():
        arguments.append(f"{kind}={dict(by_name)!r}")
    return ", ".join(arguments)
