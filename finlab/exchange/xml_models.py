"""XML of strangers, read in linear time and without entities, and which model in it is the
robot."""

from collections.abc import Callable
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from finlab.errors import LayoutError
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import listed

MAX_DEPTH, MAX_ELEMENTS = 100, 200_000
"""Deepest nesting and most elements that are read."""
Drives = Callable[[Element], bool]
"""Whether a plugin drives a thruster."""
Named = dict[str, tuple[str, Element]]
"""Links, joints, frames and models inside by `link arm::NAME` and so on, with the scope `arm::` of
names."""


def root_of(text: str) -> Element:
    """Returns the outermost element; a prefix such as `gz:` is a part of a name and needs no
    declaration.

    Entities could pull in other files or grow without bound, and robot descriptions have no use for
    them; as the text is UTF-8 whatever its first line says, no other encoding can hide them. Raises
    LayoutError: it is no XML, too deep or too large, or declares a DOCTYPE."""
    builder = TreeBuilder()
    parser = expat.ParserCreate()
    opened = [0, 0]

    def start(tag: str, attributes: dict[str, str]) -> None:
        opened[:] = opened[0] + 1, opened[1] + 1
        if opened[0] > MAX_DEPTH or opened[1] > MAX_ELEMENTS:
            raise LayoutError(
                f"holds over {MAX_ELEMENTS:,} elements of XML, or is deeper than {MAX_DEPTH}"
            )
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        opened[0] -= 1
        builder.end(tag)

    def doctype(*_: object) -> None:
        raise LayoutError("declares a DOCTYPE or entities, which are not allowed; remove them")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = builder.data
    parser.buffer_text = True
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(text.lstrip(), True)
        return builder.close()
    except (expat.ExpatError, ValueError, AssertionError) as error:
        raise LayoutError(f"is not readable XML: {str(error)[:120]}") from None


def is_xacro(root: Element) -> bool:
    """Whether a description needs xacro: it has its tags, or `${...}` or `$(...)` in a value."""
    texts = (text for each in root.iter() for text in (*each.attrib.values(), each.text or ""))
    return any(each.tag.startswith("xacro:") for each in root.iter()) or any(
        "${" in text or "$(" in text for text in texts
    )


def chosen(root: Element, drives: Drives, exchange: Exchange) -> Element:
    """Returns the model that is the robot: the one that the exchange names, or the first with
    thrusters. Raises LayoutError: there is no model, none of that name, or the robot is included
    from another file."""
    alone = root.tag in ("robot", "model")
    wanted = {*exchange.fins, *exchange.thrusters}
    models = [root] if alone else [*root.findall("model"), *root.findall("world/model")]
    names = [model.get("name", "") for model in models]
    if exchange.model is not None:
        if exchange.model not in names:
            raise LayoutError(f"has no model {exchange.model!r:.60}; it has {listed(names)}")
        return models[names.index(exchange.model)]
    pushed = [model for model in models if any(map(drives, model.iter("plugin")))]
    robots = [
        each
        for each in models
        if each in pushed or wanted & {link.get("name") for link in each.iter("link")}
    ]
    included = (
        []
        if alone or robots or wanted
        else [*root.findall("include"), *root.findall("world/include")]
    )
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
    """Returns the parts of a model and of those inside it, its plugins with their scopes, and the
    names of what is included, which is not read. Raises LayoutError: one has no name, or is placed
    by a frame of its own."""
    named = Named()
    plugins = list[tuple[str, Element]]()
    included = list[str]()
    waiting = [("", top)]
    while waiting:
        scope, model = waiting.pop()
        for part in (
            part for tag in ("link", "joint", "frame", "model") for part in model.findall(tag)
        ):
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
