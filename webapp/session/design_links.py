"""A design in a link: its layout's file, compressed, as text that stands behind the # of an address.

Browsers do not send that part to a server, so a link shows a design to whoever opens it, and not to the
way. What comes out of a link is treated like any file that a browser sends.
"""

import base64
import binascii
import zlib

from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.load import MAX_BYTES
from webapp.session.companions import Opened
from webapp.session.files import layout_file, read_layout

FRAGMENT = "design="
"""What the part behind the # begins with."""
MAX_LINK = 16_000
"""Most characters of a design in a link; chats and mail programs cut longer ones."""
PLAIN, ARCHIVE = "y", "a"
"""First character: a layout's YAML, compressed, or a ZIP archive with the files that it names."""
NO_DESIGN = "the link holds no whole design; copy all of it, or ask for the file"


def packed(layout: Layout, most: int = MAX_LINK) -> str:
    """A whole design as text of letters, digits, `-` and `_`.

    Raises:
        FinlabError: it is longer than `most` characters, or a file of it cannot be read.
    """
    name, content = layout_file(layout)
    is_archive = name.endswith(".zip")
    data = content if is_archive else zlib.compress(content, 9)
    text = (ARCHIVE if is_archive else PLAIN) + base64.urlsafe_b64encode(data).decode().rstrip("=")
    if len(text) > most:
        files, kind = (" with its files", "ZIP") if is_archive else ("", "file")
        raise FinlabError(
            f"{layout.name}{files} needs {len(text):,} characters, a link carries {most:,}; save it, "
            f"and share the {kind}"
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
        if kind == PLAIN:
            unpacking = zlib.decompressobj()
            data = unpacking.decompress(data, MAX_BYTES + 1)  # a small text may stand for a huge one
            if len(data) <= MAX_BYTES and not unpacking.eof:
                raise zlib.error("cut off")
    except (binascii.Error, ValueError, zlib.error):
        kind = ""
    if kind not in (PLAIN, ARCHIVE) or not kind:
        raise FinlabError(NO_DESIGN)
    return read_layout("link.yaml" if kind == PLAIN else "link.zip", data)
