"""Lists to choose from and boxes to tick: what each shows of the model, and what a choice means to it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from tests.browser.walk.boxes import (
    DAMAGE,
    DISPLAY,
    FIN,
    FINS,
    HULL,
    IMPROVE,
    LAYOUTS,
    PILOT,
    REACH,
    RUN,
    SCENARIO,
    SWEEP,
    TOP,
    Spot,
    always,
    selected,
)
from tests.browser.walk.model import Model
from webapp.panels.fin_list import RINGS
from webapp.panels.hull_panel import HULL_SHAPES, UNITS, hull_of
from webapp.panels.limits_tab import SAVED
from webapp.panels.pilot import PADS
from webapp.panels.view_tab import SCALES, SWITCHES
from webapp.session import ANGLE_STEPS, POSITION_STEPS
from webapp.session.files import shipped, shipped_name
from webapp.session.fin_edits import FORMULAS
from webapp.session.looking import PINNED
from webapp.session.scenarios import SCENARIOS
from webapp.session.search_request import ALL, GOAL_WORDS
from webapp.session.state import AXIS_WORDS, KINDS, OBJECTIVES
from webapp.session.swim_plan import ALONE, CONTROLLERS, PLANTS, SHIPPED

METHODS = ("search", "mdn", "analytic", "qp", "sqp")
"""Methods that the walk asks: the others take their time."""


@dataclass(frozen=True)
class Choice:
    """A list of words."""

    spot: Spot
    label: str
    entries: Callable[[Model], Iterable[str]]
    shows: Callable[[Model], str]
    take: Callable[[Model, str], object]
    there: Callable[[Model], bool] = always
    folder: str = ""


@dataclass(frozen=True)
class Tick:
    """A box to tick."""

    spot: Spot
    label: str
    shows: Callable[[Model], bool]
    take: Callable[[Model, bool], object]
    there: Callable[[Model], bool] = always
    folder: str = ""


def choices() -> list[Choice]:
    """All lists."""

    def setting(key: str) -> tuple[Any, Any]:
        return (lambda m: getattr(m.session.state, key)), (lambda m, v: m.session.set_setting(key, v))

    def display(key: str) -> tuple[Any, Any]:
        return (lambda m: getattr(m.session.display, key)), (lambda m, v: m.session.set_display(key, v))

    def swim(key: str) -> tuple[Any, Any]:
        return (lambda m: getattr(m.session.swim, key)), (lambda m, v: m.session.set_swim(key, v))

    def own(key: str) -> tuple[Any, Any]:
        return (lambda m: getattr(m, key)), (lambda m, v: setattr(m, key, v))

    def layout(model: Model) -> str:
        now = model.session.state.layout
        said = "yours" if now == model.session.saved else "edited"
        return shipped_name(now) or f"{now.name}, {said}"

    def shape(model: Model, kind: str) -> None:
        half = hull_of(model.session.state.layout).half
        model.session.set_hull(kind, tuple(2 * v for v in half))

    def names(model: Model) -> tuple[str, ...]:
        return tuple(model.session.state.layout.names)

    def beside(model: Model) -> list[str]:
        return [SAVED, *([PINNED] if model.session.pinned is not None else []), "A", "C"]

    def bare(model: Model) -> bool:
        return not selected(model)

    scale = {newtons: entry for entry, newtons in SCALES.items()}
    methods = ("search", "analytic", "qp")
    swims = {
        "Scenario": ("scenario", tuple(SCENARIOS)),
        "Path": ("path", tuple(SHIPPED)),
        "Swim with": ("method", methods),
        "Beside": ("rival", (ALONE, *methods)),
        "Controller": ("controller", CONTROLLERS),
        "Fin forces": ("plant", tuple(PLANTS)),
    }
    return [
        Choice(TOP, "Method", lambda _: METHODS, *setting("method")),
        Choice(TOP, "Keep least", lambda _: OBJECTIVES, *setting("objective")),
        Choice(FINS, "Copies around", lambda _: RINGS, *own("ring")),
        Choice(
            LAYOUTS, "Layout", lambda _: shipped(), layout, lambda m, v: m.session.open_layout(shipped()[v])
        ),
        Choice(
            DAMAGE,
            "Which fin",
            names,
            lambda m: m.damaged,
            lambda m, v: m.session.select(v),
            folder=DAMAGE[1],
        ),
        Choice(PILOT, "Stick for", lambda _: PADS, *own("stick"), folder=PILOT[1]),
        Choice(PILOT, "Out of reach", lambda _: KINDS, *setting("policy"), folder=PILOT[1]),
        Choice(SWEEP, "Sweep", lambda _: AXIS_WORDS, *own("sweep_axis")),
        Choice(FIN, "Snap place", lambda _: POSITION_STEPS, *display("position_snap"), selected),
        Choice(FIN, "Snap turn", lambda _: ANGLE_STEPS, *display("angle_snap"), selected),
        Choice(
            FIN,
            "Model",
            lambda _: FORMULAS,
            lambda m: m.fin.model.type,
            lambda m, v: m.session.choose_model(v),
            selected,
        ),
        Choice(
            HULL,
            "Shape",
            lambda _: HULL_SHAPES,
            lambda m: hull_of(m.session.state.layout).shape,
            shape,
            bare,
            HULL[1],
        ),
        Choice(
            HULL,
            "Unit of file",
            lambda _: UNITS,
            lambda m: m.session.mesh_unit,
            lambda m, v: setattr(m.session, "mesh_unit", v),
            bare,
            HULL[1],
        ),
        Choice(
            REACH,
            "Beside",
            beside,
            lambda m: m.session.beside or SAVED,
            lambda m, v: m.session.compare_with(None if v == SAVED else v),
        ),
        Choice(
            IMPROVE,
            "Goal",
            lambda _: GOAL_WORDS,
            lambda m: m.session.draft.goal,
            lambda m, v: m.session.set_draft(m.session.draft.with_goal(v)),
        ),
        Choice(IMPROVE, "Bounds of", lambda m: (ALL, *names(m)), *own("bounds_of")),
        Choice(
            DISPLAY,
            "Arrow scale",
            lambda _: SCALES,
            lambda m: scale[m.session.display.newtons],
            lambda m, v: m.session.set_display("newtons", SCALES[v]),
            folder="Display",
        ),
        *(
            Choice(
                SCENARIO,
                label,
                lambda _, entries=entries: entries,
                *swim(key),
                folder="More" if key in ("controller", "plant") else "",
            )
            for label, (key, entries) in swims.items()
        ),
    ]


def ticks() -> list[Tick]:
    """All boxes to tick."""

    def display(key: str) -> tuple[Any, Any]:
        return (lambda m: getattr(m.session.display, key)), (lambda m, v: m.session.set_display(key, v))

    def own(key: str) -> tuple[Any, Any]:
        return (lambda m: getattr(m, key)), (lambda m, v: setattr(m, key, v))

    def jam(model: Model, stuck: bool) -> None:
        model.session.jam(model.damaged, 0.0 if stuck else None)

    return [
        Tick(DAMAGE, "Stuck", lambda m: m.damaged in dict(m.session.state.stuck), jam, folder=DAMAGE[1]),
        Tick(PILOT, "Spring back", *own("spring"), folder=PILOT[1]),
        Tick(PILOT, "Drag in 3D (G)", *display("grips"), folder=PILOT[1]),
        Tick(FIN, "Stick to hull", *display("stick"), selected),
        Tick(REACH, "Alone", *display("alone"), lambda m: m.session.display.drawn != "none"),
        Tick(
            IMPROVE,
            "Symmetric",
            lambda m: m.session.draft.symmetric,
            lambda m, v: m.session.set_draft(m.session.draft.with_symmetry(v)),
        ),
        Tick(SCENARIO, "Follow", *own("follow"), folder="More"),
        Tick(
            RUN,
            "Announced",
            lambda m: m.session.swim.announced,
            lambda m, v: m.session.set_swim("announced", v),
        ),
        *(Tick(DISPLAY, label, *display(key), folder="Display") for key, (label, _) in SWITCHES.items()),
    ]
