"""A design in a link: its layout's file, compressed, as text that stands behind the # of an address.

Browsers do not send that part to a server, so a link shows a design to whoever opens it, and to nobody on the
way. What comes out of a link is treated like any file that a browser sends.
"""

import base64
import binascii
import io
import json
import zipfile
import zlib
from typing import NamedTuple

from finlab.errors import DataError, FinlabError
from finlab.files.plain_values import parse_json
from finlab.files.schema import checked
from finlab.layout import Layout
from finlab.layout.load import MAX_BYTES
from webapp.session.companions import Opened, archive_of
from webapp.session.files import layout_file, read_layout
from webapp.session.rounded_tables import LEVELS, accuracy, rounded, written

FRAGMENT = "design="
"""What the part behind the # begins with."""
MAX_LINK = 16_000
"""Most characters of a design in a link; chats and mail programs cut longer ones."""
PLAIN, ARCHIVE, ROUNDED = "y", "a", "r"
"""First character: a layout's YAML, compressed; a ZIP archive with the files that it names; or the files
one after another with their tables rounded, compressed together."""
TABLE = ".csv"
"""How the name of a force table ends."""
NO_DESIGN = "the link holds no whole design; copy all of it, or ask for the file"


class Link(NamedTuple):
    """A design as it travels."""

    text: str
    """Letters, digits, `-` and `_`."""
    rounded: str = ""
    """What is not whole in it, a sentence; nothing where all is."""


def linked(layout: Layout) -> Link:
    """A design in a link: whole where that fits, else with its tables rounded.

    Raises:
        FinlabError: it is too large even so, or a file of it cannot be read.
    """
    name, content = layout_file(layout)
    whole = _coded(name, content)
    if len(whole) <= MAX_LINK:
        return Link(whole)
    parts = _parts(content) if name.endswith(".zip") else {}
    if not any(part.endswith(TABLE) for part in parts):
        raise FinlabError(_too_large(layout, len(whole), " with its hull" if parts else ""))
    for levels in LEVELS:
        joined = _joined(parts, levels)
        text = ROUNDED + _letters(zlib.compress(joined, 9))
        if len(text) <= MAX_LINK and len(joined) <= MAX_BYTES:  # nobody unpacks more
            return Link(
                text,
                f"Its measured fins are rounded, to {accuracy(levels)} of their largest force, and come "
                "without the uncertainties of the fit; Save keeps them whole.",
            )
    raise FinlabError(_too_large(layout, len(text), " with its tables, even rounded,"))


def packed(layout: Layout, most: int = MAX_LINK) -> str:
    """A whole design as text of letters, digits, `-` and `_`.

    Raises:
        FinlabError: it is longer than `most` characters, or a file of it cannot be read.
    """
    name, content = layout_file(layout)
    text = _coded(name, content)
    if len(text) > most:
        raise FinlabError(
            _too_large(layout, len(text), " with its files" if name.endswith(".zip") else "", most)
        )
    return text


def unpacked(text: str) -> Opened:
    """The design in a link, checked like an upload; it may be anything.

    Raises:
        FinlabError: it holds no design, or a wrong one.
    """
    kind, coded = text[:1], text[1:]
    try:
        data = base64.b64decode(coded + "=" * (-len(coded) % 4), altchars=b"-_", validate=True)
        if kind in (PLAIN, ROUNDED):
            unpacking = zlib.decompressobj()
            data = unpacking.decompress(data, MAX_BYTES + 1)  # a small text may stand for a huge one
            if len(data) <= MAX_BYTES and not unpacking.eof:
                raise zlib.error("cut off")
        if kind == ROUNDED:
            data = _apart(data)
    except (binascii.Error, ValueError, zlib.error):
        kind = ""
    if kind not in (PLAIN, ARCHIVE, ROUNDED) or not kind:
        raise FinlabError(NO_DESIGN)
    return read_layout("link.yaml" if kind == PLAIN else "link.zip", data)


def _letters(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


def _coded(name: str, content: bytes) -> str:
    if name.endswith(".zip"):
        return ARCHIVE + _letters(content)
    return PLAIN + _letters(zlib.compress(content, 9))


def _parts(content: bytes) -> dict[str, bytes]:
    """Contents of an archive of our own, the layout's file first."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _joined(parts: dict[str, bytes], levels: int) -> bytes:
    """Files behind a line of JSON that lists their names and sizes; tables are rounded."""
    contents = {n: rounded(part, n, levels) if n.endswith(TABLE) else part for n, part in parts.items()}
    sizes = json.dumps([[name, len(part)] for name, part in contents.items()], separators=(",", ":"))
    return sizes.encode() + b"\n" + b"".join(contents.values())


def _apart(data: bytes) -> bytes:
    """The archive of files that were joined; the line of JSON may say anything.

    Raises:
        ValueError: it does not list what is there.
        DataError: the same, or a table is none.
    """
    head, _, rest = data.partition(b"\n")
    parts = {}
    listed = checked(parse_json(head.decode(), "link"), list[tuple[str, int]], DataError, "link")
    for name, size in listed:
        if not 0 <= size <= len(rest) or name in parts:
            raise ValueError(name)
        part, rest = rest[:size], rest[size:]
        parts[name] = written(part, name[-60:]) if name.endswith(TABLE) else part
    (name, document), *others = parts.items()
    return archive_of(name, document, dict(others))


def _too_large(layout: Layout, size: int, files: str, most: int = MAX_LINK) -> str:
    return (
        f"{layout.name}{files} needs {size:,} characters, a link carries {most:,}; save it, "
        f"and share the {'ZIP' if files else 'file'}"
    )
