"""The models of a description: which is the robot, the parts of models inside it, and what is included."""

from collections.abc import Callable, Iterable
from xml.etree.ElementTree import Element

from finlab.errors import LayoutError
from finlab.exchange.exchange import Exchange

Drives = Callable[[Element], bool]
"""Whether a plugin drives a thruster."""
Named = dict[str, tuple[str, Element]]
"""Links, joints, frames and models inside by `link arm::NAME` and so on, with the scope `arm::` of names."""


def chosen(root: Element, drives: Drives, exchange: Exchange) -> Element:
    """Returns the model that is the robot: the one that the exchange names, or the first with thrusters.
    Raises LayoutError: there is no model, none of that name, or the robot is included from another file."""
    alone, wanted = root.tag in ("robot", "model"), {*exchange.fins, *exchange.thrusters}
    models = [root] if alone else [*root.findall("model"), *root.findall("world/model")]
    names = [model.get("name", "") for model in models]
    if exchange.model is not None:
        if exchange.model not in names:
            raise LayoutError(f"has no model {exchange.model!r:.60}; it has {listed(names)}")
        return models[names.index(exchange.model)]
    pushed = [model for model in models if any(map(drives, model.iter("plugin")))]
    robots = [
        each for each in models if each in pushed or wanted & {link.get("name") for link in each.iter("link")}
    ]
    included = [] if alone or robots or wanted else [*root.findall("include"), *root.findall("world/include")]
    if included:
        likely = [each for each in included if any(map(drives, each.iter("plugin")))] or included
        places = ", ".join(f"<include> {_include_name(each)}" for each in likely)[:300]
        raise LayoutError(
            f"is a world of gz; the robot is in {places}, which is not opened: give its model.sdf"
        )
    if not models:
        raise LayoutError(f"expected a <robot> of URDF or a <model> of SDF, got <{root.tag:.40}>")
    top, *others = robots or models
    if others:
        kind = "robots" if robots else "models"
        left = listed([model.get("name", "") for model in others])
        exchange.note(f"{top.get('name')} was read; it holds other {kind}: {left} (--model NAME).")
    return top


def parts_of(top: Element) -> tuple[Named, list[tuple[str, Element]], list[str]]:
    """Returns the parts of a model and of those inside it, its plugins with their scopes, and the names of
    what is included, which is not read. Raises LayoutError: one has no name, or is placed by a frame of its
    own."""
    named, plugins, included, waiting = Named(), list[tuple[str, Element]](), list[str](), [("", top)]
    while waiting:
        scope, model = waiting.pop()
        for part in (part for tag in ("link", "joint", "frame", "model") for part in model.findall(tag)):
            name = f"{scope}{part.get('name') or ''}"
            if name == scope or part.get("placement_frame"):
                raise LayoutError(f"has a <{part.tag}> without a name, or with a placement_frame")
            named[f"{part.tag} {name}"] = scope, part
            waiting += [(f"{name}::", part)] if part.tag == "model" else []
        for path in ("gazebo/plugin", "plugin", "link/plugin", "joint/plugin"):
            plugins += [(scope, plugin) for plugin in model.findall(path)]
        included += [f"{scope}{_include_name(each)}" for each in model.findall("include")]
    return named, plugins, included


def _include_name(include: Element) -> str:
    """What an <include> is called: its name, or the end of its address."""
    address = include.findtext("uri") or include.findtext("url") or "without a name"
    name = include.findtext("name") or address.strip().rstrip("/").rpartition("/")[2]
    return " ".join(name.split())[:60]


def listed(names: Iterable[str]) -> str:
    """Returns names as a sentence has them, the first of many."""
    text = ", ".join(names) or "none"
    return text if len(text) < 300 else f"{text[:300].rpartition(',')[0]}, ..."
