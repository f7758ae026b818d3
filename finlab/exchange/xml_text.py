"""XML of strangers: elements by their names as written, in linear time, without entities; and xacro."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from finlab.errors import LayoutError

MAX_DEPTH, MAX_ELEMENTS = 100, 200_000
"""Deepest nesting and most elements that are read."""
SECONDS, BYTES = 20, 1_000_000_000
"""Most time and memory that it may take."""
_PROGRAM = f"import resource, xacro; resource.setrlimit(resource.RLIMIT_AS, ({BYTES},) * 2); xacro.main()"


def root_of(text: str) -> Element:
    """Returns the outermost element; a prefix such as `gz:` is a part of a name and needs no declaration.

    Entities could pull in other files or grow without bound, and robot descriptions have no use for them; as
    the text is UTF-8 whatever its first line says, no other encoding can hide them. Raises LayoutError: it is
    no XML, too deep or too large, or declares a DOCTYPE."""
    builder, parser, opened = TreeBuilder(), expat.ParserCreate(), [0, 0]

    def start(tag: str, attributes: dict[str, str]) -> None:
        opened[:] = opened[0] + 1, opened[1] + 1
        if opened[0] > MAX_DEPTH or opened[1] > MAX_ELEMENTS:
            raise LayoutError(f"holds over {MAX_ELEMENTS:,} elements of XML, or is deeper than {MAX_DEPTH}")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        opened[0] -= 1
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
    texts = (text for each in root.iter() for text in (*each.attrib.values(), each.text or ""))
    return any(each.tag.startswith("xacro:") for each in root.iter()) or any(
        "${" in text or "$(" in text for text in texts
    )


def expanded(path: Path | None) -> str:
    """Returns the text that xacro makes of a file. Raises LayoutError: xacro is not installed, or refuses the
    file; or it came without a path, from a browser: expanding opens other files."""
    if path is None or find_spec("xacro") is None:
        why = "`finlab layout convert` expands it" if path is None else "pip install finlab-marine[xacro]"
        raise LayoutError(f"is a xacro file, not a description; run `xacro FILE > robot.urdf` first ({why})")
    command = [sys.executable, "-c", _PROGRAM, str(path.absolute())]
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        raise LayoutError(f"is a xacro file that takes over {SECONDS} s to expand") from None
    if done.returncode:
        words = done.stderr.decode(errors="replace").split()
        raise LayoutError(f"is a xacro file that xacro refuses: {' '.join(words)[:300] or 'it says nothing'}")
    return done.stdout.decode(errors="replace")
