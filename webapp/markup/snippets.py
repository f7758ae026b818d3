"""The question of the page as a command."""

import math
import shlex

from webapp.session.files import file_stem, shipped_name
from webapp.session.state import State


def command_line(state: State) -> str:
    """The same question for `finlab allocate`."""
    words = ["finlab", "allocate", _layout_name(state), "--wrench"]
    words += [f"{value:g}" for value in state.target]
    for name in state.failed:
        words += ["--failed", name]
    for name, share in state.weak:
        words += ["--health", f"{name}={share:g}"]
    for name, angle in state.stuck:
        words += ["--stuck", f"{name}={math.degrees(angle):g}"]
    if state.method != "dual":
        words += ["--method", state.method]
    if state.policy != "closest":
        words += ["--policy", state.policy]
    return shlex.join(words)


def _layout_name(state: State) -> str:
    """A shipped layout by its name, any other by the file that is saved of it."""
    return shipped_name(state.layout) or f"{file_stem(state.layout.name)}.yaml"
