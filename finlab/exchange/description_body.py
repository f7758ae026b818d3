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
OLD = "xUU yVV zWW kPP mQQ nRR".split()  # noqa: SIM905
"""Tags of quadratic damping before gz-sim 7."""
UUV = "uuv_underwater_object"
Known = dict[str, tuple[float, ...]]


def body_of(robot: Description, exchange: Exchange) -> Body:
    """Returns what the description says of the body at its centre of gravity.

    Raises:
        LayoutError: a value is no number, or out of bounds.
    """
    known: Known = {}
    _keep(known, "added_mass", {axis: str(value) for axis, value in robot.added.items()}, ADDED, exchange)
    water = [plugin for _, plugin in robot.plugins if is_plugin(plugin, "Hydrodynamics")]
    objects = [plugin for _, plugin in robot.plugins if UUV in plugin.get("filename", "")]
    for plugin in water[:1]:
        _of_gz(plugin, known, exchange)
    models = [
        link
        for plugin in objects
        for link in plugin.findall("link")
        if link.find("hydrodynamic_model") is not None
    ]
    for link in models[:1]:
        _of_uuv(link, known, exchange)
    for more, what in ((water[1:], "Hydrodynamics"), (models[1:], "hydrodynamic_model")):
        if more:
            exchange.note(f"It has {len(more) + 1} plugins with {what}: the first was read.")
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


def _keep(known: Known, field: str, told: dict[str, str], tags: Any, exchange: Exchange) -> None:
    """Keeps six values where all are said."""
    values = numbers_in([told[tag] for tag in tags if tag in told])
    if len(told) == 6 and values is not None:
        known[field] = tuple(np.abs(values).tolist())
        exchange.note(f"{field} was read from {', '.join(tags)}.")
        wrong = [
            tag
            for tag, value in zip(tags, values, strict=True)
            if value > 0 and tag[0] in "xyzkmn" and tag not in ADDED
        ]
        if wrong:
            exchange.note(
                f"{', '.join(wrong)} > 0, against the sign of a derivative: the magnitude is taken."
            )
    elif told:
        words = ", ".join(f"{tag} {told[tag]:.20}" for tag in tags if tag in told)
        why = "is not six numbers" if len(told) == 6 else "says these alone of six"
        exchange.note(f"{field} is left out: the file {why}: {words}.")


def _of_gz(plugin: Element, known: Known, exchange: Exchange) -> None:
    """Derivatives of the plugin of gz-sim."""
    read = set()
    for field, text in DERIVATIVES.items():
        tags = text.split()
        if field == "quadratic_damping" and not any(said(plugin, tag) for tag in tags):
            tags = OLD
        told = {tag: value for tag in tags if (value := said(plugin, tag))}
        read |= set(told)
        _keep(known, field, told, tags, exchange)
    if not read:
        exchange.note("Hydrodynamics holds no derivatives by known tags: added mass and damping are unknown.")
    others = [
        each.tag for each in plugin if each.tag not in read and each.tag not in ("link_name", "water_density")
    ]
    if others:
        exchange.note(f"Not read of Hydrodynamics: {', '.join(dict.fromkeys(others))[:300]}.")


def _of_uuv(link: Element, known: Known, exchange: Exchange) -> None:
    """A block of Fossen's model of uuv_simulator: six numbers, or the diagonal of 36."""
    kind = said(link, "hydrodynamic_model/type")
    if kind != "fossen":
        exchange.note(
            f"hydrodynamic_model of type {kind!r:.40} is not read: added mass and damping are unknown."
        )
        return
    for field in DERIVATIVES:
        words = said(link, f"hydrodynamic_model/{field}").split()
        if not words:
            continue
        if len(words) == 36:
            whole = numbers_in(words)
            if whole is not None and np.abs(whole.reshape(6, 6) - np.diag(whole[::7])).max() > 0:
                exchange.note(f"Of {field} the diagonal was read.")
            words = words[::7]
        _keep(
            known,
            field,
            dict(zip(ADDED, words, strict=False)) if len(words) == 6 else {"all": " ".join(words)},
            ADDED,
            exchange,
        )
    if said(link, "hydrodynamic_model/linear_damping_forward_speed"):
        exchange.note("linear_damping_forward_speed is not read.")
