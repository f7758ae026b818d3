"""The body of a robot description: mass, inertia, added mass and damping.

Added mass and damping come from SDF's <fluid_added_mass>, gz-sim's plugin Hydrodynamics, or the
underwater object of uuv_simulator. Derivatives after Fossen are negative, and a body has their
magnitudes. What a description does not say stays unknown.
"""

from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from finlab.exchange.description import ADDED_MASS_TAGS, Description, text_at
from finlab.exchange.exchange import Exchange, vector
from finlab.exchange.labels import numbers_in
from finlab.exchange.thruster_plugins import is_gz_plugin
from finlab.layout import Body

DERIVATIVES = {
    "added_mass": "xDotU yDotV zDotW kDotP mDotQ nDotR",
    "linear_damping": "xU yV zW kP mQ nR",
    "quadratic_damping": "xUabsU yVabsV zWabsW kPabsP mQabsQ nRabsR",
}
"""Fields of a body, and their tags in the plugin Hydrodynamics."""
OLD_QUADRATIC_TAGS = "xUU yVV zWW kPP mQQ nRR"
"""Tags of quadratic damping before gz-sim 7."""
UUV_OBJECT = "uuv_underwater_object"
"""A part of the file name of uuv_simulator's plugin for a body in water."""
PRODUCT_SHARE = 0.05
"""Products of inertia above this share of the largest moment are named in a note."""
Fields = dict[str, tuple[float, ...]]
"""Fields of a body by name, six values each."""


def body_of(description: Description, exchange: Exchange) -> Body:
    """Returns what a description says of the body, at its centre of gravity.

    Args:
        description: the description.
        exchange: gets the notes.

    Raises:
        LayoutError: a value is no number, or out of bounds.
    """
    fields: Fields = {}
    added_mass = {tag: str(value) for tag, value in description.added_mass.items()}
    _read_field(fields, "added_mass", added_mass, exchange)
    hydrodynamics = []
    uuv_objects = []
    for _, plugin in description.plugins:
        if is_gz_plugin(plugin, "Hydrodynamics"):
            hydrodynamics.append(plugin)
        if UUV_OBJECT in plugin.get("filename", ""):
            uuv_objects.append(plugin)
    uuv_models = []
    for plugin in uuv_objects:
        uuv_models += plugin.findall("link/hydrodynamic_model")
    if hydrodynamics:
        _read_gz(hydrodynamics[0], fields, exchange)
    _note_several(hydrodynamics, "Hydrodynamics", exchange)
    if uuv_models:
        _read_uuv(uuv_models[0], fields, exchange)
    _note_several(uuv_models, "hydrodynamic_model", exchange)
    if hydrodynamics or uuv_objects:
        exchange.note(
            "Its buoyancy is not read: it is taken for the weight, at the centre of gravity.",
            field="body.buoyancy_n",
        )
    moments = None
    if description.inertia is None:
        exchange.note(
            "A link with a mass has no inertia, so that of the body is unknown.",
            field="body.inertia_kgm2",
        )
    else:
        moments = vector(np.diag(description.inertia))
        products = np.abs(description.inertia - np.diag(moments))
        if products.max() > PRODUCT_SHARE * max(moments):
            exchange.note("Products of inertia are left out.")
        if min(moments) <= 0:
            moments = None
    values: dict[str, Any] = dict(fields)
    return Body(mass_kg=description.mass, inertia_kgm2=moments, **values)


def _note_several(plugins: list[Element], what: str, exchange: Exchange) -> None:
    if len(plugins) > 1:
        exchange.note(f"It has {len(plugins)} plugins with {what}: the first was read.")


def _read_field(fields: Fields, field: str, values: dict[str, str], exchange: Exchange) -> None:
    """Adds a field of six values by tag, or notes why it is left out."""
    if not values:
        return
    numbers = numbers_in([*values.values()])
    if len(values) == 6 and numbers is not None:
        fields[field] = tuple(np.abs(numbers).tolist())
        exchange.note(f"{field} was read from {', '.join(values)}.")
        positive = [
            tag
            for tag, value in zip(values, numbers, strict=True)
            if value > 0 and tag not in ADDED_MASS_TAGS
        ]
        if positive:
            why = "against the sign of a derivative: the magnitude is taken"
            exchange.note(f"{', '.join(positive)} > 0, {why}.")
    else:
        words = ", ".join(f"{tag} {value:.20}" for tag, value in values.items())
        why = "is not six numbers" if len(values) == 6 else "says these alone of six"
        exchange.note(f"{field} is left out: the file {why}: {words}.", field=f"body.{field}")


def _read_gz(plugin: Element, fields: Fields, exchange: Exchange) -> None:
    """Adds the fields in a plugin Hydrodynamics of gz-sim."""
    no_derivatives = {"link_name", "water_density"}
    tags_read = {*no_derivatives}
    for field, tags in (*DERIVATIVES.items(), ("quadratic_damping", OLD_QUADRATIC_TAGS)):
        if field in fields and tags == OLD_QUADRATIC_TAGS:
            continue
        texts = {tag: text_at(plugin, tag) for tag in tags.split()}
        values = {tag: text for tag, text in texts.items() if text}
        _read_field(fields, field, values, exchange)
        tags_read |= set(values)
    if tags_read == no_derivatives:
        exchange.note(
            "Hydrodynamics holds no derivatives by known tags: added mass and damping are unknown.",
            field="body.added_mass",
        )
    unread = dict.fromkeys(child.tag for child in plugin if child.tag not in tags_read)
    if unread:
        exchange.note(f"Not read of Hydrodynamics: {', '.join(unread)[:300]}.")


def _read_uuv(model: Element, fields: Fields, exchange: Exchange) -> None:
    """Adds the fields in a block of Fossen's model of uuv_simulator: six numbers each, or the
    diagonal of 36."""
    kind = text_at(model, "type")
    if kind == "fossen":
        for field in DERIVATIVES:
            words = text_at(model, field).split()
            matrix = numbers_in(words) if len(words) == 36 else None
            if matrix is not None:
                words = words[::7]
                if np.count_nonzero(matrix) > np.count_nonzero(matrix[::7]):
                    exchange.note(f"Of {field} the diagonal was read.")
            if len(words) == 6:
                values = dict(zip(ADDED_MASS_TAGS, words, strict=True))
            else:
                values = {"all": " ".join(words)} if words else {}
            _read_field(fields, field, values, exchange)
    else:
        exchange.note(
            f"hydrodynamic_model of type {kind!r:.40} is not read: the water's forces are unknown.",
            field="body.added_mass",
        )
    if text_at(model, "linear_damping_forward_speed"):
        exchange.note("linear_damping_forward_speed is not read.")
