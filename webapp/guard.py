"""The guard of the server: it lets in pages of its own, from beyond this machine only with the
token."""

import hmac
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from types import MappingProxyType
from urllib.parse import parse_qs, urlencode, urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Response

COOKIE = "finlab-token"
"""Cookie that carries the token once the page has been opened with it."""
SECURE = {
    # The page is one file with its scripts inside; it evaluates those that the server sends, starts
    # workers from texts, and opens nothing elsewhere.
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob: data:; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
        "connect-src 'self' ws: wss: data: blob:; worker-src 'self' blob: data:; object-src "
        "'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
"""Headers of every answer: no other site may frame the page, and it loads nothing from one."""


def is_loopback(host: str) -> bool:
    """Whether an address can be reached from this machine only."""
    try:
        return host == "localhost" or ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Guard:
    """The rules of one server."""

    host: str
    token: str | None = None
    """Secret that every browser must know; None where only this machine can connect."""

    @staticmethod
    def of(host: str) -> "Guard":
        """A guard for an address, with a fresh token where others could connect."""
        return Guard(host, None if is_loopback(host) else secrets.token_urlsafe(18))

    def check(self, path: str, headers: dict[str, str]) -> Response | None:
        """What to answer a request that is not let through, or that brings the token along; else
        None. `path` has the query, `headers` names in lower case."""
        host = headers.get("host", "").lower()
        origin = headers.get("origin")
        if is_loopback(self.host) and not is_loopback(_name(host)):
            # Another site's name that was made to point at this machine.
            return answer(HTTPStatus.FORBIDDEN, "This server answers to localhost only.\n")
        if origin is not None and origin.lower().partition("://")[2] != host:
            return answer(HTTPStatus.FORBIDDEN, "Pages of other sites may not use this server.\n")
        if self.token is None:
            return None
        query = parse_qs(path.partition("?")[2])
        if self._is_token(query.pop("token", [""])[0]):
            cookie = f"{COOKIE}={self.token}; Path=/; HttpOnly; SameSite=Strict"
            rest = urlencode(query, doseq=True)
            place = f"/?{rest}" if rest else "/"
            return answer(HTTPStatus.SEE_OTHER, "", {"Location": place, "Set-Cookie": cookie})
        if self._is_token(_cookie(headers.get("cookie", ""))):
            return None
        return answer(
            HTTPStatus.UNAUTHORIZED, "Open the address with the token that finlab app printed.\n"
        )

    def _is_token(self, text: str) -> bool:
        return self.token is not None and hmac.compare_digest(
            text.encode(errors="replace"), self.token.encode()
        )


def answer(
    status: HTTPStatus, text: str, headers: Mapping[str, str] = MappingProxyType({})
) -> Response:
    """A page of plain text."""
    body = text.encode()
    own = {"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body)), **headers}
    return Response(status.value, status.phrase, Headers({**own, "Connection": "close"}), body)


def _name(host: str) -> str:
    """The name in a header Host, without the port; empty where there is none."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _cookie(text: str) -> str:
    try:
        morsel = SimpleCookie(text).get(COOKIE)
    except CookieError:
        return ""
    return "" if morsel is None else morsel.value
