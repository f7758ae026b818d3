"""Foreign origins and strangers stay out."""

import http.client

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from webapp.guard import COOKIE, Guard, is_loopback
from webapp.viser_internals import start_server, stop_server

OWN = {"host": "localhost:8080"}


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "[::1]", "127.8.8.8"])
def test_loopback_needs_no_token(host: str) -> None:
    assert is_loopback(host) and Guard.of(host).token is None


def test_foreign_origin_and_foreign_host_are_refused() -> None:
    guard = Guard.of("127.0.0.1")
    assert guard.check("/", OWN) is None
    assert guard.check("/", {**OWN, "origin": "http://localhost:8080"}) is None
    for origin in (
        "https://evil.example",
        "http://localhost:9999",
        "null",
        "http://localhost:8080.evil.example",
    ):
        refused = guard.check("/", {**OWN, "origin": origin})
        assert refused is not None and refused.status_code == 403
    rebound = guard.check("/", {"host": "evil.example:8080", "origin": "http://evil.example:8080"})
    assert rebound is not None and rebound.status_code == 403


def test_token_is_asked_for_beyond_this_machine() -> None:
    guard = Guard.of("0.0.0.0")
    assert guard.token is not None and len(guard.token) >= 24
    headers = {"host": "robot.local:8080"}
    for path, cookie in (
        ("/", ""),
        ("/?token=", ""),
        ("/?token=wrong", ""),
        ("/", f"{COOKIE}=wrong"),
        ("/", "=;="),
    ):
        refused = guard.check(path, {**headers, "cookie": cookie})
        assert refused is not None and refused.status_code == 401
    opened = guard.check(f"/?token={guard.token}", headers)
    assert opened is not None and opened.status_code == 303 and guard.token in opened.headers["Set-Cookie"]
    assert guard.check("/", {**headers, "cookie": f"{COOKIE}={guard.token}"}) is None


def test_real_server_refuses_before_anything_is_shown() -> None:
    server = start_server(Guard("127.0.0.1", "secret-token"), 0)
    try:
        port = server.get_port()

        def get(path: str, **headers: str) -> http.client.HTTPResponse:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
            connection.request("GET", path, headers=headers)
            return connection.getresponse()

        assert get("/").status == 401
        opened = get("/?token=secret-token")
        assert opened.status == 303
        cookie = str(opened.getheader("Set-Cookie")).split(";")[0]
        assert get("/", Cookie=cookie).status == 200
        url = f"ws://127.0.0.1:{port}"
        for headers in ({}, {"Cookie": cookie, "Origin": "https://evil.example"}):
            with pytest.raises(InvalidStatus), connect(url, additional_headers=headers):
                pass
        with connect(url, additional_headers={"Cookie": cookie}):
            pass
    finally:
        stop_server(server)
