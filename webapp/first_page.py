"""What a browser is sent first: viser's page with our name and icon, and without its panel."""

import gzip
from functools import cache
from importlib.resources import files

from websockets.http11 import Response


def name_page(answer: Response) -> Response:
    """Let an answer of viser's bring our first page, if it is a page at all."""
    if answer.headers.get("Content-Type", "").startswith("text/html"):
        answer.body = _named(bytes(answer.body), answer.headers.get("Content-Encoding") == "gzip")
        del answer.headers["Content-Length"]
        answer.headers["Content-Length"] = str(len(answer.body))
    return answer


@cache
def _named(body: bytes, zipped: bool) -> bytes:
    ours = files("webapp.markup").joinpath("first_page.html").read_bytes()
    plain = gzip.decompress(body) if zipped else body
    plain = plain.replace(b'rel="icon"', b'rel="alternate"', 1).replace(b"<title>Viser</title>", ours, 1)
    return gzip.compress(plain) if zipped else plain
