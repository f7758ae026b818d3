"""Reads XML of strangers, in linear time and without entities, and finds the robot in it."""

from collections.abc import Callable
from typing import NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from finlab.errors import LayoutError
from finlab.exchange.exchange import Exchange
from finlab.exchange.labels import listed
from finlab.exchange.questions import which_robot

MAX_DEPTH = 100
"""Deepest nesting of elements."""
MAX_ELEMENTS = 200_000
"""Most elements that are read."""
DrivesThruster = Callable[[Element], bool]
"""Whether a plugin drives a thruster."""


class ScopedElement(NamedTuple):
    """A link, joint, frame or model."""

    scope: str
    """The models around it inside the robot's, such as `arm::`; empty for none."""
    element: Element


Elements = dict[str, ScopedElement]
"""Links, joints, frames and models of a robot by keys such as `link arm::hand`."""


def root_of(text: str) -> Element:
    """Returns the outermost element of a text of XML.

    A prefix such as `gz:` is a part of a name and needs no declaration. Entities could pull in
    other files or grow without bound, and robot descriptions have no use for them; as the text is
    UTF-8 whatever its first line says, no other encoding can hide them.

    Raises:
        LayoutError: it is no XML, too deep or too large, or declares a DOCTYPE.
    """
    builder = TreeBuilder()
    parser = expat.ParserCreate()
    depth = 0
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth += 1
        count += 1
        if depth > MAX_DEPTH or count > MAX_ELEMENTS:
            raise LayoutError(
                f"holds over {MAX_ELEMENTS:,} elements of XML, or is deeper than {MAX_DEPTH}"
            )
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
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
    for element in root.iter():
        if element.tag.startswith("xacro:"):
            return True
        for text in (*element.attrib.values(), element.text or ""):
            if "${" in text or "$(" in text:
                return True
    return False


def robot_model(root: Element, drives_thruster: DrivesThruster, exchange: Exchange) -> Element:
    """Returns the model that is the robot.

    It is the one that the user names, or the first that has thrusters or links that the user names,
    or the first.

    Args:
        root: the outermost element.
        drives_thruster: whether a plugin drives a thruster.
        exchange: the user's names; gets a note on other models.

    Raises:
        LayoutError: there is no model, none of that name, or the robot is included from another
            file.
    """
    is_model = root.tag in ("robot", "model")
    links = {*exchange.fins, *exchange.thrusters}
    models = [root] if is_model else [*root.findall("model"), *root.findall("world/model")]
    names = [model.get("name", "") for model in models]
    if exchange.model is not None:
        if exchange.model not in names:
            raise LayoutError(f"has no model {exchange.model!r:.60}; it has {listed(names)}")
        return models[names.index(exchange.model)]

    def has_thrusters(element: Element) -> bool:
        return any(drives_thruster(plugin) for plugin in element.iter("plugin"))

    robots = []
    for model in models:
        if has_thrusters(model) or links & {link.get("name") for link in model.iter("link")}:
            robots.append(model)
    if not is_model and not robots and not links:
        includes = [*root.findall("include"), *root.findall("world/include")]
        if includes:
            likely = [include for include in includes if has_thrusters(include)] or includes
            shown = ", ".join(f"<include> {_include_name(include)}" for include in likely)[:300]
            raise LayoutError(
                f"is a world of gz; the robot is in {shown}, which is not opened: give its "
                "model.sdf"
            )
    if not models:
        raise LayoutError(f"expected a <robot> of URDF or a <model> of SDF, got <{root.tag:.40}>")
    robot, *unread = robots or models
    if unread:
        kind = "robots" if robots else "models"
        unread_names = listed([model.get("name", "") for model in unread])
        names = [model.get("name", "") for model in (robot, *unread)]
        exchange.note(
            f"{robot.get('name')} was read; it holds other {kind}: {unread_names}",
            "--model NAME for one of them",
            question=which_robot(names, kind),
        )
    return robot


def model_elements(robot: Element) -> tuple[Elements, list[tuple[str, Element]], list[str]]:
    """Returns the content of a robot's model and of the models inside it.

    Returns:
        Its links, joints, frames and models by key; its plugins with the scope of the names in
        each; and the names of what it includes from other files, which is not read.

    Raises:
        LayoutError: an element has no name, or is placed by a frame of its own.
    """
    elements = Elements()
    plugins: list[tuple[str, Element]] = []
    included: list[str] = []
    stack = [("", robot)]
    while stack:
        scope, model = stack.pop()
        for tag in ("link", "joint", "frame", "model"):
            for element in model.findall(tag):
                name = f"{scope}{element.get('name') or ''}"
                if name == scope or element.get("placement_frame"):
                    raise LayoutError(f"has a <{tag}> without a name, or with a placement_frame")
                elements[f"{tag} {name}"] = ScopedElement(scope, element)
                if tag == "model":
                    stack.append((f"{name}::", element))
        for path in ("gazebo/plugin", "plugin", "link/plugin", "joint/plugin"):
            plugins += [(scope, plugin) for plugin in model.findall(path)]
        included += [f"{scope}{_include_name(include)}" for include in model.findall("include")]
    return elements, plugins, included


def _include_name(include: Element) -> str:
    """The name of an <include>, or the last part of its address."""
    address = include.findtext("uri") or include.findtext("url") or "without a name"
    name = include.findtext("name") or address.strip().rstrip("/").rpartition("/")[2]
    return " ".join(name.split())[:60]
