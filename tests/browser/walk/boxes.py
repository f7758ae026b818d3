"""Every box for numbers: where it is, what it shows of a model, and what a number in it means."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

from finlab.layout.fin import FIN_MODELS
from finlab.physics.vehicle import GRAVITY
from tests.browser.walk.hand import Spot
from tests.browser.walk.model import Model
from webapp.panels.body_inspector import PARTS
from webapp.panels.fin_inspector import DRIVE
from webapp.panels.hull_panel import center_of_gravity, hull_of
from webapp.session.fin_edits import FORMULAS, words
from webapp.session.search_request import SearchRequest
from webapp.session.state import AXIS_UNITS

Values = tuple[float, ...]
WRENCH, DAMAGE = ("Allocate", "Wrench"), ("Allocate", "Damage a fin")
CANDIDATES, SWEEP = ("Allocate", "Candidates"), ("Allocate", "Sweep")
FIN, BODY, HULL = ("Design", "Fin"), ("Design", "Body"), ("Design", "Hull")
IMPROVE, SCENARIO, RUN = ("Design", "Improve"), ("Simulate", "Scenario"), ("Simulate", "Run")
DISPLAY = ("Allocate", "Display")
TOP, FINS, LAYOUTS = ("Allocate", "Answers"), ("Design", "Fins"), ("Design", "Designs")
REACH, PILOT = ("Design", "Reach"), ("Allocate", "Steer by hand")
FIGURES, FILES = ("Simulate", "Figures"), ("Export", "Files")
COMPARED, ANSWERED = ("Allocate", "Comparison"), ("Allocate", "Fins")


def always(_model: Model) -> bool:
    """There at any time."""
    return True


@dataclass(frozen=True)
class Box:
    """A row of one number or several."""

    spot: Spot
    label: str
    values: Callable[[Model], Values]
    """What is in force."""
    take: Callable[[Model, Values], object]
    """What the numbers of the row mean."""
    low: float
    high: float
    """Ends of what is typed; a little more is typed, too, and may be refused."""
    step: float = 0.01
    digits: int = 4
    nth: int = 0
    folder: str = ""
    there: Callable[[Model], bool] = always

    @property
    def unit(self) -> str:
        """As it stands in the label."""
        return self.label.partition("[")[2].rstrip("]")

    def text(self, value: float) -> str:
        """A number as it is shown."""
        text = f"{value:.{self.digits}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
        return "0" if text == "-0" else text


def selected(model: Model) -> bool:
    """Whether a fin is."""
    return model.session.selected is not None


def boxes() -> list[Box]:
    """All of them."""
    return [*_question(), *_fin(), *_body(), *_search(), *_swim()]


def _one(value: Callable[[Any], float], take: Callable[[Any, float], object]) -> tuple[Any, Any]:
    """A row of one number, of a session."""
    return (lambda m: (value(m.session),)), (lambda m, values: take(m.session, values[0]))


def _question() -> Iterable[Box]:
    for k, axis in enumerate(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")):
        label, step = f"{axis} [{AXIS_UNITS[k]}]", 0.01 if k < 3 else 0.001
        pair = _one(lambda s, k=k: s.state.target[k], lambda s, v, k=k: s.set_target(k, v))
        yield Box(WRENCH, label, *pair, -5.0, 5.0, step)
    yield Box(
        DAMAGE,
        "Strength [%]",
        lambda m: (100.0 * dict(m.session.state.weak).get(m.damaged, 1.0),),
        lambda m, v: m.session.weaken(m.damaged, v[0] / 100.0),
        5.0,
        100.0,
        5.0,
        1,
        folder="Damage a fin",
    )
    yield Box(
        DAMAGE,
        "Stuck at [°]",
        lambda m: (math.degrees(dict(m.session.state.stuck).get(m.damaged, 0.0)),),
        lambda m, v: m.session.jam(m.damaged, math.radians(v[0])),
        -180.0,
        180.0,
        5.0,
        1,
        folder="Damage a fin",
        there=lambda m: m.damaged in dict(m.session.state.stuck),
    )
    for key, label, low, high, step, digits in (
        ("n_candidates", "Candidates K", 4.0, 256.0, 1.0, 0),
        ("temperature", "Temperature T", 0.0, 2.0, 0.01, 4),
        ("gamma", "Effort weight γ", 0.0, 1.0, 0.005, 4),
    ):
        pair = _one(
            lambda s, key=key: float(s.state.drawing.get(key, 0.0)),
            lambda s, v, key=key: s.set_setting(key, v),
        )
        there = lambda m, key=key: key in m.session.state.drawing  # noqa: E731
        yield Box(CANDIDATES, label, *pair, low, high, step, digits, there=there)
    yield Box(SWEEP, "From, to", lambda m: m.ends, lambda m, v: setattr(m, "ends", v), -20.0, 20.0, 0.05)
    speed = _one(lambda s: s.display.speed, lambda s, v: s.set_display("speed", v))
    yield Box(DISPLAY, "Motion speed", *speed, 0.05, 1.0, 0.05, 3, folder="Display")


def _fin() -> Iterable[Box]:
    def turn(model: Model, values: Values) -> None:
        model.session.turn_selected(math.radians(values[0]))

    def limit(quantity: str, scale: float, model: Model, values: Values) -> None:
        model.session.limit_selected(quantity, (scale * values[0], scale * values[1]))

    place = (lambda m: m.fin.position), (lambda m, v: m.session.place_selected(v))
    yield Box(FIN, "Position [m]", *place, -0.6, 0.6, 0.005, there=selected)
    shaft = (lambda m: (math.degrees(m.fin.mounting_angle),)), turn
    yield Box(FIN, "Shaft [°]", *shaft, -400.0, 400.0, 1.0, 2, there=selected)
    for quantity, label, low, high, step, digits in (
        ("amplitude", "A [rad]", 0.0, 1.5, 0.05, 4),
        ("frequency", "f [Hz]", 0.0, 20.0, 0.1, 4),
        ("zero_direction", "φ [°]", -180.0, 180.0, 5.0, 2),
    ):
        scale = math.pi / 180.0 if "°" in label else 1.0

        def ends(model: Model, quantity: str = quantity, turns: bool = "°" in label) -> Values:
            found = getattr(model.fin.limits, quantity)
            return tuple(math.degrees(end) for end in found) if turns else tuple(found)

        take = partial(limit, quantity, scale)
        yield Box(FIN, label, ends, take, low, high, step, digits, there=selected)
    for kind in FORMULAS:
        for key, rule in FIN_MODELS[kind].items():
            unit = f" [{rule.unit}]".replace("^2", "²").replace("^3", "³") if rule.unit else ""
            usual = abs(rule.default) or 1.0
            yield Box(
                FIN,
                f"{words(key)}{unit}",
                lambda m, key=key: (float(m.fin.model.values()[key]),),
                lambda m, v, key=key: m.session.set_parameter(key, v[0]),
                0.5 * usual,
                2.0 * usual,
                usual / 20.0,
                there=lambda m, kind=kind: selected(m) and m.fin.model.type == kind,
            )
    for key, (label, _) in DRIVE.items():
        yield Box(
            FIN,
            label,
            lambda m, key=key: (float(getattr(m.fin.servo, key)),),
            lambda m, v, key=key: m.session.set_servo(key, v[0]),
            0.5,
            40.0,
            0.5,
            folder="Drive",
            there=selected,
        )


def _body() -> Iterable[Box]:
    def alone(model: Model) -> bool:
        return not selected(model)

    def lift(model: Model) -> Values:
        body = model.session.state.layout.body
        mass = 0.0 if body is None else body.mass_kg or 0.0
        given = None if body is None else body.buoyancy_n
        return (mass * GRAVITY if given is None else given,)

    def mass(model: Model) -> Values:
        body = model.session.state.layout.body
        return (0.0 if body is None else body.mass_kg or 0.0,)

    def whole(model: Model, key: str) -> Values:
        body = model.session.state.layout.body
        return (None if body is None else getattr(body, key)) or (0.0,) * 3 * len(PARTS[key])

    def take(key: str, first: int, model: Model, values: Values) -> None:
        known, body = list(whole(model, key)), model.session.state.layout.body
        known[first : first + 3] = values
        if key == "inertia_kgm2" and (body is None or body.inertia_kgm2 is None):
            known = [value or max(known) for value in known]  # one that is typed first stands for all
        model.session.set_dynamics(key, tuple(known))

    weigh = lambda m, v: m.session.set_dynamics("mass_kg", v[0])  # noqa: E731
    yield Box(BODY, "Mass [kg]", mass, weigh, 0.5, 60.0, 0.5, there=alone)
    lifts = lambda m, v: m.session.set_dynamics("buoyancy_n", v[0])  # noqa: E731
    yield Box(BODY, "Buoyancy [N]", lift, lifts, 0.0, 400.0, 1.0, there=alone)
    seen: list[str] = []
    for key, rows in PARTS.items():
        for label, first, _ in rows:
            shown = lambda m, key=key, first=first: whole(m, key)[first : first + 3]  # noqa: E731
            act, nth = partial(take, key, first), seen.count(label)
            seen.append(label)
            yield Box(BODY, label, shown, act, 0.0, 20.0, 0.1, nth=nth, there=alone)
    center = (
        (lambda m: center_of_gravity(m.session.state.layout)),
        (lambda m, v: m.session.set_center_of_gravity(v)),
    )
    yield Box(HULL, "Centre of gravity [m]", *center, -0.1, 0.1, 0.005, folder="Hull", there=alone)
    size = (
        (lambda m: tuple(2 * v for v in hull_of(m.session.state.layout).half)),
        (lambda m, v: m.session.set_hull(hull_of(m.session.state.layout).shape, v)),
    )
    yield Box(HULL, "Size [m]", *size, 0.05, 1.5, 0.01, folder="Hull", there=alone)


def _search() -> Iterable[Box]:
    def way(model: Model) -> Any:
        return model.session.draft.way(model.bounds_of)

    def bound(model: Model, whole: Values) -> None:
        model.session.set_draft(SearchRequest.with_way(model.session.draft, model.bounds_of, whole))

    reach = (lambda m: way(m)[:3]), (lambda m, v: bound(m, (*v, way(m)[3])))
    yield Box(IMPROVE, "Reach ± [m]", *reach, 0.0, 0.5)
    turn = (lambda m: way(m)[3:]), (lambda m, v: bound(m, (*way(m)[:3], v[0])))
    yield Box(IMPROVE, "Turn ± [°]", *turn, 0.0, 180.0, 5.0, 2)
    apart = _one(lambda s: s.draft.apart_m, lambda s, v: s.set_draft(s.draft.with_apart(v)))
    yield Box(IMPROVE, "Apart [m]", *apart, 0.0, 1.0)


def _swim() -> Iterable[Box]:
    for spot, key, label, low, high, step, digits in (
        (SCENARIO, "pack_wh", "Battery [Wh]", 0.1, 500.0, 1.0, 3),
        (SCENARIO, "electronics_w", "Other load [W]", 0.0, 50.0, 0.5, 3),
        (RUN, "speed", "Speed", 0.1, 8.0, 0.1, 2),
        (RUN, "current_cm_s", "Current [cm/s]", 0.0, 30.0, 0.1, 3),
        (RUN, "heading_deg", "flows to [°]", -180.0, 180.0, 1.0, 3),
        (RUN, "waves_cm", "Waves [cm]", 0.0, 60.0, 1.0, 3),
        (RUN, "buoyancy_percent", "Buoyancy [%]", -3.0, 3.0, 0.1, 3),
    ):
        pair = _one(
            lambda s, key=key: getattr(s.swim, key),
            lambda s, v, key=key: s.set_swim(key, v),
        )
        yield Box(spot, label, *pair, low, high, step, digits, folder="More" if spot == SCENARIO else "")
