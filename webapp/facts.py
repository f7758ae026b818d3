"""The facts that one page shows: plain values by name, made once for every change and every answer."""

from typing import Any

from webapp.markup.swim_card import pace_words
from webapp.scene.wrench_nodes import Scale
from webapp.session import Session
from webapp.tasks.jobs import Jobs

Facts = dict[str, Any]
"""Whoever shows a part names the facts that it is made of, each with its type."""


def facts_of(session: Session, jobs: Jobs, dragged: int | None, scale: Scale, before: Facts | None) -> Facts:
    """The facts of a session and of what has been worked out for it, and of the view: the place of the
    actuator that is `dragged`, and the scale of arrows. `before` are the last ones."""
    state, answering, improver, fitting = session.state, jobs.answering, jobs.improver, jobs.fitting
    swimming, swimmer, modes = jobs.swimming, jobs.swimming.swimmer, answering.modes
    same = before is not None and before["layout"] is state.layout and before["health"] == state.health
    return {
        "state": state,
        **_of(state, "layout failed health target flow method policy network"),
        # The layout with the limits that are left to damaged actuators.
        "able": before["able"] if same and before is not None else state.able,
        **_of(session, "saved selected selection desk display draft swim loops"),
        "task": session.desk.task,
        "undo": session.history.undo_name,
        "redo": session.history.redo_name,
        **_of(session.guide, "stop solved"),
        # The newest answer, which may be older than the state, and what of it is on the robot.
        **_of(answering, "best shown busy error modes searching proving"),
        "in_reach": answering.reply is not None and answering.reply.in_reach,
        "mode": min(session.mode, max(len(modes.shown) - 1, 0)),
        "step": session.step if not answering.searching and modes.steps else None,
        "playing": jobs.refining.running,
        "ranges": jobs.ranging.findings,
        "ranges_error": jobs.ranging.error,
        "found": jobs.analyst.findings,
        "finding": jobs.analyst.busy,
        "found_error": jobs.analyst.error,
        "run": jobs.comparison.run,
        "better": improver.findings,
        "progress": improver.progress,
        "improving": improver.busy,
        "better_error": improver.error,
        "fitted": fitting.findings,
        "fitting": fitting.progress,
        "fitted_error": fitting.error,
        "swims": swimming.active,
        "swimmer": swimmer,
        "moment": None if swimmer is None else swimmer.shown,
        "drawn": state.layout if swimmer is None else swimmer.layout,  # the robot in the view
        "paused": swimming.active and not swimming.running and not swimming.done,
        "pace": pace_words(swimming) if swimming.active else "",
        "dragged": dragged,
        "scale": scale,
    }


def _of(source: object, names: str) -> Facts:
    return {name: getattr(source, name) for name in names.split()}
