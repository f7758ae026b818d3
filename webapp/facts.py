"""What there is to show on one page: plain values, made once for every change and every answer."""

from typing import NamedTuple

from finlab.allocation.allocation import Allocation
from finlab.analysis import Improvement, Progress
from finlab.forces.reach import Ranges
from finlab.layout import Layout
from finlab.layout.damage import Health
from webapp.markup.swim_card import pace_words
from webapp.scene.wrench_nodes import Scale
from webapp.session import Display, Session
from webapp.session.lessons import Stop
from webapp.session.looking import Desk
from webapp.session.search_request import SearchRequest
from webapp.session.state import Flow, State
from webapp.session.swim_plan import SwimSettings
from webapp.tasks.analyst import Findings
from webapp.tasks.comparison import Run
from webapp.tasks.fitting import Fitted
from webapp.tasks.jobs import Jobs
from webapp.tasks.mode_names import Modes
from webapp.tasks.moment import Moment
from webapp.tasks.swimmer import Swimmer


class Facts(NamedTuple):
    """All of it. Whoever shows a part names the fields that it is made of."""

    state: State
    layout: Layout
    able: Layout
    """The layout with the limits that are left to damaged fins."""
    failed: tuple[str, ...]
    health: Health | None
    target: tuple[float, ...]
    flow: Flow | None
    """Velocity relative to the water [m/s, rad/s], where one is felt."""
    method: str
    policy: str
    network: str
    saved: Layout
    undo: str | None
    redo: str | None
    selected: str | None
    selection: tuple[str, ...]
    desk: Desk
    task: str
    display: Display
    draft: SearchRequest
    swim: SwimSettings
    stop: Stop | None
    solved: bool
    dragged: int | None

    best: Allocation | None
    """The newest answer; it may be older than the state."""
    shown: Allocation | None
    in_reach: bool
    busy: bool
    error: str | None
    modes: Modes
    mode: int
    """Which of them is on the robot."""
    step: int | None
    """Steps of refinement that are shown; None where all are."""
    playing: bool
    loops: bool
    searching: bool
    ranges: Ranges | None
    ranges_error: str | None
    found: Findings | None
    finding: bool
    found_error: str | None
    run: Run
    better: Improvement | None
    progress: Progress | None
    improving: bool
    better_error: str | None
    fitted: Fitted | None
    fitting: str | None
    """What is being done to fit a fin; None where nothing is."""
    fitted_error: str | None
    swims: bool
    """Whether there is a swim, running or being made."""
    swimmer: Swimmer | None
    moment: Moment | None
    drawn: Layout
    """The robot in the view: the one that swims, or the one that is designed."""
    paused: bool
    pace: str
    scale: Scale


def facts_of(session: Session, jobs: Jobs, dragged: int | None, scale: Scale, before: Facts | None) -> Facts:
    """The facts of a session and of what has been worked out for it, and of the view; `before` are the last
    ones."""
    state, history, swimming = session.state, session.history, jobs.swimming
    answering, ranging, analyst = jobs.answering, jobs.ranging, jobs.analyst
    swimmer, modes = swimming.swimmer, answering.modes
    layout, health = state.layout, state.health
    same = before is not None and before.layout is layout and before.health == health
    return Facts(
        state=state,
        layout=layout,
        able=before.able if same and before is not None else state.able,
        failed=state.failed,
        health=health,
        target=state.target,
        flow=state.flow,
        method=state.method,
        policy=state.policy,
        network=state.network,
        saved=session.saved,
        undo=history.undo_name,
        redo=history.redo_name,
        selected=session.selected,
        selection=session.selection,
        desk=session.desk,
        task=session.desk.task,
        display=session.display,
        draft=session.draft,
        swim=session.swim,
        stop=session.guide.stop,
        solved=session.guide.solved,
        dragged=dragged,
        best=answering.best,
        shown=answering.shown,
        in_reach=answering.reply is not None and answering.reply.in_reach,
        busy=answering.busy,
        error=answering.error,
        modes=modes,
        mode=min(session.mode, max(len(modes.shown) - 1, 0)),
        step=session.step if not answering.searching and modes.steps else None,
        playing=jobs.refining.running,
        loops=session.loops,
        searching=answering.searching,
        ranges=ranging.findings,
        ranges_error=ranging.error,
        found=analyst.findings,
        finding=analyst.busy,
        found_error=analyst.error,
        run=jobs.comparison.run,
        better=jobs.improver.findings,
        progress=jobs.improver.progress,
        improving=jobs.improver.busy,
        better_error=jobs.improver.error,
        fitted=jobs.fitting.findings,
        fitting=jobs.fitting.progress if jobs.fitting.busy else None,
        fitted_error=jobs.fitting.error,
        swims=swimming.active,
        swimmer=swimmer,
        moment=None if swimmer is None else swimmer.shown,
        drawn=layout if swimmer is None else swimmer.layout,
        paused=swimming.active and not swimming.running and not swimming.done,
        pace=pace_words(swimming) if swimming.active else "",
        scale=scale,
    )
