"""Who may talk to the server: pages that it served itself, and beyond this machine only with the token."""

import hmac
import secrets
from dataclasses import dataclass, field
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from urllib.parse import parse_qs, urlsplit

COOKIE = "finlab-token"
"""Cookie that carries the token once the page has been opened with it."""


def is_loopback(host: str) -> bool:
    """Whether an address can be reached from this machine only."""
    try:
        return host == "localhost" or ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Verdict:
    """What to answer a request that is not let through, or that brings the token along."""

    status: HTTPStatus
    """Status of the answer."""
    text: str
    """What to say."""
    headers: dict[str, str] = field(default_factory=dict)
    """Headers of the answer."""


@dataclass(frozen=True)
class Guard:
    """The rules of one server."""

    host: str
    """Address it listens on."""
    token: str | None = None
    """Secret that every browser must know; None where only this machine can connect."""

    @staticmethod
    def of(host: str) -> "Guard":
        """A guard for an address, with a fresh token where others could connect."""
        return Guard(host, None if is_loopback(host) else secrets.token_urlsafe(18))

    def check(self, path: str, headers: dict[str, str]) -> Verdict | None:
        """Look at a request; None lets it through.

        Args:
            path: path and query of the request.
            headers: its headers, names in lower case.
        """
        host, origin = headers.get("host", ""), headers.get("origin")
        if is_loopback(self.host) and not is_loopback(urlsplit(f"//{host}").hostname or ""):
            # Another site's name that was made to point at this machine.
            return Verdict(HTTPStatus.FORBIDDEN, "This server answers to localhost only.\n")
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return Verdict(HTTPStatus.FORBIDDEN, "Pages of other sites may not use this server.\n")
        if self.token is None:
            return None
        url = urlsplit(path)
        given = parse_qs(url.query).get("token", [""])[0]
        if self._is_token(given):
            cookie = f"{COOKIE}={self.token}; Path=/; HttpOnly; SameSite=Strict"
            return Verdict(HTTPStatus.SEE_OTHER, "", {"Location": url.path or "/", "Set-Cookie": cookie})
        if self._is_token(_cookie(headers.get("cookie", ""))):
            return None
        return Verdict(HTTPStatus.UNAUTHORIZED, "Open the address with the token that finlab app printed.\n")

    def _is_token(self, text: str) -> bool:
        return self.token is not None and hmac.compare_digest(text.encode(), self.token.encode())


def _cookie(text: str) -> str:
    try:
        found = SimpleCookie(text).get(COOKIE)
    except CookieError:
        return ""
    return "" if found is None else found.value
