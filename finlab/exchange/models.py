"""The models of a description: which is the robot, the parts of models inside it, and what is included."""

from collections.abc import Callable, Iterator
from typing import NamedTuple
from xml.etree.ElementTree import Element

from finlab.errors import LayoutError
from finlab.exchange.exchange import Exchange

Drives = Callable[[Element], bool]
"""Whether a plugin drives a thruster."""


class Parts(NamedTuple):
    """What one model and those inside it hold, each with the scope that goes before its names (`arm::`)."""

    named: dict[str, tuple[str, Element]]
    """Links, joints, frames and models inside by `link arm::NAME`."""
    plugins: list[tuple[str, Element]]
    included: list[str]
    """Names of what is included, and not read."""


def chosen(root: Element, drives: Drives, exchange: Exchange) -> Element:
    """Returns the model that is the robot: the one that the exchange names, or the first with thrusters.

    Raises:
        LayoutError: there is no model, none of that name, or the robot is included from another file.
    """
    models = (
        [root] if root.tag in ("robot", "model") else [*root.findall("model"), *root.findall("world/model")]
    )
    included = [*root.findall("include"), *root.findall("world/include")]
    names = [model.get("name", "") for model in models]
    if exchange.model is not None:
        if exchange.model not in names:
            raise LayoutError(f"has no model {exchange.model!r:.60}; it has {_listed(names)}")
        return models[names.index(exchange.model)]
    wanted = {*exchange.fins, *exchange.thrusters}
    robots = [model for model in models if _drives(model, drives) or wanted & {*_links(model)}]
    if not robots and included and not wanted:
        likely = [each for each in included if _drives(each, drives)] or included
        places = ", ".join(f"<include> {include_name(each)}" for each in likely)[:300]
        raise LayoutError(
            f"is a world of gz; the robot is in {places}, which is not opened: give its model.sdf"
        )
    if not models:
        raise LayoutError(f"expected a <robot> of URDF or a <model> of SDF, got <{root.tag:.40}>")
    top, *others = robots or models
    if others:
        kind = "robots" if robots else "models"
        told = _listed([model.get("name", "") for model in others])
        exchange.note(f"{top.get('name')} was read; it holds other {kind}: {told} (--model NAME).")
    return top


def parts_of(top: Element) -> Parts:
    """Returns the parts of a model and of those inside it.

    Raises:
        LayoutError: one has no name, or is placed by a frame of its own.
    """
    parts = Parts({}, [], [])
    waiting = [("", top)]
    while waiting:
        scope, model = waiting.pop()
        for tag in ("link", "joint", "frame", "model"):
            for part in model.findall(tag):
                name = name_of(part)
                parts.named[f"{tag} {scope}{name}"] = scope, part
                if tag == "model":
                    if part.get("placement_frame"):
                        raise LayoutError(f"model {name!r:.60} has a placement_frame, which is not read")
                    waiting.append((f"{scope}{name}::", part))
        for path in ("gazebo/plugin", "plugin", "link/plugin", "joint/plugin"):
            parts.plugins.extend((scope, plugin) for plugin in model.findall(path))
        parts.included.extend(f"{scope}{include_name(each)}" for each in model.findall("include"))
    return parts


def include_name(include: Element) -> str:
    """Returns what an <include> is called: its name, or the end of its address."""
    address = include.findtext("uri") or include.findtext("url") or "without a name"
    name = include.findtext("name") or address.strip().rstrip("/").rpartition("/")[2]
    return " ".join(name.split())[:60]


def name_of(element: Element) -> str:
    """Returns an element's name.

    Raises:
        LayoutError: it has none.
    """
    name = element.get("name")
    if not name:
        raise LayoutError(f"has a <{element.tag}> without a name")
    return name


def _drives(model: Element, drives: Drives) -> bool:
    return any(drives(plugin) for plugin in model.iter("plugin"))


def _links(model: Element) -> Iterator[str]:
    return (link.get("name", "") for link in model.findall("link"))


def _listed(names: list[str]) -> str:
    text = ", ".join(names)
    return text if len(text) < 300 else f"{text[:300].rpartition(',')[0]}, ... ({len(names)})"
