"""The question on the page as a script in Python that prints the same answer."""

from dataclasses import replace
from typing import Any

from finlab.axes import AXES
from finlab.layout import Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from webapp.session.files import shipped
from webapp.session.state import DRAWING, State
from webapp.tasks.take_home import robot_file


def script_of(state: State, checkpoint: str | None = None) -> str:
    """A script of under 15 lines.

    Args:
        state: the robot and the question.
        checkpoint: the checkpoint that the method answers with, as a name or folder; None for the
            shipped one, and for methods without networks.
    """
    robot, free = robot_and_free_axes(state.layout)
    arguments = [repr(state.method)] if state.method != "dual" else []
    if checkpoint is not None:
        arguments.append(f"checkpoint={checkpoint!r}")
    if state.method in DRAWING and state.temperature is not None:
        arguments.append(f"temperature={state.temperature!r}")
    lines = [
        "import finlab",
        "",
        f"robot = finlab.load_layout({robot!r})",
        f"allocator = finlab.Allocator({', '.join(['robot', *arguments])})",
        "answer = allocator.allocate(",
        f"    {list(state.target)!r},  # Fx, Fy, Fz [N], Tx, Ty, Tz [N m]",
    ]
    if state.damage != NO_DAMAGE:
        lines.append(f"    damage=finlab.Damage({_damage_arguments(state.damage)}),")
    if free:
        lines.append(f"    free={free!r},")
    if state.policy != "closest":
        lines.append(f"    policy={state.policy!r},")
    if state.flow is not None:
        lines.append(f"    flow={list(state.flow)!r},")
    lines += [")", "print(answer)", "print(answer.command.tolist())"]
    return "\n".join(lines) + "\n"


def robot_and_free_axes(layout: Layout) -> tuple[str, tuple[str, ...]]:
    """What the script opens, and which axes it frees: a robot that is shipped but for those is
    still opened by its name."""
    for name, known in shipped().items():
        if replace(layout, axes=known.axes) != known:
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
    faults: dict[str, Any] = {
        "weak": damage.weak,
        "torn": damage.torn,
        "stuck": damage.stuck,
        "running": damage.running,
    }
    for kind, values in faults.items():
        if values:
            arguments.append(f"{kind}={dict(values)!r}")
    return ", ".join(arguments)
