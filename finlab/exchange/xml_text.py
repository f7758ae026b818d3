"""XML of strangers: elements by their names as written, in linear time, without entities."""

from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from finlab.errors import LayoutError

MAX_DEPTH = 100
"""Deepest nesting that is read."""
MAX_ELEMENTS = 200_000
"""Most elements that are read."""


def root_of(text: str) -> Element:
    """Returns the outermost element; a prefix such as `gz:` is a part of a name and needs no declaration.

    Entities could pull in other files or grow without bound, and robot descriptions have no use for them; as
    the text is UTF-8 whatever its first line says, no other encoding can hide them. Raises LayoutError: it is
    no XML, too deep or too large, or declares a DOCTYPE."""
    builder, parser = TreeBuilder(), expat.ParserCreate()
    depth = count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_DEPTH or count > MAX_ELEMENTS:
            what = (
                f"is nested deeper than {MAX_DEPTH}" if depth > MAX_DEPTH else f"holds over {MAX_ELEMENTS:,}"
            )
            raise LayoutError(f"{what} elements of XML, too many to be read")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def doctype(*_: object) -> None:
        raise LayoutError("declares a DOCTYPE or entities, which are not allowed; remove them")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.buffer_text = builder.data, True
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(text.lstrip(), True)
        return builder.close()
    except (expat.ExpatError, ValueError, AssertionError) as error:
        raise LayoutError(f"is not readable XML: {str(error)[:120]}") from None


def is_xacro(root: Element) -> bool:
    """Whether a description needs xacro: it has its tags, or `${...}` or `$(...)` in a value."""
    for element in root.iter():
        texts = (*element.attrib.values(), element.text or "")
        if element.tag.startswith("xacro:") or any("${" in text or "$(" in text for text in texts):
            return True
    return False
