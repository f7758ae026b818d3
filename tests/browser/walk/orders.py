"""Keys of the shortcut sheet and entries of the list of commands: what each means to the model."""

from collections.abc import Callable
from typing import Any

from finlab.errors import FinlabError
from tests.browser.walk.model import Model
from webapp.session.lessons import LESSONS
from webapp.session.looking import TASKS
from webapp.session.state import AXIS_WORDS, OBJECTIVES
from webapp.session.targets import PRESETS

ELSEWHERE = (
    "Save the design",
    "Share the design by a link",
    "Play the refinement",
    "Swim: pause or go on",
    "Swim: keep it to compare others with",
    "Swim: back to the design",
    "Show all keys",
    "Export the bundle for the robot",
)
"""Commands that files come of, or that are about a swim; they are walked elsewhere."""


def mark(session: Any, kind: str) -> None:
    """Lock or hide what is selected."""
    if not session.selection:
        raise FinlabError("no fin is selected; click one, or choose it in the list")
    session.toggle_mark(kind, session.selection)


def orders() -> dict[str, Callable[[Model], object]]:
    """What the other commands mean, by their labels; of some a session knows nothing."""
    found: dict[str, Callable[[Any], object]] = {
        "Fold or open the drawer": lambda s: s.fold_drawer(),
        "Undo": lambda s: s.undo(),
        "Redo": lambda s: s.redo(),
        "Select the next fin": lambda s: s.select_next(),
        "Select nothing": lambda s: s.select(None),
        "Duplicate the selected fin": lambda s: s.duplicate_fin(),
        "Mirror the selected fin": lambda s: s.mirror_fin(),
        "Delete the selected fin": lambda s: s.delete_fin(),
        "Add a fin": lambda s: s.add_fin(),
        "Select all fins": lambda s: s.select_all(),
        "Lock or unlock the selected fins": lambda s: mark(s, "locked"),
        "Hide or show the selected fins": lambda s: mark(s, "hidden"),
        "New design": lambda s: s.new_layout(),
        "Unlink the selected fin from its mirror image": lambda s: s.unlink_fin(),
        "Stick the selected fin to the hull": lambda s: s.stick_fin(),
        "Pin this layout to compare with": lambda s: s.pin(),
        "Start over": lambda s: s.start_over(),
        "Fail or repair the selected fin": lambda s: s.toggle_failure(s.selected or s.state.layout.names[0]),
        "Compare the methods": lambda s: s.show_drawer("Comparison"),
        "Stop the sweep": lambda _: None,
        "Frame what is selected": lambda _: None,
        "Tour: start, or next stop": lambda s: s.next_stop(),
    }
    switches = {
        "Drag the wrench in 3D, or stop it": "grips",
        "Parallel lines, or perspective": "parallel",
        "Measure a distance, or stop it": "measure",
        "Freeze or move the fins": "frozen",
        "Show or hide the fin graph": "graph",
        "Show or hide the centre of gravity": "center",
        "Dark or light theme": "dark",
        "Presenter's view, or the usual one": "large",
    }
    found |= {label: lambda s, key=key: s.toggle(key) for label, key in switches.items()}
    found |= {task: lambda s, task=task: s.show_task(task) for task in TASKS}
    found |= {f"Camera: {view}": lambda _: None for view in ("3D", "Top", "Side", "Front")}
    found |= {f"Ask for: {name}": lambda s, name=name: s.set_preset(name) for name in PRESETS}
    found |= {
        f"Ask for {word} alone": lambda s, axis=axis: s.set_only_axis(axis)
        for axis, word in enumerate(AXIS_WORDS)
    }
    found |= {
        f"Keep least: {word}": lambda s, word=word: s.set_setting("objective", word) for word in OBJECTIVES
    }
    found |= {
        f"Lesson: {lesson.title}": lambda s, name=lesson.name: s.open_lesson(name) for lesson in LESSONS
    }
    return {label: lambda model, act=act: act(model.session) for label, act in found.items()}


def pressed(key: str, modifier: str) -> str:
    """A key of the table of commands as a keyboard has it."""
    held = {"cmd/ctrl": "Control+", "cmd/ctrl+shift": "Control+Shift+", "alt": "Alt+"}.get(modifier, "")
    return held + {"escape": "Escape", "delete": "Delete"}.get(key, key.lower())
