"""The question of the page as a command, and as lines of Python."""

import math
import shlex

from webapp.session.files import file_stem, shipped_name
from webapp.session.state import State


def command_line(state: State) -> str:
    """The same question for `finlab allocate`."""
    words = ["finlab", "allocate", _layout_name(state), "--wrench"]
    words += [f"{value:g}" for value in state.target]
    words += _failures(state)
    for name, share in state.weak:
        words += ["--health", f"{name}={share:g}"]
    for name, angle in state.stuck:
        words += ["--stuck", f"{name}={math.degrees(angle):g}"]
    words += _method(state)
    if state.policy != "closest":
        words += ["--policy", state.policy]
    return shlex.join(words)


def python_lines(state: State) -> str:
    """The same question in Python."""
    name = _layout_name(state)
    chosen = [repr(state.method)] if state.method != "dual" else []
    target = ", ".join(f"{value:g}" for value in state.target)
    options = [f"failed={list(state.failed)!r}"] if state.failed else []
    if state.policy != "closest":
        options.append(f"policy={state.policy!r}")
    if state.health is not None:
        kinds = {"weak": state.weak, "stuck": state.stuck}
        damage = [
            f"{kind}={ {name: round(value, 4) for name, value in pairs} }"
            for kind, pairs in kinds.items()
            if pairs
        ]
        options.append(f"health=finlab.Health.of({', '.join(damage)})")
    lines = [
        "import finlab",
        "",
        f"layout = finlab.load_layout({name!r})",
        f"allocator = finlab.Allocator({', '.join(['layout', *chosen])})",
        f"wrench = [{target}]",
        f"result = allocator.allocate({', '.join(['wrench', *options])})",
        "print(result.command, result.wrench)",
    ]
    return "\n".join(lines)


def _layout_name(state: State) -> str:
    """A shipped layout by its name, any other by the file that is saved of it."""
    return shipped_name(state.layout) or f"{file_stem(state.layout.name)}.yaml"


def _method(state: State) -> list[str]:
    """The method, where it is not the usual one."""
    return ["--method", state.method] if state.method != "dual" else []


def _failures(state: State) -> list[str]:
    return [word for name in state.failed for word in ("--failed", name)]
