"""The body in a robot description: masses, and hydrodynamics of gz-sim and uuv_simulator.

What is not said stays unknown. Derivatives after Fossen are negative; a body has their magnitudes.
"""

from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from finlab.exchange.description import ADDED, Description, said
from finlab.exchange.exchange import Exchange, vector
from finlab.exchange.propellers import is_plugin
from finlab.exchange.walk import numbers_in
from finlab.layout import Body
from finlab.layout.axes import Vector

DERIVATIVES = {
    "added_mass": "xDotU yDotV zDotW kDotP mDotQ nDotR",
    "linear_damping": "xU yV zW kP mQ nR",
    "quadratic_damping": "xUabsU yVabsV zWabsW kPabsP mQabsQ nRabsR",
}
"""Fields of a body, and their tags in the plugin Hydrodynamics."""
OLD = "xUU yVV zWW kPP mQQ nRR"
"""Tags of quadratic damping before gz-sim 7."""
UUV = "uuv_underwater_object"
Known = dict[str, tuple[float, ...]]


def body_of(robot: Description, exchange: Exchange) -> Body:
    """Returns what the description says of the body at its centre of gravity. Raises LayoutError: a value is
    no number, or out of bounds."""
    known: Known = {}
    _keep(known, "added_mass", {axis: str(value) for axis, value in robot.added.items()}, exchange)
    water = [plugin for _, plugin in robot.plugins if is_plugin(plugin, "Hydrodynamics")]
    objects = [plugin for _, plugin in robot.plugins if UUV in plugin.get("filename", "")]
    models = [model for plugin in objects for model in plugin.findall("link/hydrodynamic_model")]
    for read, found, what in ((_of_gz, water, "Hydrodynamics"), (_of_uuv, models, "hydrodynamic_model")):
        for plugin in found[:1]:
            read(plugin, known, exchange)
        if len(found) > 1:
            exchange.note(f"It has {len(found)} plugins with {what}: the first was read.")
    if water or objects:
        exchange.note("Its buoyancy is not read: it is taken for the weight, at the centre of gravity.")
    moments: Vector | None = None
    if robot.inertia is None:
        exchange.note("A link with a mass has no inertia, so that of the body is unknown.")
    else:
        moments = vector(np.diag(robot.inertia))
        if np.abs(robot.inertia - np.diag(moments)).max() > 0.05 * max(moments):
            exchange.note("Products of inertia are left out.")
    values: dict[str, Any] = dict(known)
    return Body(mass_kg=robot.mass, inertia_kgm2=moments if moments and min(moments) > 0 else None, **values)


def _keep(known: Known, field: str, told: dict[str, str], exchange: Exchange) -> None:
    """Keeps the values of six tags where all are said."""
    values = numbers_in([*told.values()])
    if len(told) == 6 and values is not None:
        known[field] = tuple(np.abs(values).tolist())
        exchange.note(f"{field} was read from {', '.join(told)}.")
        wrong = [tag for tag, value in zip(told, values, strict=True) if value > 0 and tag not in ADDED]
        if wrong:
            exchange.note(
                f"{', '.join(wrong)} > 0, against the sign of a derivative: the magnitude is taken."
            )
    elif told:
        words = ", ".join(f"{tag} {value:.20}" for tag, value in told.items())
        why = "is not six numbers" if len(told) == 6 else "says these alone of six"
        exchange.note(f"{field} is left out: the file {why}: {words}.")


def _of_gz(plugin: Element, known: Known, exchange: Exchange) -> None:
    """Derivatives of the plugin of gz-sim."""
    read = {"link_name", "water_density"}
    for field, tags in (*DERIVATIVES.items(), ("quadratic_damping", OLD)):
        values = {tag: value for tag in tags.split() if (value := said(plugin, tag))}
        if field not in known or tags != OLD:
            _keep(known, field, values, exchange)
            read |= set(values)
    if len(read) == 2:
        exchange.note("Hydrodynamics holds no derivatives by known tags: added mass and damping are unknown.")
    others = dict.fromkeys(each.tag for each in plugin if each.tag not in read)
    if others:
        exchange.note(f"Not read of Hydrodynamics: {', '.join(others)[:300]}.")


def _of_uuv(model: Element, known: Known, exchange: Exchange) -> None:
    """A block of Fossen's model of uuv_simulator: six numbers, or the diagonal of 36."""
    kind = said(model, "type")
    for field in DERIVATIVES if kind == "fossen" else ():
        words = said(model, field).split()
        table = numbers_in(words) if len(words) == 36 else None
        if table is not None:
            words = words[::7]
            if np.count_nonzero(table) > np.count_nonzero(table[::7]):
                exchange.note(f"Of {field} the diagonal was read.")
        whole = {"all": " ".join(words)} if words else {}
        _keep(known, field, dict(zip(ADDED, words, strict=True)) if len(words) == 6 else whole, exchange)
    if kind != "fossen":
        exchange.note(f"hydrodynamic_model of type {kind!r:.40} is not read: the water's forces are unknown.")
    if said(model, "linear_damping_forward_speed"):
        exchange.note("linear_damping_forward_speed is not read.")
