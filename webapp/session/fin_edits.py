"""Changes of what a layout says of one fin. Each takes a fin, or a layout, and returns another one."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from finlab.errors import FinlabError
from finlab.layout import Fin, FinModelSpec, Layout
from finlab.layout.fin import FIN_MODELS
from webapp.session.state import chosen

QUANTITIES = ("amplitude", "frequency", "zero_direction")
FORMULAS = tuple(name for name, parameters in FIN_MODELS.items() if parameters)


def words(key: str) -> str:
    """A key of a layout file as people write it: `drag_coefficient` is Drag coefficient."""
    text = key.replace("_", " ")
    return text if len(text) <= 2 or text == "phi e" else text[0].upper() + text[1:]


def checked_name(layout: Layout, name: str, wanted: str) -> str:
    """A name that the fin called `name` may have, without outer spaces.

    Raises:
        FinlabError: another fin has it. Whether it is a name at all, the layout says.
    """
    stripped = wanted.strip()
    if stripped != name and stripped in layout.names:
        raise FinlabError(f"there is a fin {stripped!r:.70} already; give another name")
    return stripped


def with_fin(layout: Layout, name: str, fin: Fin) -> Layout:
    """The layout with another fin in the place of one of the same name."""
    fins = list(layout.fins)
    fins[layout.index(name)] = fin
    return replace(layout, actuators=tuple(fins))


def limited(fin: Fin, quantity: str, ends: Sequence[Any]) -> Fin:
    """The fin with other limits of a quantity: (least, greatest), radians and hertz.

    Raises:
        LayoutError: they are none, or in the wrong order.
    """
    chosen(quantity, "quantity", QUANTITIES)
    low, high = (float(end) if isinstance(end, int) else end for end in ends)
    return replace(fin, limits=replace(fin.limits, **{quantity: (low, high)}))


def modelled(fin: Fin, kind: str) -> Fin:
    """The fin with another kind of model; what both models know, such as the water's density, stays.

    Raises:
        FinlabError: there is no such model, or it needs a file.
    """
    if kind == fin.model.type:
        return fin
    if kind == "table":
        raise FinlabError(f"a table for {fin.name} comes from a file; drop its CSV, or fit measurements")
    chosen(kind, "fin model", FORMULAS)
    shared = tuple((key, value) for key, value in fin.model.parameters if key in FIN_MODELS[kind])
    return replace(fin, model=FinModelSpec(kind, shared))


def with_parameter(fin: Fin, key: str, value: Any) -> Fin:
    """The fin with another number in its model; as it is where its model has no such number.

    Raises:
        LayoutError: the value is none that the parameter may have.
    """
    rules = FIN_MODELS[fin.model.type]
    if key not in rules:
        return fin
    given = {**dict(fin.model.parameters), key: value}
    if math.isclose(value, rules[key].default, rel_tol=1e-12, abs_tol=0.0) or value == rules[key].default:
        del given[key]  # files say only what is not usual
    return replace(fin, model=FinModelSpec(fin.model.type, tuple(given.items())))
