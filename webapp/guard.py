"""Who may talk to the server: pages that it served itself, and beyond this machine only with the token."""

import hmac
import re
import secrets
from dataclasses import dataclass, field
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from urllib.parse import parse_qs

COOKIE = "finlab-token"
"""Cookie that carries the token once the page has been opened with it."""
LONGEST_PATH, LONGEST_QUERY = 200, 2_000
"""Most characters of a path, and of what follows it; the page itself has one."""
SECURE = {
    # The page is one file with its scripts inside; it evaluates those that the server sends, starts workers
    # from texts, and opens nothing elsewhere.
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob: data:; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
        "connect-src 'self' ws: wss: data: blob:; worker-src 'self' blob: data:; "
        "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
"""Headers of every answer: no other site may frame the page, and it loads nothing from one."""
_HOST = r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9_.-]+)(?::\d{1,5})?"
_ORIGIN = re.compile(rf"(?P<scheme>[a-z][a-z0-9+.-]*)://(?P<host>{_HOST})")
_HOST_ALONE = re.compile(_HOST)
_TARGET = re.compile(r"/(?:[!-$&-~]|%(?!00)[0-9A-Fa-f]{2})*")


def is_loopback(host: str) -> bool:
    """Whether an address can be reached from this machine only."""
    try:
        return host == "localhost" or ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Admission:
    """What to answer a request that is not let through, or that brings the token along."""

    status: HTTPStatus
    text: str
    headers: dict[str, str] = field(default_factory=dict)


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

    def check(self, path: str, headers: dict[str, str]) -> Admission | None:
        """Look at a request; None lets it through.

        Args:
            path: path and query of the request.
            headers: its headers, names in lower case.
        """
        refused = self._malformed(path, headers) or self._foreign(headers)
        if refused is not None or self.token is None:
            return refused
        given = parse_qs(path.partition("?")[2]).get("token", [""])[0]
        if self._is_token(given):
            cookie = f"{COOKIE}={self.token}; Path=/; HttpOnly; SameSite=Strict"
            return Admission(HTTPStatus.SEE_OTHER, "", {"Location": "/", "Set-Cookie": cookie})
        if self._is_token(_cookie(headers.get("cookie", ""))):
            return None
        sentence = "Open the address with the token that finlab app printed.\n"
        return Admission(HTTPStatus.UNAUTHORIZED, sentence)

    def _malformed(self, path: str, headers: dict[str, str]) -> Admission | None:
        """Why a request makes no sense."""
        place, _, query = path.partition("?")
        if len(place) > LONGEST_PATH or len(query) > LONGEST_QUERY:
            return Admission(HTTPStatus.REQUEST_URI_TOO_LONG, "The address is too long.\n")
        if not _TARGET.fullmatch(path):
            return Admission(HTTPStatus.BAD_REQUEST, "The address is malformed.\n")
        if not _HOST_ALONE.fullmatch(headers.get("host", "").lower()):
            return Admission(HTTPStatus.BAD_REQUEST, "The header Host is missing or malformed.\n")
        origin = headers.get("origin", "null").lower()
        if origin != "null" and not _ORIGIN.fullmatch(origin):
            return Admission(HTTPStatus.BAD_REQUEST, "The header Origin is malformed.\n")
        return None

    def _foreign(self, headers: dict[str, str]) -> Admission | None:
        """Why a request may not come from where it comes from; its headers are well formed."""
        host = headers["host"].lower()
        match, origin = _HOST_ALONE.fullmatch(host), headers.get("origin")
        if is_loopback(self.host) and not (match and is_loopback(match["name"])):
            # Another site's name that was made to point at this machine.
            return Admission(HTTPStatus.FORBIDDEN, "This server answers to localhost only.\n")
        if origin is not None and origin.lower().partition("://")[2] != host:
            return Admission(HTTPStatus.FORBIDDEN, "Pages of other sites may not use this server.\n")
        return None

    def _is_token(self, text: str) -> bool:
        return self.token is not None and hmac.compare_digest(
            text.encode(errors="replace"), self.token.encode()
        )


def _cookie(text: str) -> str:
    try:
        found = SimpleCookie(text).get(COOKIE)
    except CookieError:
        return ""
    return "" if found is None else found.value
