"""The facts of one page: all that its panels and its view are functions of, by name."""

from typing import Any

from webapp.board import Facts
from webapp.markup.outcomes import pace_words
from webapp.scene.wrench_nodes import Scale
from webapp.session import Session
from webapp.tasks.answering import Seen
from webapp.tasks.jobs import Jobs
from webapp.tasks.slot import Slot


def facts_of(session: Session, jobs: Jobs, seen: Seen, dragged: int | None, scale: Scale) -> Facts:
    """The facts of a session and of what has been worked out for it, and of the view: what is
    `seen` of the newest answer, the place of the actuator that is `dragged`, and the scale of
    arrows."""
    state = session.state
    swimming = jobs.swimming
    swimmer = jobs.swimming.swimmer
    tasks: dict[str, Slot[Any, Any]] = {"ranges": jobs.ranging, "found": jobs.analyst}
    tasks |= {"better": jobs.improver, "fitted": jobs.fitting, "judged": jobs.log}
    known: Facts = {}
    opened = session.opened
    both = jobs.both.answer
    for name, task in tasks.items():
        known |= {name: task.answer, f"{name}_error": task.error}
    return {
        "state": state,
        **vars(state),  # layout, damage, target, method, policy, network
        "lost": state.lost,
        "flow": state.flow,
        # The layout with the limits that are left to damaged actuators.
        "able": state.able,
        **vars(session),  # saved, desk, display, draft, swim, loops
        "selected": session.selected,
        "selection": session.selection,
        "task": session.desk.task,
        "drawer": None if session.desk.folded else opened or None,
        "opened": opened,
        "undo": session.history.undo_name,
        "redo": session.history.redo_name,
        "stop": session.guide.stop,
        "solved": session.guide.solved,
        **seen._asdict(),
        "playing": jobs.refining.running,
        **known,
        # With and without jets, of the present question.
        "both": both if both is not None and both.state == state else None,
        "finding": jobs.analyst.busy,
        "run": jobs.comparison.run,
        "progress": jobs.improver.progress,
        "improving": jobs.improver.busy,
        "growing": jobs.growing.answer,
        "fitting": jobs.fitting.progress,
        "judging": jobs.log.progress,
        "by_page": jobs.log.by_page,
        "log_moment": jobs.log.moment,
        "swims": swimming.active,
        "swimmer": swimmer,
        "moment": None if swimmer is None else swimmer.shown,
        "drawn": state.layout if swimmer is None else swimmer.layout,  # the robot in the view
        "paused": swimming.active and not swimming.running and not swimming.done,
        "pace": pace_words(swimming) if swimming.active else "",
        "dragged": dragged,
        "scale": scale,
    }
