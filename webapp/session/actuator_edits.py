"""Changes of one actuator, each of which returns another one, and of its twin in a mirror pair."""

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np

from finlab.errors import FinlabError
from finlab.layout import Actuator, Azimuth, Fin, FinModelSpec, Layout, Rudder, Thruster
from finlab.layout.directions import axis_names, image, part_of, replaced, with_axes
from finlab.layout.fin_model import FIN_MODELS
from finlab.layout.thrust_model import PowerLaw, PowerTable
from webapp.session.state import Links, chosen

QUANTITIES = ("amplitude", "frequency", "zero_direction")
FORMULAS = tuple(name for name, parameters in FIN_MODELS.items() if parameters)
LAW_KEYS = tuple(field.name for field in fields(PowerLaw))


def words(key: str) -> str:
    """A key of a layout file as people write it: `drag_coefficient` is Drag coefficient."""
    text = key.replace("_", " ")
    return text if len(text) <= 2 or text == "phi e" else text[0].upper() + text[1:]


def with_value(part: Actuator, key: str, value: Any) -> Actuator:
    """The actuator with another value of what `key` names: a field of it, of its limits or of its model; as
    it is where it has no such field. None forgets what may be left unsaid. LayoutError: it may not have that
    value."""
    if isinstance(value, (tuple, list)):
        value = tuple(float(end) if isinstance(end, int) else end for end in value)
    if isinstance(part, Fin) and key in QUANTITIES:
        return replace(part, limits=replace(part.limits, **{key: value}))
    if isinstance(part, Fin) and key in FIN_MODELS[part.model.type]:
        return _with_parameter(part, key, value)
    if isinstance(part, Thruster | Azimuth) and key in LAW_KEYS:
        known = isinstance(part.model, PowerLaw)
        return replace(part, model=replace(part.model, **{key: value})) if known else part
    return replace(part, **{key: value}) if key in {field.name for field in fields(part)} else part


def modelled(part: Actuator, kind: str) -> Actuator:
    """The actuator with another kind of model; what both models know, such as the water's density, stays.
    FinlabError: there is no such model, or it needs a file."""
    if isinstance(part, Rudder) or kind == part.model.type:
        return part
    if kind == "table":
        raise FinlabError(f"a table for {part.name} comes from a file; drop its CSV, or fit measurements")
    if not isinstance(part, Fin):
        if kind in FORMULAS:
            return part
        chosen(kind, "model of a thruster", ("power_law",))
        return replace(part, model=_law_of(part.model)) if isinstance(part.model, PowerTable) else part
    if kind == "power_law":
        return part
    chosen(kind, "fin model", FORMULAS)
    shared = tuple((key, value) for key, value in part.model.parameters if key in FIN_MODELS[kind])
    return replace(part, model=FinModelSpec(kind, shared))


def _law_of(table: PowerTable) -> PowerLaw:
    _, force, power = table.columns
    least, most = (
        float(f"{max(power[k] / max(abs(force[k]), 1e-9) ** 1.5, 1e-6):.4g}") if force[k] else None
        for k in (0, -1)
    )
    return PowerLaw(most or least or 1.0, least)


def _with_parameter(fin: Fin, key: str, value: Any) -> Fin:
    usual = FIN_MODELS[fin.model.type][key].default
    parameters = {**dict(fin.model.parameters), key: value}
    if value is None or math.isclose(value, usual, rel_tol=1e-12, abs_tol=0.0):
        del parameters[key]  # files say only what is not usual
    return replace(fin, model=FinModelSpec(fin.model.type, tuple(parameters.items())))


def partner(links: Links, name: str) -> str | None:
    """The actuator that `name` is linked to, if any."""
    for pair in links:
        if name in pair:
            return pair[1 - pair.index(name)]
    return None


def unlinked(links: Links, name: str) -> Links:
    """The links without the pair of an actuator."""
    return tuple(pair for pair in links if name not in pair)


def followed(before: Layout, layout: Layout, links: Links, name: str) -> Layout:
    """The layout after the twin of `name`, if any, took its mirrored place; axes that pointed the other way
    than the image's `before` stay so."""
    twin = partner(links, name)
    if twin is None or twin not in layout.names:
        return layout
    wanted, old = image(part_of(layout, name)), part_of(layout, twin)
    count = len(axis_names(old))
    past = np.sum(np.array(image(part_of(before, name)).frame) * part_of(before, twin).frame, axis=1)
    frame = np.array(wanted.frame) * np.where(past < 0.0, -1.0, 1.0)[:, None]
    return replaced(layout, with_axes(old, frame[:count], wanted.position))
